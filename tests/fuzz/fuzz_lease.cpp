// A lease against a model of it, on a clock that is moved by hand: who holds it, until when, and what is told of it.
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "daemon/lens/lens_lease.h"
#include "loop/event_loop.h"

namespace {

using namespace lensd;
using daemon::Lease;
using daemon::LensLease;

constexpr std::size_t kConnections = 4;

/// What must hold, in the plainest words.
struct Model {
  bool held = false;
  std::string holder{};
  const void* owner = nullptr;
  std::optional<Instant> until{};

  bool holds(Instant now) const { return held && (!until || now < *until); }
};

struct Told {
  std::string change;
  std::string cause;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const auto loop = daemon::EventLoop::Create();
  SteppedClock clock;
  std::vector<Told> told;
  const auto hear = [&](const varlink::Json& change) {
    told.push_back({change.at("change"), change.at("cause").is_null() ? "" : change.at("cause").get<std::string>()});
  };
  auto lease = std::make_unique<LensLease>(**loop, clock, hear);
  Model model;
  static const char connections[kConnections] = {};
  for (const std::uint8_t byte : std::span(data, size)) {
    const std::size_t told_before = told.size();
    const bool held_before = model.holds(clock.Now()), lasted = model.held;
    const std::size_t which = (byte >> 3U) % kConnections;
    const void* const connection = &connections[which];
    const std::string name = "client " + std::to_string(which);
    switch (byte % 6) {
      case 0: {  // takes or renews, for a time or as long as it is there
        std::optional<Instant> until;
        if ((byte & 0x80U) != 0) until = clock.Now() + std::chrono::milliseconds(byte & 0x60U);
        lease->Take({.key = "k", .holder = name, .owner = connection, .until = until});
        const std::string expected = !held_before ? "taken" : model.holder == name ? "renewed" : "takenOver";
        if (told.back().change != expected) __builtin_trap();
        // What had run out meanwhile is told as ended first.
        const std::size_t ended = lasted && !held_before ? 1 : 0;
        if (told.size() != told_before + 1 + ended) __builtin_trap();
        model = {true, name, connection, until};
        break;
      }
      case 1:
        lease->Drop(LensLease::End::Dropped);
        if (lasted && told.back().cause != (held_before ? "dropped" : "expired")) __builtin_trap();
        if (told.size() != told_before + (lasted ? 1 : 0)) __builtin_trap();
        model = {};
        break;
      case 2:
        lease->Left(connection);
        if (model.held && model.owner == connection) {
          if (!model.until) {
            if (told.back().cause != "disconnected") __builtin_trap();
            model = {};
          } else {
            model.owner = nullptr;
          }
        }
        break;
      case 3: {  // its lens is opened anew
        auto next = std::make_unique<LensLease>(**loop, clock, hear);
        next->GoOnFrom(*lease);
        if (lease->now() != nullptr) __builtin_trap();
        lease = std::move(next);
        break;
      }
      default:
        clock.Advance(std::chrono::milliseconds(byte >> 2U));
    }
    const Lease* const now = lease->now();
    if ((now != nullptr) != model.holds(clock.Now())) __builtin_trap();
    if (now != nullptr && (now->holder != model.holder || now->owner != model.owner || now->until != model.until)) {
      __builtin_trap();
    }
  }
  return 0;
}
