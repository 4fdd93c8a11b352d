// Control-C is a stop, and a user who stops a lens wants to know where it has come to.
#include "cli/link/drive.h"

#include <algorithm>
#include <chrono>
#include <optional>
#include <thread>
#include <utility>

#include "cli/link/progress.h"
#include "cli/text/texts.h"

namespace lensd::cli {
namespace {

using varlink::Json;

bool Moves(const Json& state) {
  const auto moving = [](const Json& axis) { return axis.value("moving", false); };
  return std::ranges::any_of(state["axes"], moving);
}

constexpr Duration kRestAtMost = std::chrono::seconds(3);  ///< that a motor takes to come to rest

/// The states of the lens, as soon as it was read after the stop and nothing moves; what is known by then where that
/// takes too long. It asks again and again: the Control-C that led here would end a wait at once.
Json StatesAtRest(DaemonClient& link, const Json& lens) {
  constexpr Duration kAskEvery = std::chrono::milliseconds(20);
  const Instant stopped = MonotonicClock().Now(), deadline = stopped + kRestAtMost;
  const auto unsure = [&](const Json& state) {
    return Moves(state) || state.value("readAtNs", std::int64_t{0}) < stopped.time_since_epoch().count();
  };
  for (;;) {
    const auto reply = link.Ask(MethodOfLens("Status"), {{"lens", lens}});
    if (!reply) return Json::array();
    const Json& states = (*reply)["lenses"];
    if (std::ranges::none_of(states, unsure) || MonotonicClock().Now() >= deadline) return states;
    std::this_thread::sleep_for(kAskEvery);
  }
}

}  // namespace

void StopAndTell(Session& session, const Json& lens, const Json& axis) {
  auto link = DaemonClient::Open(session);
  if (!link) return session.Remark("not stopped: " + link.error().message);
  if (const auto stopped = link->Ask(MethodOfLens("Stop"), {{"lens", lens}, {"axis", axis}}); !stopped) {
    return session.Remark("not stopped: " + stopped.error().message);
  }
  const Json states = StatesAtRest(*link, lens);
  if (states.empty()) return session.Remark("stopped");
  for (const Json& state : states) session.Remark("stopped: " + StandsText(state));
}

std::expected<Json, Failure> Drive(Session& session, DaemonClient& link, std::string_view method, Json parameters,
                                   const Json& axis) {
  const Json lens = parameters.value("lens", Json());
  std::optional<ActivityLine> line(std::in_place, session, lens);
  return link.Follow(method, std::move(parameters), nullptr, [&] {
    line.reset();
    StopAndTell(session, lens, axis);
  });
}

}  // namespace lensd::cli
