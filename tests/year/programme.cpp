// Mostly moves; now and then everything else that the interface has for a lens.
#include "programme.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "true_lenses.h"

namespace lensd::year {
namespace {

Json Target(Chance& chance, bool iris) {
  if (iris) return {{"fNumber", std::round(10.0 * chance.Between(1.4, 16.0)) / 10.0}};
  switch (chance.Below(6)) {
    case 0:
      return {{"relative", std::round(chance.Between(-200.0, 200.0))}};
    case 1:
      return {{"distanceM", chance.Between(0.6, 20.0)}};
    case 2:
      return {{"nearer", std::round(chance.Between(-50.0, 50.0))}};
    default:
      return {{"position", std::round(chance.Between(0.0, 4000.0))}};
  }
}

Call Moving(Chance& chance, const Mind& mind) {
  const bool iris = chance.OneIn(5);
  Call call{.method = "Move", .more = chance.OneIn(6)};
  call.parameters = {{"lens", mind.lens}, {"axis", iris ? "iris" : "focus"}, {"target", Target(chance, iris)}};
  return call;
}

Call Simple(std::string method, const Mind& mind) {
  return {.method = std::move(method), .parameters = {{"lens", mind.lens}}};
}

Call OfPresets(Chance& chance, const Mind& mind) {
  static constexpr std::array kMethods = {"PresetSave", "PresetSave", "PresetRecall", "PresetRecall", "PresetRemove"};
  Call call = Simple(kMethods[chance.Below(kMethods.size())], mind);
  call.parameters["label"] = "p" + std::to_string(chance.Below(5));
  return call;
}

Call OfLeases(Chance& chance, Role role, const Mind& mind) {
  Call call = Simple(chance.OneIn(4) ? "DropLease" : "TakeLease", mind);
  if (call.method == "DropLease") return call;
  if (!chance.OneIn(3)) call.parameters["forMs"] = std::round(chance.Between(500.0, 60'000.0));
  if (chance.OneIn(4)) call.parameters["stop"] = true;
  if (role == Role::Administrator && chance.OneIn(3)) call.parameters["takeOver"] = true;
  return call;
}

Call Stopping(Chance& chance, const Mind& mind) {
  Call call{.method = "Stop"};
  if (!chance.OneIn(4)) call.parameters["lens"] = mind.lens;
  if (chance.OneIn(8)) call.parameters["axis"] = "focus";
  if (chance.OneIn(10)) call.parameters["latch"] = true;
  return call;
}

Call Looking(Chance& chance, const Mind& mind) {
  static constexpr std::array kMethods = {"Status", "GetCalibration", "PresetList", "GetExposure", "Metrics"};
  return Simple(kMethods[chance.Below(kMethods.size())], mind);
}

Call Administering(Chance& chance, const Mind& mind) {
  if (chance.OneIn(4)) return {.method = "Reload"};
  Call call = Simple("Calibrate", mind);
  if (chance.OneIn(3)) {
    call.parameters["remove"] = true;
    return call;
  }
  // As the nominal optics have it, but for some micrometres: 25 mm, 0 to 1.6 mm of extension over 4000 steps.
  Json points = Json::array();
  for (int i = 0; i <= 4; ++i) {
    points.push_back({{"position", 1000.0 * i}, {"extensionMm", 0.4 * i + chance.Between(-0.002, 0.002)}});
  }
  call.parameters["points"] = points;
  call.parameters["errorUm"] = 10.0;
  return call;
}

std::string FavouredLens(Chance& chance) {
  return LensName(chance.Below(4));
}

}  // namespace

std::string AnyLens(Chance& chance) {
  return LensName(chance.Below(Lenses::kCount));
}

Call NextCall(Chance& chance, Role role, Mind& mind) {
  // Half of all work is on four lenses, so that people get into each other's way.
  if (mind.lens.empty() || chance.OneIn(4)) mind.lens = chance.OneIn(2) ? AnyLens(chance) : FavouredLens(chance);
  if (const std::string lens = std::exchange(mind.must_home, ""); !lens.empty()) {
    return {.method = "Home", .parameters = {{"lens", lens}}};
  }
  if (const std::string lens = std::exchange(mind.latched, ""); !lens.empty()) {
    return {.method = "ResetFaults", .parameters = {{"lens", lens}}};
  }
  const std::uint64_t which = chance.Below(100);
  Call call = which < 50   ? Moving(chance, mind)
              : which < 60 ? Stopping(chance, mind)
              : which < 66 ? Simple("Home", mind)
              : which < 76 ? OfPresets(chance, mind)
              : which < 84 ? OfLeases(chance, role, mind)
              : which < 94 ? Looking(chance, mind)
              : which < 96 ? Simple("Undo", mind)
              : which < 97 ? Simple("Autofocus", mind)
                           : Administering(chance, mind);
  const bool gives_key =
      !mind.lease.empty() && call.method != "Stop" && call.parameters.contains("lens") && chance.OneIn(2);
  static constexpr std::array<std::string_view, 5> kNoKey = {"Status", "GetCalibration", "PresetList", "GetExposure",
                                                             "Metrics"};
  if (gives_key && std::ranges::find(kNoKey, call.method) == kNoKey.end()) call.parameters["lease"] = mind.lease;
  return call;
}

}  // namespace lensd::year
