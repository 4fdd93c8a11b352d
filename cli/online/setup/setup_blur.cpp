// The blur's diameter grows in proportion to the way from the focus, on either side. With the sign of the side it is a
// straight line over the position: its slope is what is looked for. Thin-lens geometry then says how much extension a
// step is, since a disk of diameter b on the sensor is e - e' = b N (f + e) / f away from focus.
#include "cli/online/setup/setup_blur.h"

#include <algorithm>
#include <cmath>

#include "cli/online/pictures/picture_blur.h"
#include "cli/online/pictures/pictures.h"

namespace lensd::cli {
namespace {

using varlink::Json;

constexpr int kSharpPictures = 4;         ///< averaged: their noise would pass for detail
constexpr double kFirstPart = 1.0 / 128;  ///< of the range: the first step away from focus
constexpr double kClearPx = 2.5;          ///< of blur: what is clearly more than that of the best focus
constexpr double kWantedPx[] = {-6.0, -5.0, -4.0, -3.0, 3.0, 4.0, 5.0, 6.0};
constexpr double kDiskError = 0.02;  ///< of the slope: what a disk is not, and the blur of the sharp picture

/// Moves and looks.
class Looker {
 public:
  Looker(DaemonClient& link, const std::string& lens, Json region)
      : link_(link), lens_(lens), region_(std::move(region)) {}

  /// Where it then is. Superseded: another command has moved the focus since it was there last. A lens with a
  /// thermometer may be moved by lensd itself, and is not looked at for that.
  std::expected<double, Failure> Go(double position) {
    auto before = Sent();
    if (!before) return PassOn(before);
    if (sent_ && *before && **before != *sent_) return Refuse(Exit::Superseded, "focus was sent elsewhere");
    auto reply = link_.Follow(MethodOfLens("Move"),
                              {{"lens", lens_}, {"axis", "focus"}, {"target", {{"position", position}}}}, nullptr);
    if (!reply) return PassOn(reply);
    auto after = Sent();
    if (!after) return PassOn(after);
    sent_ = *after;
    return (*reply)["move"]["position"].get<double>();
  }

  std::expected<LightPicture, Failure> Look() {
    auto taken = TakeSnapshot(link_, {{"lens", lens_}, {"region", region_}, {"encoding", "raw"}});
    if (!taken) return PassOn(taken);
    const Json& shown = taken->frame["picture"];
    const int bits = shown["bits"].get<int>(), channels = shown["channels"].get<int>();
    const double gamma = shown["gamma"].get<double>(), full = std::pow(2.0, bits) - 1.0;
    LightPicture picture{shown["widthPx"].get<int>(), shown["heightPx"].get<int>(), {}};
    const std::size_t bytes = bits > 8 ? 2 : 1, pixel = bytes * static_cast<std::size_t>(channels);
    for (std::size_t at = 0; at + pixel <= taken->bytes.size(); at += pixel) {
      // Of a colour picture green: it is the one that most pixels measure.
      const std::uint8_t* sample = &taken->bytes[at + (channels == 3 ? bytes : 0)];
      const double value = bytes == 1 ? sample[0] : sample[0] + 256.0 * sample[1];
      picture.light.push_back(std::pow(value / full, gamma));
    }
    if (picture.light.size() != static_cast<std::size_t>(picture.width) * static_cast<std::size_t>(picture.height)) {
      return Refuse(Exit::Protocol, "a picture has another size than it says");
    }
    return picture;
  }

  std::expected<LightPicture, Failure> LookOften() {
    auto sum = Look();
    for (int i = 1; sum && i < kSharpPictures; ++i) {
      const auto next = Look();
      if (!next) return PassOn(next);
      std::ranges::transform(sum->light, next->light, sum->light.begin(), std::plus());
    }
    return sum;
  }

 private:
  /// Where focus was sent by the last command. Nothing: lensd corrects focus by the temperature.
  std::expected<std::optional<double>, Failure> Sent() {
    auto reply = link_.Ask(MethodOfLens("Status"), {{"lens", lens_}});
    if (!reply) return PassOn(reply);
    const Json& status = (*reply)["lenses"][0];
    if (status["temperatureC"].is_number()) return std::nullopt;
    for (const Json& axis : status["axes"]) {
      if (axis["axis"] == "focus") return axis["target"].get<double>();
    }
    return std::nullopt;
  }

  DaemonClient& link_;
  const std::string lens_;
  const Json region_;
  std::optional<double> sent_;  ///< by the last Go
};

/// The part of the range that is gone to.
struct Reach {
  double low, high, resolution;
  bool Has(double position) const { return position >= low && position <= high; }
  double OnGrid(double position) const { return low + std::round((position - low) / resolution) * resolution; }
};

/// Px a native unit, roughly: steps away from focus, each twice the one before, until the blur is clear; 0: it never
/// is.
std::expected<double, Failure> RoughSlope(Looker& looker, const SharpPicture& sharp, const Reach& reach, double focus) {
  const double side = focus - reach.low > reach.high - focus ? -1.0 : 1.0;
  double away = std::max(2.0 * reach.resolution, kFirstPart * (reach.high - reach.low));
  double seen = 0.0;
  for (; reach.Has(focus + side * away); away *= 2.0) {
    if (auto moved = looker.Go(reach.OnGrid(focus + side * away)); !moved) return PassOn(moved);
    const auto picture = looker.Look();
    if (!picture) return PassOn(picture);
    const auto blur = sharp.BlurOf(*picture);
    if (!blur) break;
    seen = *blur / away;
    if (*blur > kClearPx) return seen;
  }
  return seen;
}

/// Where pictures are taken, lowest first.
std::vector<double> Places(const Reach& reach, double focus, double slope, double largest) {
  std::vector<double> places;
  for (const double blur : kWantedPx) {
    const double place = reach.OnGrid(focus + std::min(1.0, 0.8 * largest / 6.0) * blur / slope);
    if (reach.Has(place) && std::abs(place - focus) >= reach.resolution) places.push_back(place);
  }
  const auto same = std::ranges::unique(places);
  places.erase(same.begin(), same.end());
  return places;
}

/// What one pass over the focus has shown: position and px of blur, with the sign of the side.
using Blurs = std::vector<std::pair<double, double>>;

/// Takes one picture at every place, and the sharp ones on the way.
std::expected<Blurs, Failure> Pass(Looker& looker, const std::vector<double>& places, const Reach& reach,
                                   double focus) {
  Blurs seen;
  const double before = std::max(reach.low, places.front() - 0.25 * (places.back() - places.front()));
  if (auto moved = looker.Go(reach.OnGrid(before)); !moved) return PassOn(moved);
  std::optional<SharpPicture> sharp;
  std::vector<std::pair<double, LightPicture>> pictures;
  const auto look_sharply = [&]() -> std::expected<void, Failure> {
    if (auto moved = looker.Go(focus); !moved) return PassOn(moved);
    const auto picture = looker.LookOften();
    if (!picture) return PassOn(picture);
    sharp.emplace(*picture);
    return {};
  };
  for (const double place : places) {
    if (place > focus && !sharp) {
      if (auto looked = look_sharply(); !looked) return PassOn(looked);
    }
    const auto there = looker.Go(place);
    if (!there) return PassOn(there);
    auto picture = looker.Look();
    if (!picture) return PassOn(picture);
    pictures.emplace_back(*there, *std::move(picture));
  }
  if (!sharp) {
    if (auto looked = look_sharply(); !looked) return PassOn(looked);
  }
  for (const auto& [place, picture] : pictures) {
    if (const auto blur = sharp->BlurOf(picture)) seen.emplace_back(place, place < focus ? -*blur : *blur);
  }
  return seen;
}

BlurSlope SlopeOf(const Blurs& seen, double focus) {
  BlurSlope slope;
  slope.pictures = static_cast<int>(seen.size());
  auto line = FitLine(seen);
  if (line && line->slope > 0.0) {
    // The picture that counts as sharp was itself a little beside the focus: such a disk takes its square from the
    // others.
    const double own = line->At(focus);
    std::vector<std::pair<double, double>> whole = seen;
    for (auto& [place, blur] : whole) blur = std::copysign(std::hypot(blur, own), blur);
    line = FitLine(whole);
  }
  if (!line) {
    slope.why_not = "fewer than four pictures show a blur that a disk explains";
    return slope;
  }
  const double half = std::hypot(line->slope_half, kDiskError * line->slope);
  if (line->slope <= half) {
    slope.why_not = "the blur does not grow with the distance from focus";
    return slope;
  }
  slope.px_per_step = Measured{line->slope, line->slope - half, line->slope + half};
  slope.focus = -line->at_zero / line->slope;
  return slope;
}

}  // namespace

std::expected<BlurSlope, Failure> MeasureBlurSlope(DaemonClient& link, const std::string& lens, const Json& info,
                                                   const Json& region, double focus) {
  const double minimum = info["minimum"].get<double>(), range = info["maximum"].get<double>() - minimum;
  const Reach reach{minimum + kSetupMargin * range, minimum + (1.0 - kSetupMargin) * range,
                    info["resolution"].get<double>()};
  BlurSlope none;
  const auto because = [&](const char* why) {
    none.why_not = why;
    return none;
  };
  if (!reach.Has(focus)) return because("focus is in the last tenth of the travel, which setup does not enter");
  Looker looker(link, lens, region.is_null() ? Json{{"x", 0.3}, {"y", 0.3}, {"w", 0.4}, {"h", 0.4}} : region);
  const auto first = looker.LookOften();
  if (!first) return PassOn(first);
  if (std::min(first->width, first->height) < SharpPicture::kSmallest) {
    return because("the region is smaller than 32 px: give a larger one with --roi");
  }
  const SharpPicture sharp(*first);
  const auto rough = RoughSlope(looker, sharp, reach, focus);
  if (!rough) return PassOn(rough);
  const auto places = *rough > 0.0 ? Places(reach, focus, *rough, sharp.largest()) : std::vector<double>();
  std::expected<Blurs, Failure> seen;
  if (places.size() >= 4) seen = Pass(looker, places, reach, focus);
  if (!seen) return PassOn(seen);
  if (auto back = looker.Go(focus); !back) return PassOn(back);
  if (*rough == 0.0)
    return because(
        "no blur was seen on either step from focus: more light, a wider opening or more detail in the picture is "
        "needed");
  if (places.size() < 4) return because("too few steps make a blur that can be measured");
  return SlopeOf(*seen, focus);
}

NominalCurve CurveOf(const CurveFacts& facts, const Measured& px_per_step) {
  constexpr int kParts = 8;
  const double f = facts.focal_length_mm;
  const auto vergence_at = [&](double e) { return 1e3 * e / (f * (f + e)); };
  const double fu = 1e-3 * f * facts.vergence, there = f * fu / (1.0 - fu);
  const double mm_per_px = 1e-3 * facts.pixel_um * facts.f_number * (f + there) / f;
  const double anchor = 1.96e-3 * facts.vergence_sigma * (f + there) * (f + there);  // e = f^2 U / (1 - f U)
  NominalCurve curve;
  for (int i = 0; i <= kParts; ++i) {
    const double position = facts.minimum + (facts.maximum - facts.minimum) * i / kParts;
    const double way = (facts.near_positive ? 1.0 : -1.0) * (position - facts.focus) * mm_per_px;
    const auto [least, most] = std::minmax({way * px_per_step.low, way * px_per_step.high});
    const double low = there + least - anchor, high = there + most + anchor;
    const double middle = there + way * px_per_step.value;
    curve.points.push_back({.position = position,
                            .extension_mm = {middle, low, high},
                            .vergence = {vergence_at(middle), vergence_at(low), vergence_at(high)}});
  }
  return curve;
}

}  // namespace lensd::cli
