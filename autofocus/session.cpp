// A method proposes; the session proves. It asks for the frames beside the answer and at it, compares them with the
// standard, and under "auto" goes on with the next method after a refusal.
#include "autofocus/session.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include "defocus/defocus.h"
#include "moving.h"
#include "searches.h"
#include "sharpness_curve.h"
#include "star_focus.h"
#include "sweep.h"

namespace lensd::autofocus {
namespace {

constexpr int kSmallestWindow = 16;  ///< px
constexpr int kMostMovesOn = 3;      ///< of an answer to a sharper frame beside it

struct MethodRow {
  std::string_view name;
  bool needs_optics;      ///< pictures, and what a step does to their blur
  bool looks_on_the_way;  ///< of the lens
  bool takes_step;        ///< Setup::step
  bool when_asked;        ///< no method of "auto"
  std::unique_ptr<Method> (*make)(const Setup& setup);
};

template <class Made>
std::unique_ptr<Method> Make(const Setup& setup) {
  return std::make_unique<Made>(setup);
}

/// What "auto" tries, in this order, as far as the lens allows.
constexpr MethodRow kMethods[] = {
    {"defocus", true, false, false, false, Make<Defocus>},
    {"sweep", false, false, true, false, Make<Sweep>},
    {"moving", false, true, true, true, Make<Moving>},
    {"stars", true, false, false, true, Make<StarFocus>},
};

/// More than hot pixels.
bool ShowsStars(const Look& look) {
  return look.frame != nullptr &&
         !std::ranges::all_of(FindStars(*look.frame, look.window), [](const Star& star) { return star.lone_pixel; });
}

/// `name` is one of MethodNames() other than "auto".
std::unique_ptr<Method> MakeMethod(std::string_view name, const Setup& setup) {
  const auto row = std::ranges::find(kMethods, name, &MethodRow::name);
  if (row != std::end(kMethods)) return row->make(setup);
  return MakeSearch(*std::ranges::find(Searches(), name, &Search::name), setup);
}

}  // namespace

std::vector<std::string_view> MethodNames() {
  std::vector<std::string_view> names = {"auto"};
  for (const MethodRow& row : kMethods) names.push_back(row.name);
  for (const Search& search : Searches()) names.push_back(search.name);
  return names;
}

Result<Window> WindowOf(const drivers::Region& region, int width, int height) {
  const auto inside = [](double from, double size) { return from >= 0 && size > 0 && from + size <= 1 + 1e-9; };
  if (!inside(region.x, region.width) || !inside(region.y, region.height)) {
    return Fail(Code::InvalidArgument, "the region must lie inside the frame: x, y, width, height as fractions of it");
  }
  Window window;
  window.x = static_cast<int>(std::lround(region.x * width));
  window.y = static_cast<int>(std::lround(region.y * height));
  window.width = std::min(static_cast<int>(std::lround(region.width * width)), width - window.x);
  window.height = std::min(static_cast<int>(std::lround(region.height * height)), height - window.y);
  if (window.width < kSmallestWindow || window.height < kSmallestWindow) {
    return Fail(Code::InvalidArgument, "the region must cover at least " + std::to_string(kSmallestWindow) + " x " +
                                           std::to_string(kSmallestWindow) + " pixels of the frame");
  }
  return window;
}

namespace {

/// Pixels of blur between the frames of a search's first pass: no finer than positions are.
Result<void> CheckStep(std::string_view method, const Setup& setup) {
  const auto row = std::ranges::find(kMethods, method, &MethodRow::name);
  const auto search = std::ranges::find(Searches(), method, &Search::name);
  const double first_step = search != Searches().end()                     ? search->first_step
                            : row != std::end(kMethods) && row->takes_step ? 1.0
                                                                           : 0.0;
  if (first_step == 0.0) {
    return Fail(
        Code::InvalidArgument,
        "the method '" + std::string(method) + "' chooses its places itself: leave the step out, or take 'sweep'",
        {.parameter = "step"});
  }
  if (*setup.step >= first_step * setup.resolution * (1.0 - 1e-9)) return {};
  return Fail(Code::OutOfRange,
              "the first pass of '" + std::string(method) + "' goes by steps of at least " +
                  std::to_string(std::lround(first_step)) + " positions, since finer ones follow",
              {.parameter = "step"});
}

/// Whether this lens and its pictures allow the method; not "auto".
Result<void> CheckMethod(std::string_view method, const Setup& setup) {
  const std::string quoted = "the method '" + std::string(method) + "'";
  const auto* row = std::ranges::find(kMethods, method, &MethodRow::name);
  if (row != std::end(kMethods) && row->needs_optics && !setup.pictures)
    return Fail(Code::InvalidArgument, quoted + " needs pictures, not their sharpness", {.parameter = "method"});
  if (row != std::end(kMethods) && row->looks_on_the_way && !setup.stride)
    return Fail(Code::Unsupported, quoted + " looks while the lens moves: " + setup.no_stride);
  const auto all = MethodNames();
  if (std::ranges::find(all, method) == all.end()) {
    std::string known;
    for (const std::string_view name : all) known += " " + std::string(name);
    return Fail(Code::InvalidArgument, "there is no autofocus method '" + std::string(method) + "'; there are:" + known,
                {.parameter = "method"});
  }
  return setup.step ? CheckStep(method, setup) : Result<void>();
}

}  // namespace

Result<Session> Session::Create(std::string_view method, const Setup& setup) {
  std::vector<std::string_view> names;
  if (method == "auto") {
    for (const MethodRow& row : kMethods) {
      const bool possible = (setup.blur_px && setup.pictures) || !row.needs_optics;
      if (possible && !row.when_asked && (!setup.step || row.takes_step)) names.push_back(row.name);
    }
  } else {
    if (auto can = CheckMethod(method, setup); !can) return PassOn(can);
    const auto all = MethodNames();
    names.push_back(*std::ranges::find(all, method));
  }
  return Session(setup, std::move(names));
}

Session::Session(const Setup& setup, std::vector<std::string_view> names)
    : setup_(setup), names_(std::move(names)), curve_(std::make_unique<SharpnessCurve>()) {
  StartMethod();
}

Session::~Session() = default;
Session::Session(Session&&) noexcept = default;
Session& Session::operator=(Session&&) noexcept = default;

int Session::frames() const {
  return static_cast<int>(curve_->size());
}

void Session::StartMethod() {
  frames_before_ = std::max(frames() - 1, 0);
  method_ = MakeMethod(names_[running_], setup_);
}

Result<Advice> Session::Next(const Place& place, const drivers::Frame& frame, const drivers::Region& region) {
  auto window = WindowOf(region, frame.width, frame.height);
  if (!window) return PassOn(window);
  if (!frame.samples) return Fail(Code::InvalidArgument, "a frame without pixels");
  if (last_ && (last_->frame.width != frame.width || last_->frame.height != frame.height)) {
    return Fail(Code::InvalidArgument, "every frame of an autofocus must have the same size");
  }
  // A camera's noise never repeats itself; a picture of one value may.
  if (last_ && place.position != last_->position && *last_->frame.samples == *frame.samples) {
    const auto [least, most] = std::ranges::minmax(*frame.samples);
    repeated_ = repeated_ || least != most;
  }
  last_ = {frame, place.position};
  Look look;
  look.position = place.position;
  look.position_sigma = place.sigma;
  look.on_the_way = place.on_the_way;
  look.frame = &frame;
  look.window = *window;
  look.tiles = ScoreTiles(frame, *window);
  int pixels = 0;
  look.score = ScoreOf(*look.tiles, {}, pixels);
  curve_->Add(look);
  return Follow(look);
}

Advice Session::NextScore(double position, const Sharpness& sharpness) {
  Look look;
  look.position = position;
  look.score.gradient_energy = sharpness.value;
  look.score.energy_sigma = sharpness.sigma;
  look.score.mean = 1.0;
  curve_->Add(look);
  return Follow(look);
}

/// Of several methods the one comes first that promises an answer for the fewest frames: trying what costs f and
/// answers with chance p before what costs f' and answers with p' is the cheaper order where f/p < f'/p'.
void Session::PutInOrder(const Look& first) {
  struct Rated {
    std::string_view name;
    Forecast forecast;
  };
  std::vector<Rated> rated;
  for (const std::string_view name : names_) rated.push_back({name, MakeMethod(name, setup_)->Predict(first)});
  std::ranges::stable_sort(rated, {}, [](const Rated& one) { return one.forecast.frames / one.forecast.chance; });
  std::ostringstream text;
  for (std::size_t i = 0; i < rated.size(); ++i) {
    names_[i] = rated[i].name;
    text << (i > 0 ? ", " : "; foreseen: ") << rated[i].name << " " << std::lround(rated[i].forecast.frames)
         << " frames, " << std::lround(100.0 * rated[i].forecast.chance) << " %";
  }
  forecast_ = text.str();
  StartMethod();
}

Advice Session::Follow(const Look& look) {
  if (frames() == 1 && names_.size() > 1) PutInOrder(look);
  Advice advice = proof_ ? Prove(look.position) : Ask(look);
  // The next method begins where the last one gave up.
  while (Refused(advice) && running_ + 1 < names_.size()) {
    proof_.reset();
    earlier_ = std::get<Verdict>(advice);
    ++running_;
    StartMethod();
    advice = Ask(look);
  }
  if (auto* verdict = std::get_if<Verdict>(&advice); verdict != nullptr && earlier_) {
    verdict->reason += "; before that, " + std::string(names_[running_ - 1]) + ": " + earlier_->reason;
    if (!verdict->focused && verdict->candidates.empty()) verdict->candidates = earlier_->candidates;
    if (!verdict->log_slope) verdict->log_slope = earlier_->log_slope;
  }
  if (auto* verdict = std::get_if<Verdict>(&advice)) {
    if (names_.size() > 1 && !verdict->focused && ShowsStars(look)) {
      verdict->reason += "; points of light show in the region: the method 'stars' focuses by them";
    }
    verdict->reason += forecast_;
    if (!verdict->focused && repeated_) {
      verdict->cause = Cause::SameFrame;
      verdict->reason =
          "the same frame was sent twice, though the lens had moved between: is the camera still "
          "taking pictures? " +
          verdict->reason;
    }
  }
  return advice;
}

bool Session::Refused(const Advice& advice) {
  const auto* verdict = std::get_if<Verdict>(&advice);
  return verdict != nullptr && !verdict->focused && !verdict->final;
}

/// The method's advice; an answer is proved first.
Advice Session::Ask(const Look& look) {
  Advice advice = method_->Next(look);
  const auto* verdict = std::get_if<Verdict>(&advice);
  if (verdict == nullptr || !verdict->focused || verdict->proven) return advice;
  proof_ = {.verdict = *verdict};
  return Prove(look.position);
}

/// Frames on both sides of the answer, as far as the travel goes, and last one at the answer itself.
Advice Session::Prove(double stands) {
  Verdict& verdict = proof_->verdict;
  const double answer = verdict.position;
  if (const auto side = SideToSee(answer)) return GoAndLook{*side};
  if (stands != answer && !proof_->sent) {
    proof_->sent = true;
    return GoAndLook{answer};
  }
  if (const auto farther = FartherSide()) {
    proof_->sent = false;
    return GoAndLook{*farther};
  }
  // A frame beside it that is sharper takes its place.
  if (const auto better = SharperBeside()) {
    if (++proof_->moves_on > kMostMovesOn)
      return Refuse({Cause::Unclear, "frames beside the answer are sharper wherever it is sought"});
    verdict.sigma = std::max(verdict.sigma, 0.5 * std::abs(*better - answer));
    verdict.position = *better;
    verdict.subject.reset();
    verdict.found_by = FoundBy::Sharpness;
    proof_->sent = true;
    return GoAndLook{*better};
  }
  return Check();
}

int Session::frames_expected() const {
  return std::max(frames_before_ + method_->FramesExpected() + 1, frames());
}

std::vector<CurvePoint> Session::Curve() const {
  return curve_->Taken();
}

double Session::relative_sharpness() const {
  if (curve_->size() == 0) return 0.0;
  const auto taken = curve_->Taken();
  return taken.front().value > 0 ? taken.back().value / taken.front().value : 0.0;
}

/// A frame of this place is there, as near as the motor gets: it need not be asked for again.
static bool TakenAt(const std::vector<CurvePoint>& points, double place, double resolution) {
  return std::ranges::any_of(
      points, [&](const CurvePoint& point) { return std::abs(point.position - place) <= 0.6 * resolution; });
}

/// A place beside the answer where no frame has been taken yet.
std::optional<double> Session::SideToSee(double answer) const {
  const auto [least, most, wanted] = ReachOfSides(setup_);
  const auto points = curve_->Points();
  const CurvePoint centre{.position = answer};
  for (const double sign : {1.0, -1.0}) {
    const double room = sign > 0 ? setup_.highest - answer : answer - setup_.lowest;
    if (room < least) continue;
    if (SeenOnSide(points, centre, sign * least, sign * most) != SideSeen::Nothing) continue;
    const double place = answer + sign * std::min(wanted, room);
    if (!TakenAt(points, place, setup_.resolution)) return place;
  }
  return std::nullopt;
}

/// From the answer, where the lens stands: a place farther to a side where what was seen is as sharp, as far as that
/// may still prove a top. A fine texture falls off within a depth of field, a coarse one later.
std::optional<double> Session::FartherSide() const {
  constexpr double kFar = 0.8;  ///< of the farthest
  if (!setup_.blur_px) return std::nullopt;
  const auto [least, most, wanted] = ReachOfSides(setup_);
  const auto taken = curve_->Taken();
  const CurvePoint& last = taken.back();
  for (const double sign : {1.0, -1.0}) {
    const double room = sign > 0 ? setup_.highest - last.position : last.position - setup_.lowest;
    if (room < kFar * most) continue;
    if (SeenOnSide(taken, last, sign * least, sign * most) != SideSeen::Alike) continue;
    if (SeenOnSide(taken, last, sign * kFar * most, sign * most) != SideSeen::Nothing) continue;
    const double place = last.position + sign * std::min(0.95 * most, room);
    if (!TakenAt(taken, place, setup_.resolution)) return place;
  }
  return std::nullopt;
}

/// Where a frame near the one taken last is the sharpest of all and clearly sharper.
std::optional<double> Session::SharperBeside() const {
  const auto [least, most, wanted] = ReachOfSides(setup_);
  if (!setup_.blur_px) return std::nullopt;
  const auto taken = curve_->Taken();
  const CurvePoint& last = taken.back();
  const auto& best = *std::ranges::max_element(taken, {}, &CurvePoint::value);
  const double off = best.position - last.position;
  if (std::abs(off) < least || std::abs(off) > most) return std::nullopt;
  if (SeenOnSide({&best, 1}, last, off, off) != SideSeen::Sharper) return std::nullopt;
  return best.position;
}

/// Something must have changed with focus, the frame at the answer must be no worse than the one before the run began,
/// no frame of the run may be clearly sharper than it, and on each side one must have been clearly less sharp.
Verdict Session::Check() const {
  constexpr double kSharpestShare = 0.8;  ///< of the sharpest frame seen: less is another place than the peak
  constexpr double kSigmas = 4.0;
  constexpr double kClearRise = 6.0;  ///< sigmas
  const auto sharpness = curve_->Taken();
  const CurvePoint& last = sharpness.back();
  Verdict verdict = proof_->verdict;
  const auto refuse = [&](Why why) {
    verdict.focused = false;
    verdict.confidence = 0.0;
    verdict.cause = why.cause;
    verdict.reason = why.reason;
    return verdict;
  };
  const auto clearly_below = [&](const CurvePoint& other, double share) {
    return last.value + kSigmas * std::hypot(last.sigma, other.sigma) < share * other.value;
  };
  const auto dullest = std::ranges::min_element(sharpness, {}, &CurvePoint::value);
  if (last.value - dullest->value < kClearRise * std::hypot(last.sigma, dullest->sigma)) {
    return refuse(curve_->Overexposed() ? kTooBright : kNoPeak);
  }
  if (clearly_below(sharpness.front(), 1.0)) {
    return refuse({Cause::Unclear, "the check frame is less sharp than the first frame was"});
  }
  const auto sharpest = std::ranges::max_element(sharpness, {}, &CurvePoint::value);
  if (clearly_below(*sharpest, kSharpestShare)) {
    return refuse({Cause::Unclear, "the check frame is less sharp than the search promised"});
  }
  const auto [least, most, wanted] = ReachOfSides(setup_);
  for (const double sign : {1.0, -1.0}) {
    const double room = sign > 0 ? setup_.highest - last.position : last.position - setup_.lowest;
    if (room < least) continue;  // the method has judged the end of the travel
    const SideSeen seen = SeenOnSide(sharpness, last, sign * least, sign * most);
    if (seen == SideSeen::LessSharp) continue;
    if (room < 2.0 * least) return refuse(AtTheEndOf(setup_));
    return refuse({Cause::Unclear, seen == SideSeen::Sharper
                                       ? "a frame beside the answer is sharper than it"
                                       : "frames beside the answer are as sharp as it: no top was seen"});
  }
  return verdict;
}

}  // namespace lensd::autofocus
