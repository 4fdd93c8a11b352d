// Finding the lens that a command means in what the daemon lists.
#include "cli/link/lens_info.h"

#include <algorithm>
#include <memory>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "base/missing_optics.h"

namespace lensd::cli {

using varlink::Json;

namespace {

/// Whether its device was open at least once.
bool WasOpened(const Json& info) {
  return info.contains("model") && info["model"].is_string();
}

}  // namespace

std::expected<Json, Failure> FindInfo(DaemonClient& link, const std::string& lens) {
  auto reply = link.Ask(MethodOfLens("List"), Json::object());
  if (!reply) return PassOn(reply);
  const Json& lenses = (*reply)["lenses"];
  for (const Json& info : lenses) {
    if (lens.empty() ? lenses.size() == 1 : info.value("name", "") == lens) return info;
  }
  if (!lens.empty()) {
    Failure unknown(Exit::NotFound, "there is no lens \"" + lens + "\"; see lensctl list");
    unknown.details = std::make_shared<Json>(Json{{"lens", lens}});
    return std::unexpected(std::move(unknown));
  }
  if (lenses.empty())
    return Refuse(Exit::NotFound,
                  "no lens is configured; for a plan without one give "
                  "--focal-length");
  return Refuse(Exit::Usage, "say which lens; see lensctl list");
}

std::expected<Json, Failure> StatusOnceOpened(DaemonClient& link, const std::string& lens, Duration at_most) {
  constexpr Duration kAskEvery = std::chrono::milliseconds(50);
  const Instant deadline = MonotonicClock().Now() + at_most;
  for (;;) {
    auto reply = link.Ask(MethodOfLens("Status"), {{"lens", lens}});
    if (!reply) return PassOn(reply);
    Json status = (*reply)["lenses"][0];
    if (status["connection"] != "connecting" || MonotonicClock().Now() >= deadline) return status;
    std::this_thread::sleep_for(kAskEvery);
  }
}

std::expected<Json, Failure> FindInfoOnceOpened(DaemonClient& link, const std::string& lens) {
  constexpr Duration kAtMost = std::chrono::seconds(5);
  auto info = FindInfo(link, lens);
  if (!info || WasOpened(*info)) return info;
  const std::string name = info->value("name", "");
  if (auto status = StatusOnceOpened(link, name, kAtMost); !status) return PassOn(status);
  return FindInfo(link, name);
}

std::expected<Reloaded, Failure> ReloadAndOpen(DaemonClient& link) {
  constexpr Duration kReadAtMost = std::chrono::seconds(30), kOpenAtMost = std::chrono::seconds(15);
  auto reply = link.Ask(MethodOfLens("Reload"), Json::object(), kReadAtMost);
  if (!reply) return PassOn(reply);
  const Instant deadline = MonotonicClock().Now() + kOpenAtMost;
  std::vector<std::string> absent;
  for (const char* const what : {"added", "reopened"}) {
    for (const Json& name : (*reply)[what]) {
      const auto lens = name.get<std::string>();
      auto status = StatusOnceOpened(link, lens, std::max(Duration{}, deadline - MonotonicClock().Now()));
      if (!status && status.error().status == Exit::NotFound) continue;  // somebody removed it meanwhile
      if (!status) return PassOn(status);
      if ((*status)["connection"] == "connected") continue;
      const Json& why = (*status)["error"];
      absent.push_back(lens + " is not open: " + (why.is_string() ? why.get<std::string>() : "lensd does not say why"));
    }
  }
  return Reloaded{*std::move(reply), std::move(absent)};
}

bool IsLens(const Session& session, const std::string& name) {
  auto link = DaemonClient::Open(session);
  return !name.empty() && link && FindInfo(*link, name);
}

std::string RefusedReload(const Failure& failure) {
  return (failure.status == Exit::Config ? "lensd refused the configuration: " : "") + failure.message;
}

std::vector<LensRemark> RemarksOn(const Json& info) {
  std::vector<LensRemark> remarks;
  const Json optics = info.value("optics", Json());
  if (!optics.is_object()) return remarks;
  const Json axes = info.value("axes", Json::array());
  const auto axis = [&](const char* name) {
    return std::ranges::find_if(axes, [&](const Json& one) { return one["axis"] == name; });
  };
  const auto focus = axis("focus");
  if (focus != axes.end() && focus->contains("direction") && focus->at("direction").is_null()) {
    const std::string by_hand = "say direction = \"near-positive\" or \"near-negative\" in [lens.focus]";
    remarks.push_back({"the direction of its focus is not known: distances, applied plans and stacks are refused",
                       info.value("camera", Json()).is_object()
                           ? "put a subject at a known distance before it, then: lensctl setup " +
                                 info.value("name", "") + " --at DISTANCE; or " + by_hand
                           : by_hand + ", then: lensctl reload"});
  }
  if (optics.value("focalLengthMaxMm", Json()).is_number() && axis("zoom") == axes.end()) {
    remarks.push_back({"its focal length is configured as a range, and it has no motorised zoom",
                       "give focal_length_mm in [lens.optics] the one focal length that it is set to, then: lensctl "
                       "reload"});
  }
  return remarks;
}

std::optional<Failure> NothingToPlan(const Json& info) {
  const auto optics = info.find("optics");
  if (!WasOpened(info) || (optics != info.end() && optics->is_object())) return std::nullopt;
  return Failure(Exit::Unsupported,
                 OpticsMissing("nothing can be planned: the optics of \"" + info.value("name", "") + "\" are"));
}

std::optional<Failure> WhereUnknown(const Json& info, const Json& status, const std::string& what) {
  if (!info.value("optics", Json()).is_object()) return std::nullopt;
  const std::string name = info.value("name", "");
  for (const char* const needed : {"iris", "zoom"}) {
    const auto is_needed = [needed](const Json& axis) { return axis["axis"] == needed; };
    const Json axes = info.value("axes", Json::array()), states = status.value("axes", Json::array());
    const auto axis = std::ranges::find_if(axes, is_needed), state = std::ranges::find_if(states, is_needed);
    if (axis == axes.end() || state == states.end()) continue;
    const bool lost = state->value("positionUnknown", Json()) == true;
    if (!lost && state->value("homed", false)) continue;
    const bool iris = std::string_view(needed) == "iris";
    std::string why = what;
    why.append(": where the ").append(needed).append(" stands is not known, and so neither is the ");
    why.append(iris ? "f-number. " : "focal length. ");
    why.append(lost ? "Say where it stands: lensctl here " : "Search its reference: lensctl home ").append(name);
    if (lost) why.append(" ").append(needed).append(" @N");
    return Failure(Exit::NotHomed, why);
  }
  return std::nullopt;
}

}  // namespace lensd::cli
