// The blur's diameter grows in proportion to the way from the focus, on either side. With the sign of the side it is a
// straight line over the position: its slope is what is looked for. Thin-lens geometry then says how much extension a
// step is, since a disk of diameter b on the sensor is e - e' = b N (f + e) / f away from focus.
#include "cli/online/setup/setup_blur.h"

#include <algorithm>
#include <cmath>

#include "cli/online/pictures/pictures.h"

namespace lensd::cli {
namespace {

using varlink::Json;

constexpr int kSharpPictures = 4;         ///< their differences tell the noise, which would pass for detail
constexpr double kFirstPart = 1.0 / 128;  ///< of the range: the first step away from focus
constexpr double kClearPx = 2.5;          ///< of blur: what is clearly more than that of the best focus
constexpr double kWanted[] = {-6.0 / 6, -5.0 / 6, -4.0 / 6, -3.0 / 6, 3.0 / 6, 4.0 / 6, 5.0 / 6, 6.0 / 6};
constexpr double kWidestPx = 6.0;      ///< of blur in these pictures
constexpr double kWide = 0.05;         ///< half an interval over its blur: more blur tells more
constexpr double kOfLargest = 0.8;     ///< of what is looked for, the most that is wanted
constexpr double kTooWide = 0.2;       ///< half an interval over its slope: nothing is said
constexpr double kMostClipped = 0.01;  ///< of the pixels of a picture
constexpr double kDiskError = 0.02;    ///< of the slope: what a disk is not, and the blur of the sharp picture

/// By lensd.
class Looker : public FocusPictures {
 public:
  Looker(DaemonClient& link, const std::string& lens, Json region)
      : link_(link), lens_(lens), region_(std::move(region)) {}

  /// Where it then is. Superseded: another command has moved the focus since it was there last. A lens with a
  /// thermometer may be moved by lensd itself, and is not looked at for that.
  std::expected<double, Failure> Go(double position) override {
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

  std::expected<LightPicture, Failure> Look() override {
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

/// Several pictures of one place.
std::expected<std::vector<LightPicture>, Failure> LookOften(FocusPictures& pictures) {
  std::vector<LightPicture> alike;
  for (int i = 0; i < kSharpPictures; ++i) {
    auto picture = pictures.Look();
    if (!picture) return PassOn(picture);
    alike.push_back(*std::move(picture));
  }
  return alike;
}

bool Has(const FocusReach& reach, double position) {
  return position >= reach.low && position <= reach.high;
}

double OnGrid(const FocusReach& reach, double position) {
  return reach.low + std::round((position - reach.low) / reach.resolution) * reach.resolution;
}

/// A blur that is clearly more than that of the best focus, and how far from focus it is.
struct ClearBlur {
  double away = 0.0;  ///< native units
  DiskBetween blur;
};

/// Goes away from focus by steps, each twice the one before, until the blur is clear. Nothing: it never is.
std::expected<std::optional<ClearBlur>, Failure> FirstClearBlur(FocusPictures& pictures, const SharpPicture& sharp,
                                                                const FocusReach& reach, double focus) {
  const double side = focus - reach.low > reach.high - focus ? -1.0 : 1.0;
  std::optional<ClearBlur> seen;
  double away = std::max(2.0 * reach.resolution, kFirstPart * (reach.high - reach.low));
  for (; Has(reach, focus + side * away); away *= 2.0) {
    const auto there = pictures.Go(OnGrid(reach, focus + side * away));
    if (!there) return PassOn(there);
    const auto picture = pictures.Look();
    if (!picture) return PassOn(picture);
    const auto blur = sharp.BlurOf(*picture);
    if (!blur) break;
    if (blur->low > 0.0 && *there != focus) seen = ClearBlur{std::abs(*there - focus), *blur};
    if (blur->low > kClearPx) break;
  }
  return seen;
}

/// Where pictures are taken, lowest first. Where the blur that was seen is told by its contrast alone, wider disks tell
/// more.
std::vector<double> Places(const FocusReach& reach, double focus, const ClearBlur& clear, double largest) {
  std::vector<double> places;
  const bool wide = clear.blur.high - clear.blur.low > 2.0 * kWide * clear.blur.px;
  const double most = wide ? kOfLargest * largest : std::min(kWidestPx, kOfLargest * largest);
  for (const double part : kWanted) {
    const double place = OnGrid(reach, focus + part * most * clear.away / clear.blur.px);
    if (Has(reach, place) && std::abs(place - focus) >= reach.resolution) places.push_back(place);
  }
  const auto same = std::ranges::unique(places);
  places.erase(same.begin(), same.end());
  return places;
}

/// What one picture has shown.
struct BlurAt {
  double position = 0.0;
  DiskBetween blur;
};

/// Takes one picture at every place, and the sharp ones on the way.
std::expected<std::vector<BlurAt>, Failure> Pass(FocusPictures& pictures, const std::vector<double>& places,
                                                 const FocusReach& reach, double focus) {
  std::vector<BlurAt> seen;
  const double before = std::max(reach.low, places.front() - 0.25 * (places.back() - places.front()));
  if (auto moved = pictures.Go(OnGrid(reach, before)); !moved) return PassOn(moved);
  std::optional<SharpPicture> sharp;
  std::vector<std::pair<double, LightPicture>> taken;
  const auto look_sharply = [&]() -> std::expected<void, Failure> {
    if (auto moved = pictures.Go(focus); !moved) return PassOn(moved);
    const auto picture = LookOften(pictures);
    if (!picture) return PassOn(picture);
    sharp.emplace(*picture);
    return {};
  };
  for (const double place : places) {
    if (place > focus && !sharp) {
      if (auto looked = look_sharply(); !looked) return PassOn(looked);
    }
    const auto there = pictures.Go(place);
    if (!there) return PassOn(there);
    auto picture = pictures.Look();
    if (!picture) return PassOn(picture);
    taken.emplace_back(*there, *std::move(picture));
  }
  if (!sharp) {
    if (auto looked = look_sharply(); !looked) return PassOn(looked);
  }
  for (const auto& [place, picture] : taken) {
    // A picture that may as well be sharp says nothing of a slope.
    if (const auto blur = sharp->BlurOf(picture); blur && blur->low > 0.0) seen.push_back({place, *blur});
  }
  return seen;
}

/// The line through the blurs, one of `of` of each, with the sign of the side. Nothing: there are too few.
std::optional<Line> LineThrough(const std::vector<BlurAt>& seen, double focus, double DiskBetween::* of) {
  std::vector<std::pair<double, double>> points;
  const auto side = [focus](double place, double blur) { return place < focus ? -blur : blur; };
  for (const BlurAt& one : seen) points.emplace_back(one.position, side(one.position, one.blur.*of));
  auto line = FitLine(points);
  if (!line || line->slope <= 0.0) return line;
  // The picture that counts as sharp was itself a little beside the focus: such a disk takes its square from the
  // others.
  const double own = line->At(focus);
  for (auto& [place, blur] : points) blur = side(place, std::hypot(blur, own));
  return FitLine(points);
}

BlurSlope SlopeOf(const std::vector<BlurAt>& seen, double focus) {
  BlurSlope slope;
  slope.pictures = static_cast<int>(seen.size());
  const auto line = LineThrough(seen, focus, &DiskBetween::px);
  const auto least = LineThrough(seen, focus, &DiskBetween::low), most = LineThrough(seen, focus, &DiskBetween::high);
  if (!line || !least || !most) {
    slope.why_not = "fewer than four pictures show a blur that a disk explains";
    return slope;
  }
  // The pictures' own intervals count in full: what makes one too large, such as other light, makes all so.
  const double half = std::hypot(line->slope_half, kDiskError * line->slope);
  const double low = std::min(line->slope, least->slope) - half, high = std::max(line->slope, most->slope) + half;
  if (low <= 0.0) {
    slope.why_not = "the blur does not grow with the distance from focus";
    return slope;
  }
  if (high - low > 2.0 * kTooWide * line->slope) {
    slope.why_not =
        "the pictures leave it open by more than a fifth: the texture repeats or is faint, the light changes, or "
        "the region shows things at several distances; more detail in the picture, or another --roi, is needed";
    return slope;
  }
  slope.px_per_step = Measured{line->slope, low, high};
  slope.focus = -line->at_zero / line->slope;
  return slope;
}

}  // namespace

std::expected<BlurSlope, Failure> MeasureBlurSlope(FocusPictures& pictures, const FocusReach& reach, double focus) {
  BlurSlope none;
  const auto because = [&](const char* why) {
    none.why_not = why;
    return none;
  };
  if (!Has(reach, focus)) return because("focus is in the last tenth of the travel, which setup does not enter");
  const auto first = LookOften(pictures);
  if (!first) return PassOn(first);
  if (std::min(first->front().width, first->front().height) < SharpPicture::kSmallest) {
    return because("the region is smaller than 32 px: give a larger one with --roi");
  }
  if (first->front().Clipped() > kMostClipped) {
    return because("parts of the region are too bright for the sensor: less light or a shorter exposure is needed");
  }
  const SharpPicture sharp(*first);
  const auto clear = FirstClearBlur(pictures, sharp, reach, focus);
  if (!clear) return PassOn(clear);
  std::vector<double> places;
  if (*clear) places = Places(reach, focus, **clear, sharp.largest());
  std::expected<std::vector<BlurAt>, Failure> seen;
  if (places.size() >= 4) seen = Pass(pictures, places, reach, focus);
  if (!seen) return PassOn(seen);
  if (auto back = pictures.Go(focus); !back) return PassOn(back);
  if (!*clear) {
    return because(
        "no blur was seen on either step from focus: more light, a wider opening or more detail in the picture is "
        "needed");
  }
  if (places.size() < 4) return because("too few steps make a blur that can be measured");
  return SlopeOf(*seen, focus);
}

std::expected<BlurSlope, Failure> MeasureBlurSlope(DaemonClient& link, const std::string& lens, const Json& info,
                                                   const Json& region, double focus) {
  const double minimum = info["minimum"].get<double>(), range = info["maximum"].get<double>() - minimum;
  Looker looker(link, lens, region.is_null() ? Json{{"x", 0.3}, {"y", 0.3}, {"w", 0.4}, {"h", 0.4}} : region);
  return MeasureBlurSlope(
      looker,
      {minimum + kSetupMargin * range, minimum + (1.0 - kSetupMargin) * range, info["resolution"].get<double>()},
      focus);
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
