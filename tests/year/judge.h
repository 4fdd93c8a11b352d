// What must be true of every answer and of every file, by what the lenses truly do and what was told before.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "client.h"
#include "true_lenses.h"

namespace lensd::year {

/// What was looked at, for the report.
struct Looked {
  std::uint64_t calls = 0, errors = 0, lost = 0;
  std::uint64_t moves = 0, reached = 0, verified = 0, doubtful = 0, frozen = 0;
  std::uint64_t stops = 0, rests = 0, leased = 0, kept = 0, positions = 0, presets = 0, files = 0, unknown = 0;
  std::int64_t longest_stop = 0;
};

class Judge {
 public:
  explicit Judge(Lenses& lenses) : lenses_(lenses) {}

  /// A call is about to be made; notes in it what holds now.
  void Asked(const Client& client, Call& call);
  void Answered(const Client& client, const Call& call, const Json& reply, bool last);
  /// It got no answer: the connection closed, by either side.
  void Lost(const Client& client, const Call& call);
  /// The connection closed: what it held by that is free.
  void Gone(const Client& client);
  /// Calls that wait for longer than they may.
  void LookForLate(const Client& client) const;
  enum class Ended { Killed, Regularly };
  /// No lensd runs; what it left in this folder.
  void Left(const std::string& folder, Ended how);
  /// A new one does.
  void Begun();
  /// Every lens as Status tells it.
  void Status(const Json& lenses);
  void Metrics(const Json& parameters);
  void Presets(const std::string& lens, const Json& presets);
  /// Lenses that were stopped are to rest by now.
  void LookAtRest();

  const Looked& looked() const { return looked_; }

 private:
  struct Lease {
    enum class State { None, Held, Unknown } state = State::None;
    std::uint64_t connection = 0;  ///< that took it
    std::string key;
    std::int64_t ends_from = 0, ends_by = 0;  ///< 0: with its connection
    std::int64_t changed = 0;
    int under_way = 0;  ///< calls that may change it
  };
  struct KeptAxis {
    double position = 0.0;
    std::uint64_t drives = 0;
    std::int64_t at = 0;
  };
  struct Stopped {
    std::int64_t at = 0;  ///< when it was answered
    std::uint64_t drives = 0;
  };
  enum class Saved { Yes, No, Unknown };
  /// What is known of a lens from outside.
  struct Known {
    std::uint64_t drives = 0;  ///< calls that may move it
    int driving = 0;           ///< of them without an answer
    Lease lease;
    std::map<std::string, KeptAxis> kept;
    std::optional<Stopped> stopped;
    std::map<std::string, Saved> presets;
    std::map<std::string, bool> at_start;  ///< by axis: its file says that it is known; until the first Status
    std::int64_t killed = 0;
  };
  void Moves(const Call& call, const Json& value);
  void Move(const Call& call, const Json& move);
  void OfLease(const Client& client, const Call& call, const Json& reply);
  void OfPreset(const Call& call, bool failed);
  void OfStop(const Call& call, const Json& reply);
  void Axis(const std::string& lens, const Json& axis, std::int64_t read_at);
  void AtStart(Known& known, const Json& lens);
  void File(const std::string& lens, const Json& axes, Ended how);
  bool Drives(const Call& call) const;

  Lenses& lenses_;
  std::map<std::string, Known> known_;
  std::set<std::string> homed_since_;  ///< "lens axis", since lensd began
  Looked looked_;
};

}  // namespace lensd::year
