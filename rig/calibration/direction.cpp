// Which way focus counts: the configuration, a calibration, a measurement and the driver are asked in this order. Where
// two of them disagree the first is believed, and people are told.
#include "rig/direction.h"

#include <algorithm>
#include <array>
#include <vector>

namespace lensd::rig {
namespace {

using drivers::Direction;

std::optional<Direction> OfCalibration(const Calibration* calibration) {
  if (calibration == nullptr) return std::nullopt;
  for (const FocusCurve& curve : calibration->focus) {
    if (const auto told = DirectionOf(curve)) return told;
  }
  return std::nullopt;
}

/// Dioptres and millimetres of extension grow toward near by what they are.
std::optional<drivers::KnownDirection> OfDriver(const drivers::AxisCapabilities& can) {
  if (can.direction) return can.direction;
  if (can.unit == drivers::NativeUnit::Dioptres)
    return drivers::KnownDirection{Direction::NearPositive, "its unit, dioptres"};
  if (can.unit == drivers::NativeUnit::Millimetres) {
    return drivers::KnownDirection{Direction::NearPositive, "its unit, millimetres of extension"};
  }
  return std::nullopt;
}

struct Voice {
  DirectionFrom from;
  std::optional<Direction> says;
  std::string who;
};

/// A configured direction is there to overrule the driver: that is no contradiction.
std::string Contradiction(const Voice& believed, const std::array<Voice, 4>& voices) {
  for (const Voice& other : voices) {
    if (!other.says || other.from <= believed.from || *other.says == *believed.says) continue;
    if (believed.from == DirectionFrom::Configured && other.from == DirectionFrom::Driver) continue;
    return "focus counts " + std::string(drivers::DirectionName(*believed.says)) + " by " + believed.who + ", and " +
           std::string(drivers::DirectionName(*other.says)) + " by " + other.who + ": lensd goes by " + believed.who;
  }
  return "";
}

}  // namespace

std::optional<Direction> DirectionOf(const FocusCurve& curve) {
  const auto way = [&](const auto& meaning) -> std::optional<Direction> {
    std::optional<double> first, last;
    for (const FocusPoint& point : curve.points) {
      if (const auto& value = meaning(point)) (first ? last : first) = value->value;
    }
    if (!first || !last || *first == *last) return std::nullopt;
    return *last > *first ? Direction::NearPositive : Direction::NearNegative;
  };
  const auto by_vergence = way([](const FocusPoint& point) { return point.vergence; });
  return by_vergence ? by_vergence : way([](const FocusPoint& point) { return point.extension; });
}

FocusDirection DirectionOf(const AxisConfig& config, const drivers::AxisCapabilities& can,
                           const Calibration* calibration) {
  const auto driver = OfDriver(can);
  const std::string by = driver ? std::string(driver->by) : "";
  const std::array<Voice, 4> voices = {
      Voice{DirectionFrom::Configured, config.direction, "`direction` of [lens.focus]"},
      Voice{DirectionFrom::Calibration, OfCalibration(calibration), "its calibration"},
      Voice{DirectionFrom::Seen, config.seen, "what setup saw"},
      Voice{DirectionFrom::Driver, driver ? std::optional(driver->direction) : std::nullopt, by}};
  FocusDirection found;
  const auto believed = std::ranges::find_if(voices, [](const Voice& voice) { return voice.says.has_value(); });
  if (believed == voices.end()) {
    if (config.approach_near) {
      found.warning = std::string("`approach = \"") + (*config.approach_near ? "near" : "far") +
                      "\"` cannot be followed while it is not known which way focus counts: until then focus is "
                      "approached toward larger positions. Set `direction` in [lens.focus], or run `lensctl setup "
                      "--at DISTANCE`";
    }
    return found;
  }
  found.direction = believed->says;
  found.from = believed->from;
  if (found.from == DirectionFrom::Driver) found.by = by;
  found.warning = Contradiction(*believed, voices);
  // A calibration that nobody's word came before was measured from the side from which the lens was approached then.
  const bool alone = found.from == DirectionFrom::Calibration && std::ranges::none_of(voices, [&](const Voice& other) {
                       return other.from != DirectionFrom::Calibration && other.says == found.direction;
                     });
  const bool measured_near =
      !alone || std::ranges::any_of(calibration->focus, [](const FocusCurve& curve) { return curve.approach_near; });
  found.approach_near = config.approach_near.value_or(measured_near);
  found.approach_up = found.approach_near == found.near_positive();
  return found;
}

Result<Direction> ReadSeenDirection(const Settings& file) {
  SettingsReader read(file, "what was seen of the direction");
  (void)read.Integer("version", 1, {1.0, 1.0});
  const std::vector<std::string_view> names(drivers::kDirectionNames.begin(), drivers::kDirectionNames.end());
  if (!read.Has("focus")) read.Reject("focus", "must be \"near-positive\" or \"near-negative\"");
  const auto seen = static_cast<Direction>(read.Choice("focus", names, 0));
  (void)read.Text("made", "");
  if (auto done = read.Finish(); !done) return PassOn(done);
  return seen;
}

std::string SeenDirectionText(Direction seen, const std::string& made) {
  return "version = 1\nfocus = \"" + std::string(drivers::DirectionName(seen)) + "\"\nmade = \"" + made + "\"\n";
}

Error DirectionUnknown(std::string_view what) {
  return Fail(Code::Unsupported,
              std::string(what) +
                  ": it is not known whether larger focus positions of this lens focus nearer or farther. Set "
                  "`direction` "
                  "in its [lens.focus] to \"near-positive\" or \"near-negative\", or let `lensctl setup --at DISTANCE` "
                  "find "
                  "out; native positions, such as @1200, can be used meanwhile",
              {.axis = "focus"})
      .error();
}

}  // namespace lensd::rig
