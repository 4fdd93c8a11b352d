// How the events of Monitor are numbered, so that its clients see what they missed.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "daemon/server/random_name.h"

namespace lensd::daemon {

/// The place of an event among all that happened to its lens.
struct EventNumber {
  std::int64_t sequence = 0;  ///< counts everything, from 1
  std::int64_t lasting = 0;   ///< of those, what no monitor is spared: everything but states and progress
};

/// Counts by the lens' name what happened to it in this run of the program: a lens that is opened anew goes on
/// counting.
class EventCounts {
 public:
  /// Names this run.
  const std::string& instance() const { return instance_; }
  /// Of what happened last.
  EventNumber Of(const std::string& lens) const {
    const auto found = last_.find(lens);
    return found == last_.end() ? EventNumber{} : found->second;
  }
  /// Something happened that something newer may stand for.
  EventNumber Passing(const std::string& lens) {
    EventNumber& last = last_[lens];
    ++last.sequence;
    return last;
  }
  /// Something else happened.
  EventNumber Lasting(const std::string& lens) {
    EventNumber& last = last_[lens];
    ++last.sequence;
    ++last.lasting;
    return last;
  }
  /// The reply of Monitor: `json` is the field of an Event.
  std::string ReplyOf(const std::string& lens, EventNumber number, std::string_view field,
                      std::string_view json) const {
    std::string reply = R"({"event":{"instance":")" + instance_ + R"(","lens":")" + lens + R"(","sequence":)";
    reply += std::to_string(number.sequence) + R"(,"lasting":)" + std::to_string(number.lasting) + ",\"";
    return reply.append(field).append("\":").append(json).append("}}");
  }

 private:
  const std::string instance_ = RandomName();
  std::map<std::string, EventNumber> last_;
};

}  // namespace lensd::daemon
