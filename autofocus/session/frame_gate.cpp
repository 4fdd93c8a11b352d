// The rules are those of the header; all of them work on rows of a window, and none needs the level of the noise.
#include "autofocus/frame_gate.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "autofocus/session/frame_difference.h"

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
constexpr int kEnoughAgree = 2;                       ///< frames at the end, where the lag has not shown
constexpr int kMostInVain = 3;                        ///< doubts of a frame's place, then such frames are believed
constexpr int kKeptPx = 256;                          ///< each way, of the last frame of a search
constexpr int kMostStale = 2;  ///< frames that do not change by a move, until a scene is believed that does not

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

Window MiddleOf(const Window& window) {
  const int width = std::min(window.width, kKeptPx), height = std::min(window.height, kKeptPx);
  return {window.x + (window.width - width) / 2, window.y + (window.height - height) / 2, width, height};
}

/// As a frame of its own.
drivers::Frame PartOf(const drivers::Frame& frame, const Window& window) {
  std::vector<std::uint16_t> samples;
  for (int y = 0; y < window.height; ++y) {
    const Row row = RowOf(frame, window, y);
    samples.insert(samples.end(), row.begin(), row.end());
  }
  drivers::Frame part = frame;
  part.width = window.width;
  part.height = window.height;
  part.samples = std::make_shared<const std::vector<std::uint16_t>>(std::move(samples));
  return part;
}

}  // namespace

LightOfPart FrameGate::LightOf(const drivers::Frame& frame, const Window& window) {
  LightOfPart light{.mean = 0.0, .least = 65535, .most = 0};
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

bool FrameGate::IsMuchDarker(const LightOfPart& dark, const LightOfPart& light, double full) {
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

std::string FrameGate::WhyThrownAway() const {
  const int late = lag_.known().value_or(0);
  return "it was thrown away: the picture is " + std::to_string(late) + (late == 1 ? " frame late" : " frames late");
}

bool FrameGate::SettledFor(Doubt doubt) const {
  return doubt == Doubt::Torn || doubt == Doubt::Stale ? in_vain_ >= kMostInVain : content_settled_;
}

bool FrameGate::Moved(double position) const {
  return !used_ || std::abs(position - used_->position) > 0.5 * setup_.resolution;
}

/// Far enough for texture to change.
bool FrameGate::IsFar(double from, double to) const {
  const double far = setup_.blur_px ? kFarPx * *setup_.blur_px : kFarShare * (setup_.highest - setup_.lowest);
  return std::abs(to - from) >= std::max(far, setup_.resolution);
}

/// The first frame may show where the lens stood at the end of the search before.
bool FrameGate::IsOfTheSearchBefore(const Seen& now) const {
  if (!before_ || before_->width_px != now.frame.width || before_->height_px != now.frame.height) return false;
  if (!IsFar(before_->position, now.position)) return false;
  const Window all{0, 0, before_->window.width, before_->window.height};
  return !ChangeBetween(PartOf(now.frame, before_->window), before_->part, all).shows;
}

std::optional<LastFrame> FrameGate::last_frame() const {
  if (!used_ || !used_->frame.samples) return std::nullopt;
  const drivers::Frame& frame = used_->frame;
  const Window window = MiddleOf(used_->window);
  return LastFrame{PartOf(frame, window), window, frame.width, frame.height, used_->position};
}

bool FrameGate::IsStale(const Seen& now) const {
  // A pass over many places looks alike just before and just behind the top, and is not led astray by one of them.
  const bool outside = source_ == Source::Outside;
  if (!outside && count_ > kFewFrames && lag_.known().value_or(0) == 0) return false;
  if (!IsFar(used_->position, now.position)) return false;
  // A client's frame that may be of the place before is taken again, also where no texture shows.
  if (outside) return !ChangeBetween(now.frame, used_->frame, now.window).shows;
  const Difference difference = DifferenceOf(now.frame, used_->frame, now.window);
  return difference.is_noise && difference.texture_shows;
}

/// Nothing: as a frame after the one before may look.
std::optional<FrameGate::Doubt> FrameGate::DoubtOf(const Seen& now) const {
  const LightOfPart& light = now.light;
  const double full = FullScale(now.frame);
  const bool flat = light.least == light.most;
  // Points of light on black are rounded away out of focus.
  if (!used_ && flat && light.most > 0) return Doubt::Flat;
  if (!used_) return IsOfTheSearchBefore(now) ? std::optional(Doubt::Stale) : std::nullopt;
  const LightOfPart& before = used_->light;
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
  const bool stale = doubt == Doubt::Stale;
  if (stale) ++stale_;
  if (DoubtOf(now) == doubt) {
    if (stale && lag_.ToLearn() && stale_ < kMostStale) {
      doubt_ = doubt;
      return {.kind = Judgement::Kind::AskAgain, .before_is_bad = {}};
    }
    if (stale && source_ == Source::Outside) {
      ++in_vain_;
    } else if (stale || doubt == Doubt::Torn) {
      in_vain_ = kMostInVain;
    } else {
      content_settled_ = true;
    }
    stale_ = 0;
    return {.before_is_bad = kDoubtedInVain};
  }
  if (!stale) return {.before_is_bad = ReasonOf(doubt)};
  lag_.BeginAtRest(now.frame, std::exchange(stale_, 0));
  return {.kind = Judgement::Kind::AskAgain, .before_is_bad = ReasonOf(doubt)};
}

/// One more frame where the lens stands, until two agree.
Judgement FrameGate::NextAtRest(const Seen& now, bool after_a_move) {
  using Kind = Judgement::Kind;
  switch (lag_.Next(now.frame, now.window)) {
    case PictureLag::AtRest::Changed:
      return {Kind::AskAgain, ReasonOf(Doubt::Stale)};
    case PictureLag::AtRest::TooLate:
      return {Kind::Late, {}};
    case PictureLag::AtRest::Late:
      return Used(now, {Kind::UseAnew, {}});
    case PictureLag::AtRest::OddOne:
      return Used(now, {Kind::Use, "it shows something else than the frames before and after it"});
    case PictureLag::AtRest::Agrees:
      if (!after_a_move) return AgreesAtTheEnd(now);
      lag_.NotLate();
      return Used(now, {Kind::Use, kTakenTwice});
    case PictureLag::AtRest::Restless:
      break;
  }
  return Used(now, {});
}

/// A client's camera whose lag has not shown may be two frames late, and two places may look alike: two frames more.
Judgement FrameGate::AgreesAtTheEnd(const Seen& now) {
  const bool in_doubt = source_ == Source::Outside && !lag_.known();
  if (!in_doubt) return Used(now, {});
  if (++agreed_ >= kEnoughAgree) return Used(now, {Judgement::Kind::Use, kTakenTwice});
  lag_.BeginAtRest(now.frame, 0);
  return {Judgement::Kind::AskAgain, {}};
}

bool FrameGate::ToLookAgain(const Verdict& verdict) {
  constexpr int kMost = 3;
  const bool changed = !verdict.focused && verdict.cause == Cause::SubjectMoved;
  const bool pictures = used_ && used_->frame.samples;
  if (!pictures || lag_.at_rest() || looked_again_ == kMost ||
      (!changed && lag_.known() && source_ == Source::Inside)) {
    return false;
  }
  ++looked_again_;
  agreed_ = 0;
  lag_.BeginAtRest(used_->frame, 0);
  return true;
}

Judgement FrameGate::JudgeAtRest(const drivers::Frame& frame) {
  if (!frame.samples || frame.samples->size() != used_->frame.samples->size()) return {};
  return NextAtRest({frame, used_->window, used_->position, LightOf(frame, used_->window)}, false);
}

bool FrameGate::ThrowsAwayScore(const Place& place) {
  if (!Moved(place.position) || !lag_.ThrowsAway({})) {
    lag_.MeasureAnew(nullptr, {}, {});
    used_ = Seen{{}, {}, place.position, {}};
    return false;
  }
  return true;
}

Judgement FrameGate::Used(const Seen& now, Judgement judged) {
  if (judged.kind == Judgement::Kind::UseAnew) count_ = 0;
  used_ = now;
  ++count_;
  return judged;
}

Judgement FrameGate::Judge(const Place& place, const drivers::Frame& frame, std::span<const drivers::Region> regions) {
  using Kind = Judgement::Kind;
  const auto window = WindowAbout(frame, regions);
  if (!window || !frame.samples) return {};
  const Seen now{frame, *window, place.position, LightOf(frame, *window)};
  if (used_ && (used_->frame.width != frame.width || used_->frame.height != frame.height)) return {};
  if (lag_.at_rest()) return NextAtRest(now, true);
  const bool far = used_ && IsFar(used_->position, now.position);
  Judgement judged;
  if (lag_.has_thrown()) judged.before_is_bad = WhyThrownAway();
  if (!doubt_ && lag_.known().value_or(0) > 0 && Moved(now.position)) {
    if (place.on_the_way) return {Kind::Late, {}};
    if (lag_.ThrowsAway(frame)) {
      judged.kind = Kind::AskAgain;
      return judged;
    }
    lag_.MeasureAnew(far ? &used_->frame : nullptr, frame, *window);
  }
  if (doubt_ && !place.on_the_way) {
    judged = Answer(now);
    if (judged.kind == Kind::AskAgain) return judged;
  } else if (const auto doubt = DoubtOf(now); doubt && !SettledFor(*doubt)) {
    // On its way the lens does not stay for another frame.
    if (doubt_ && place.on_the_way) judged.before_is_bad = ReasonOf(*doubt_);
    doubt_ = doubt;
    judged.kind = Kind::AskAgain;
    return judged;
  } else if (doubt_) {
    judged.before_is_bad = ReasonOf(*std::exchange(doubt_, std::nullopt));
  } else if (count_ == 1 && !content_settled_) {
    // The only frame before is the odd one of the two.
    const bool dark = IsMuchDarker(used_->light, now.light, FullScale(frame));
    if (dark || HasRowsMissing(used_->frame, frame, *window)) {
      judged = {Kind::UseAnew, ReasonOf(dark ? Doubt::Dark : Doubt::Missing)};
    }
  }
  const bool learns = judged.kind == Kind::Use && lag_.ToLearn() && !place.on_the_way && far;
  if (learns && ChangeBetween(frame, used_->frame, *window).shows) {
    lag_.BeginAtRest(frame, 0);
    return {Kind::AskAgain, judged.before_is_bad};
  }
  return Used(now, judged);
}

}  // namespace lensd::autofocus
