// A method proposes; the session proves. It asks for the frames beside the answer and at it, compares them with the
// standard, and under "auto" goes on with the next method after a refusal.
#include "autofocus/session.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include "autofocus/defocus/defocus.h"
#include "autofocus/search/moving.h"
#include "autofocus/search/searches.h"
#include "autofocus/search/sharpness_curve.h"
#include "autofocus/search/sweep.h"
#include "autofocus/session/fixed_pattern.h"
#include "autofocus/stars/star_focus.h"
#include "base/nearest_word.h"

namespace lensd::autofocus {
namespace {

constexpr int kSmallestWindow = 16;        ///< px
constexpr double kSigmaLessPattern = 2.0;  ///< times that of noise alone: what of the scene is left in the pattern

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
    const auto meant = NearestWord(method, std::vector<std::string>(all.begin(), all.end()));
    if (meant) known += "; did you mean " + *meant + "?";
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
    : setup_(setup),
      names_(std::move(names)),
      curve_(std::make_unique<SharpnessCurve>()),
      stays_(std::make_unique<FixedPattern>()) {
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
  if (stays_->known() && !stays_->Fits(*window))
    return Fail(Code::InvalidArgument, "the region of an autofocus must keep its size");
  // A camera's noise never repeats itself; a picture of one value may.
  if (last_ && place.position != last_->position && *last_->frame.samples == *frame.samples) {
    const auto [least, most] = std::ranges::minmax(*frame.samples);
    repeated_ = repeated_ || least != most;
  }
  last_ = {frame, place.position, *window};
  Look look;
  look.position = place.position;
  look.position_sigma = place.sigma;
  look.on_the_way = place.on_the_way;
  look.frame = &frame;
  look.window = *window;
  look.tiles = ScoreTiles(frame, *window);
  int pixels = 0;
  look.score = ScoreOf(*look.tiles, {}, pixels);
  if (stays_->known())
    look = stays_->Without(look);
  else
    stays_->Keep(look);
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
  while (Refused(advice)) {
    if (running_ + 1 == names_.size() && !TakeOutWhatStays(std::get<Verdict>(advice).cause)) break;
    proof_.reset();
    Verdict verdict = std::get<Verdict>(advice);
    TellEarlier(verdict);
    earlier_ = std::move(verdict);
    ++running_;
    StartMethod();
    advice = stays_->known() ? FromTheStart() : Ask(look);
  }
  if (auto* verdict = std::get_if<Verdict>(&advice); verdict != nullptr && earlier_) {
    TellEarlier(*verdict);
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
          "the same frame was sent twice, although the lens had moved in between: is the camera still "
          "taking pictures? " +
          verdict->reason;
    }
  }
  return advice;
}

/// Why the method before gave up, in the reason.
void Session::TellEarlier(Verdict& verdict) const {
  if (verdict.focused && stays_->known()) {
    verdict.reason += "; a fixed pattern (dirt, hot pixels; " + std::to_string(std::lround(100.0 * stays_->share())) +
                      " % of what the less sharp frames show) was removed";
  }
  if (earlier_) verdict.reason += "; before that, " + std::string(names_[running_ - 1]) + ": " + earlier_->reason;
}

/// The last method was the sweep, and saw mostly what no focus changes: it is put behind once more, without that.
bool Session::TakeOutWhatStays(Cause cause) {
  constexpr Cause kOfWhatShows[] = {Cause::NoTexture, Cause::TooBright, Cause::Unclear, Cause::EndOfTravel};
  const bool of_what_shows = std::ranges::find(kOfWhatShows, cause) != std::end(kOfWhatShows);
  if (!of_what_shows || names_.back() != "sweep" || stays_->known() || !stays_->Find(setup_)) return false;
  names_.push_back(names_.back());
  return true;
}

/// The frames that are there, without what stays in place, go through the method before the lens is asked for others.
Advice Session::FromTheStart() {
  const std::vector<Look>& looks = stays_->Looks();
  curve_ = std::make_unique<SharpnessCurve>();
  for (const Look& look : looks) curve_->Add(look);
  const double near = std::max(0.6 * setup_.resolution, 0.3 * setup_.blur_px.value_or(0.0));
  Advice advice = method_->Next(looks.front());
  while (const auto* go = std::get_if<GoAndLook>(&advice)) {
    const auto distance = [&](const Look& look) { return std::abs(look.position - go->position); };
    const auto taken = std::ranges::min_element(looks, {}, distance);
    if (distance(*taken) > near) return advice;
    advice = method_->Next(*taken);
  }
  return Proved(advice, last_->position);
}

bool Session::Refused(const Advice& advice) {
  const auto* verdict = std::get_if<Verdict>(&advice);
  return verdict != nullptr && !verdict->focused && !verdict->final;
}

/// The method's advice; an answer is proved first.
Advice Session::Ask(const Look& look) {
  return Proved(method_->Next(look), look.position);
}

Advice Session::Proved(Advice advice, double stands) {
  const auto* verdict = std::get_if<Verdict>(&advice);
  if (verdict == nullptr || !verdict->focused) return advice;
  if (verdict->proven) {
    const auto doubt = names_[running_] == "stars" ? std::nullopt : DoubtOfLast(setup_, *curve_);
    return doubt ? Advice(Refuse(*doubt)) : advice;
  }
  proof_ = {.verdict = *verdict};
  if (stays_->known()) proof_->verdict.sigma *= kSigmaLessPattern;
  return Prove(stands);
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

}  // namespace lensd::autofocus
