// The rules are those of the header; all of them work on rows of a window, and none needs the level of the noise.
#include "autofocus/frame_gate.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

namespace lensd::autofocus {
namespace {

constexpr int kLeastRows = 4;            ///< that may be missing or torn ...
constexpr int kPartOfRows = 32;          ///< ... and one in so many of the window's
constexpr double kShowing = 1.0 / 64.0;  ///< of full scale: a row of a greater range shows something
constexpr double kDarkRatio = 0.25;
constexpr double kNearlyFull = 0.95, kNotFull = 0.7;  ///< of full scale
constexpr double kFarPx = 4.0;                        ///< of blur: a move of so much shows where there is texture
constexpr double kFarShare = 1.0 / 64.0;              ///< of the range: the same where the optics are not known
constexpr int kFewFrames = 3;                         ///< of a search: what looks alike so early is doubted
constexpr std::size_t kEnoughPixels = 256, kManyPixels = 65536;
constexpr double kWhite = 0.05;       ///< correlation of neighbours below which a difference is noise ...
constexpr double kWhiteSigmas = 3.0;  ///< ... or within so many standard deviations of none
constexpr double kTexture = 1.15;     ///< slopes hold so many times the energy that noise alone would give

using Row = std::span<const std::uint16_t>;

/// The rectangle about all regions; nothing: one of them does not fit, which the search says.
std::optional<Window> WindowAbout(const drivers::Frame& frame, std::span<const drivers::Region> regions) {
  std::optional<Window> about;
  for (const drivers::Region& region : regions) {
    const auto one = WindowOf(region, frame.width, frame.height);
    if (!one) return std::nullopt;
    if (!about) {
      about = *one;
      continue;
    }
    const int right = std::max(about->x + about->width, one->x + one->width);
    const int bottom = std::max(about->y + about->height, one->y + one->height);
    about->x = std::min(about->x, one->x);
    about->y = std::min(about->y, one->y);
    about->width = right - about->x;
    about->height = bottom - about->y;
  }
  return about;
}

Row RowOf(const drivers::Frame& frame, const Window& window, int y) {
  const auto from = static_cast<std::size_t>(window.y + y) * static_cast<std::size_t>(frame.width) +
                    static_cast<std::size_t>(window.x);
  return Row(*frame.samples).subspan(from, static_cast<std::size_t>(window.width));
}

double FullScale(const drivers::Frame& frame) {
  return static_cast<double>((1u << static_cast<unsigned>(frame.bits)) - 1u);
}

bool HasOneValue(Row row) {
  return std::ranges::all_of(row, [&](std::uint16_t sample) { return sample == row.front(); });
}

/// Rows from the lower edge up, or from the upper one down, for which `holds`.
template <class Predicate>
int RowsAtEdge(int height, bool lower, const Predicate& holds) {
  int count = 0;
  while (count < height && holds(lower ? height - 1 - count : count)) ++count;
  return count;
}

int LeastRows(const Window& window) {
  return std::max(kLeastRows, window.height / kPartOfRows);
}

/// Rows at an edge of `torn` have one value where `whole` shows something in most of them.
bool HasRowsMissing(const drivers::Frame& torn, const drivers::Frame& whole, const Window& window) {
  const double showing = kShowing * FullScale(whole);
  for (const bool lower : {true, false}) {
    const std::uint16_t value = RowOf(torn, window, lower ? window.height - 1 : 0).front();
    const int rows = RowsAtEdge(window.height, lower, [&](int y) {
      const Row row = RowOf(torn, window, y);
      return row.front() == value && HasOneValue(row);
    });
    if (rows < LeastRows(window) || rows == window.height) continue;
    int shown = 0;
    for (int i = 0; i < rows; ++i) {
      const auto [least, most] = std::ranges::minmax(RowOf(whole, window, lower ? window.height - 1 - i : i));
      shown += most - least > showing ? 1 : 0;
    }
    if (4 * shown >= 3 * rows) return true;
  }
  return false;
}

/// Rows at an edge that are in both frames bit for bit, and show something; `all`: there are no others.
bool HasRowsAgain(const drivers::Frame& one, const drivers::Frame& other, const Window& window, bool all) {
  for (const bool lower : {true, false}) {
    int telling = 0;
    const int rows = RowsAtEdge(window.height, lower, [&](int y) {
      const Row row = RowOf(one, window, y);
      if (!std::ranges::equal(row, RowOf(other, window, y))) return false;
      telling += HasOneValue(row) ? 0 : 1;
      return true;
    });
    if (telling >= LeastRows(window) && (rows == window.height) == all) return true;
  }
  return false;
}

/// How two frames differ. Neighbouring differences of noise have nothing to do with each other, nor with the picture:
/// both frames are equally sharp, which tells noise from a change of contrast.
struct Difference {
  bool is_noise = false;       ///< or nothing
  bool texture_shows = false;  ///< the slopes of the picture are steeper than such noise makes them
};
Difference DifferenceOf(const drivers::Frame& one, const drivers::Frame& other, const Window& window) {
  const auto pixels = static_cast<std::size_t>(window.width) * static_cast<std::size_t>(window.height);
  const int every = static_cast<int>(std::max<std::size_t>(1, pixels / kManyPixels));
  double sum = 0.0, square = 0.0, next = 0.0, after_next = 0.0, slopes = 0.0, sharper = 0.0;
  std::size_t count = 0;
  std::vector<double> difference(static_cast<std::size_t>(window.width));
  for (int y = 0; y < window.height; y += every) {
    const Row a = RowOf(one, window, y), b = RowOf(other, window, y);
    for (std::size_t x = 0; x < a.size(); ++x) difference[x] = static_cast<double>(a[x]) - b[x];
    for (std::size_t x = 0; x + 2 < a.size(); ++x) {
      sum += difference[x];
      square += difference[x] * difference[x];
      next += difference[x] * difference[x + 1];
      after_next += difference[x] * difference[x + 2];
      const double slope = static_cast<double>(a[x + 2]) - a[x], other_slope = static_cast<double>(b[x + 2]) - b[x];
      slopes += slope * slope;
      sharper += slope * slope - other_slope * other_slope;
      ++count;
    }
  }
  if (count < kEnoughPixels) return {};
  const auto n = static_cast<double>(count);
  const double offset = sum / n * sum / n, variance = square / n - offset;  // of a difference: twice that of a frame
  if (!(variance > 0.0)) return {.is_noise = true, .texture_shows = false};
  const double white = std::max(kWhite, kWhiteSigmas / std::sqrt(n));
  const bool is_noise =
      std::abs(next / n - offset) < white * variance && std::abs(after_next / n - offset) < white * variance;
  // Slopes two pixels apart share a pixel's noise with the next ones: half as much again as if they did not.
  const double texture = std::max(slopes / n - variance, 0.0);
  const double scatter = std::sqrt(1.5 * n * (8.0 * variance * texture + 4.0 * variance * variance));
  return {is_noise && std::abs(sharper) < kWhiteSigmas * scatter, slopes / n > kTexture * variance};
}

}  // namespace

FrameGate::Light FrameGate::LightOf(const drivers::Frame& frame, const Window& window) {
  Light light{.mean = 0.0, .least = 65535, .most = 0};
  std::uint64_t sum = 0;
  for (int y = 0; y < window.height; ++y) {
    for (const std::uint16_t sample : RowOf(frame, window, y)) {
      sum += sample;
      light.least = std::min(light.least, sample);
      light.most = std::max(light.most, sample);
    }
  }
  light.mean = static_cast<double>(sum) / (static_cast<double>(window.width) * window.height);
  return light;
}

bool FrameGate::IsMuchDarker(const Light& dark, const Light& light, double full) {
  return dark.most < light.mean && dark.mean < kDarkRatio * light.mean && light.mean - dark.mean > kShowing * full;
}

std::string FrameGate::ReasonOf(Doubt doubt) {
  switch (doubt) {
    case Doubt::Flat:
      return "every pixel of it has one value";
    case Doubt::Dark:
      return "it is black where other frames are not";
    case Doubt::Bright:
      return "it is white where other frames are not";
    case Doubt::Missing:
      return "a part of its rows is missing";
    case Doubt::Torn:
      return "it is torn: a part of its rows is of the frame before";
    case Doubt::Stale:
      break;
  }
  return "it shows the picture of where the lens was before";
}

bool FrameGate::SettledFor(Doubt doubt) const {
  return doubt == Doubt::Torn || doubt == Doubt::Stale ? motion_settled_ : content_settled_;
}

/// Far enough from the frame before for texture to change.
bool FrameGate::IsStale(const Seen& now) const {
  // A pass over many places looks alike just before and just behind the top, and is not led astray by one of them.
  if (count_ > kFewFrames && !late_) return false;
  const double far = setup_.blur_px ? kFarPx * *setup_.blur_px : kFarShare * (setup_.highest - setup_.lowest);
  if (std::abs(now.position - used_->position) < std::max(far, setup_.resolution)) return false;
  const Difference difference = DifferenceOf(now.frame, used_->frame, now.window);
  return difference.is_noise && difference.texture_shows;
}

/// Nothing: as a frame after the one before may look.
std::optional<FrameGate::Doubt> FrameGate::DoubtOf(const Seen& now) const {
  const Light& light = now.light;
  const double full = FullScale(now.frame);
  const bool flat = light.least == light.most;
  // Points of light on black are rounded away out of focus.
  if (!used_) return flat && light.most > 0 ? std::optional(Doubt::Flat) : std::nullopt;
  const Light& before = used_->light;
  if (flat && before.least != before.most) {
    const bool clips = light.most == 0 || light.most >= full;
    if (!clips || std::abs(before.mean - light.mean) > kShowing * full) return Doubt::Flat;
  }
  if (flat) return std::nullopt;
  if (IsMuchDarker(light, before, full)) return Doubt::Dark;
  const bool white = light.mean > kNearlyFull * full && before.mean < kNotFull * full;
  if (white || (light.least > before.mean && before.mean < kDarkRatio * light.mean && count_ > 1)) return Doubt::Bright;
  if (HasRowsMissing(now.frame, used_->frame, now.window)) return Doubt::Missing;
  if (std::abs(now.position - used_->position) < 0.5 * setup_.resolution) return std::nullopt;
  if (HasRowsAgain(now.frame, used_->frame, now.window, true)) return Doubt::Stale;
  if (HasRowsAgain(now.frame, used_->frame, now.window, false)) return Doubt::Torn;
  return IsStale(now) ? std::optional(Doubt::Stale) : std::nullopt;
}

/// The frame after a doubtful one, taken at the place of that one.
Judgement FrameGate::Answer(const Seen& now) {
  const Doubt doubt = *std::exchange(doubt_, std::nullopt);
  if (DoubtOf(now) == doubt) {
    (doubt == Doubt::Torn || doubt == Doubt::Stale ? motion_settled_ : content_settled_) = true;
    return {};
  }
  Judgement judged{.before_is_bad = ReasonOf(doubt)};
  if (doubt != Doubt::Stale) return judged;
  if (std::exchange(late_, true)) {
    judged.kind = Judgement::Kind::Late;
  } else if (count_ > 1) {
    judged.kind = Judgement::Kind::UseAnew;
  }
  return judged;
}

Judgement FrameGate::JudgeChanged(const drivers::Frame& frame) {
  const auto same = [&](const drivers::Frame& other) {
    return frame.samples && frame.samples->size() == other.samples->size() &&
           DifferenceOf(frame, other, used_->window).is_noise;
  };
  if (!changed_) {
    changed_ = frame;
    return {.kind = same(used_->frame) ? Judgement::Kind::Use : Judgement::Kind::AskAgain, .before_is_bad = {}};
  }
  if (!same(*changed_)) return {};
  late_ = true;
  count_ = 1;
  used_->frame = frame;
  used_->light = LightOf(frame, used_->window);
  return {Judgement::Kind::UseAnew, ReasonOf(Doubt::Stale)};
}

Judgement FrameGate::Judge(const Place& place, const drivers::Frame& frame, std::span<const drivers::Region> regions) {
  const auto window = WindowAbout(frame, regions);
  if (!window || !frame.samples) return {};
  const Seen now{frame, *window, place.position, LightOf(frame, *window)};
  if (used_ && (used_->frame.width != frame.width || used_->frame.height != frame.height)) return {};
  Judgement judged;
  if (std::exchange(thrown_away_, false)) {
    judged.before_is_bad = "it was thrown away: the picture is one move late";
  } else if (late_ && used_ && std::abs(now.position - used_->position) > 0.5 * setup_.resolution) {
    thrown_away_ = true;
    return {.kind = Judgement::Kind::AskAgain, .before_is_bad = {}};
  }
  if (doubt_ && !place.on_the_way) {
    judged = Answer(now);
  } else if (const auto doubt = DoubtOf(now); doubt && !SettledFor(*doubt)) {
    // On its way the lens does not stay for another frame.
    if (doubt_ && place.on_the_way) judged.before_is_bad = ReasonOf(*doubt_);
    doubt_ = doubt;
    judged.kind = Judgement::Kind::AskAgain;
    return judged;
  } else if (doubt_) {
    judged.before_is_bad = ReasonOf(*std::exchange(doubt_, std::nullopt));
  } else if (count_ == 1 && !content_settled_) {
    // The only frame before is the odd one of the two.
    const bool dark = IsMuchDarker(used_->light, now.light, FullScale(frame));
    if (dark || HasRowsMissing(used_->frame, frame, *window)) {
      judged = {Judgement::Kind::UseAnew, ReasonOf(dark ? Doubt::Dark : Doubt::Missing)};
    }
  }
  if (judged.kind == Judgement::Kind::UseAnew) count_ = 0;
  used_ = now;
  ++count_;
  return judged;
}

}  // namespace lensd::autofocus
