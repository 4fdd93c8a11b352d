// One sweep for all regions: the first pass crosses the range, each finer one goes over what lies within a step of the
// sharpest frame of any region, in the direction that takes up the backlash. Then every region is judged by its own
// curve, as `sweep` judges one, and the surface is fitted to their tops.
#include "autofocus/focus_map.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <utility>

#include "autofocus/search/sharpness_curve.h"
#include "autofocus/search/sweep.h"

namespace lensd::autofocus {
namespace {

constexpr double kTopErrorPx = 0.05;  ///< of blur: no shape of a curve tells its top better
constexpr double kAsPromised = 0.8;   ///< of the sharpness that the search saw beside it: the check frame

class MapSearch final : public RegionSearch {
 public:
  MapSearch(const Setup& setup, const MapGrid& grid) : setup_(setup), regions_(autofocus::RegionsOf(grid)) {
    map_.grid = grid;
    curves_.resize(regions_.size());
    const int intervals = FirstIntervals(setup);
    step_ = (setup.highest - setup.lowest) / intervals;
    for (int i = 0; i <= intervals; ++i) {
      to_visit_.push_back(std::lerp(setup.lowest, setup.highest, static_cast<double>(i) / intervals));
    }
    if (!setup.ascending) std::ranges::reverse(to_visit_);
  }

  Result<Advice> Next(const Place& place, const drivers::Frame& frame) override;
  Result<Advice> NextScore(double, const Sharpness&) override {
    return Fail(Code::InvalidArgument, "a focus map needs pictures, not their sharpness");
  }
  const std::vector<drivers::Region>& regions() const override { return regions_; }
  std::string_view method() const override { return "map"; }
  double relative_sharpness() const override { return first_sum_ > 0.0 ? last_sum_ / first_sum_ : 1.0; }
  int frames() const override { return frames_; }
  int frames_expected() const override;
  std::vector<RegionSample> Curves() const override { return {}; }
  int answered() const override;
  const FocusMap* map() const override { return judged_ ? &map_ : nullptr; }

 private:
  bool Repeats(double position, const drivers::Frame& frame);
  Result<std::vector<Look>> LookAt(const Place& place, const drivers::Frame& frame);
  Advice Ask();
  Advice AfterPass();
  bool PlanFinerPass();
  Advice Judge();
  Advice Check(const std::vector<Look>& looks) const;
  FieldPlace PlaceOf(std::size_t region) const;

  Setup setup_;
  std::vector<drivers::Region> regions_;
  FocusMap map_;
  std::vector<SharpnessCurve> curves_;
  std::deque<double> to_visit_;
  double step_ = 0.0;  ///< of the pass being made
  int frames_ = 0;
  double first_sum_ = 0.0, last_sum_ = 0.0;  ///< gradient energy of all regions
  drivers::Frame last_;                      ///< the frame before, and where the lens stood
  double last_position_ = 0.0;
  bool judged_ = false;  ///< the map is made; the frame at the best focus is awaited
};

Result<std::vector<Look>> MapSearch::LookAt(const Place& place, const drivers::Frame& frame) {
  if (!frame.samples) return Fail(Code::InvalidArgument, "a frame without pixels");
  std::vector<Look> looks;
  last_sum_ = 0.0;
  for (const drivers::Region& region : regions_) {
    auto window = WindowOf(region, frame.width, frame.height);
    if (!window) return PassOn(window);
    Look look;
    look.position = place.position;
    look.position_sigma = place.sigma;
    look.frame = &frame;
    look.window = *window;
    look.tiles = ScoreTiles(frame, *window);
    int pixels = 0;
    look.score = ScoreOf(*look.tiles, {}, pixels);
    last_sum_ += look.score.gradient_energy;
    looks.push_back(std::move(look));
  }
  return looks;
}

/// A camera's noise never repeats itself; a picture of one value may.
bool MapSearch::Repeats(double position, const drivers::Frame& frame) {
  const drivers::Frame before = std::exchange(last_, frame);
  if (std::exchange(last_position_, position) == position || !before.samples || !frame.samples) return false;
  const auto [least, most] = std::ranges::minmax(*frame.samples);
  return *before.samples == *frame.samples && least != most;
}

Result<Advice> MapSearch::Next(const Place& place, const drivers::Frame& frame) {
  auto looks = LookAt(place, frame);
  if (!looks) return PassOn(looks);
  if (Repeats(place.position, frame)) {
    return Refuse({Cause::SameFrame,
                   "the same frame was sent twice, although the lens had moved in between: is the camera still taking "
                   "pictures?"});
  }
  if (frames_++ == 0) {
    // It was reached from an unknown side: no point of any curve.
    map_.width_px = frame.width;
    map_.height_px = frame.height;
    const double diagonal = std::hypot(frame.width, frame.height);
    map_.width = 2.0 * frame.width / diagonal;
    map_.height = 2.0 * frame.height / diagonal;
    first_sum_ = last_sum_;
    return Ask();
  }
  if (judged_) return Check(*looks);
  for (std::size_t i = 0; i < curves_.size(); ++i) {
    const TileScores* before = curves_[i].FirstTiles();
    if (before != nullptr && before->tiles.size() != (*looks)[i].tiles->tiles.size()) {
      return Fail(Code::InvalidArgument, "every frame of a focus map must have the same size");
    }
    curves_[i].Add((*looks)[i]);
  }
  return to_visit_.empty() ? AfterPass() : Ask();
}

Advice MapSearch::Ask() {
  const double position = to_visit_.front();
  to_visit_.pop_front();
  return GoAndLook{position};
}

int MapSearch::frames_expected() const {
  if (judged_) return frames_ + 1;
  constexpr int kStepsBeside = 2;  // steps of the pass before, to either side of the tops
  const double last = std::max(LastStep(setup_), setup_.resolution);
  int later = 0;
  for (double step = step_; step > 1.5 * last && later < 64; step /= 3.0) later += 2 * 3 * kStepsBeside;
  return frames_ + static_cast<int>(to_visit_.size()) + later + 1;
}

Advice MapSearch::AfterPass() {
  return PlanFinerPass() ? Ask() : Judge();
}

/// Of the positions that divide the steps around the tops, those where no frame has been taken. False: none is needed.
bool MapSearch::PlanFinerPass() {
  std::vector<double> tops;
  bool fine = true;
  for (const SharpnessCurve& curve : curves_) {
    const std::vector<CurvePoint> points = curve.Points();
    const auto top = TopOf(points);
    if (!top) continue;
    tops.push_back(points[top->index].position);
    fine = fine && FineEnough(setup_, step_, points, top->index);
  }
  const int division = DivisionOf(setup_, step_);
  if (fine || division < 2) return false;
  const std::vector<CurvePoint> taken = curves_.front().Points();
  const double step = step_ / division;
  const auto near = [](double position, double of, double distance) { return std::abs(position - of) < distance; };
  const int intervals = static_cast<int>(std::lround((setup_.highest - setup_.lowest) / step));
  for (int i = 0; i <= intervals; ++i) {
    const double position = std::lerp(setup_.lowest, setup_.highest, static_cast<double>(i) / intervals);
    const bool wanted = std::ranges::any_of(tops, [&](double top) { return near(position, top, step_); });
    const bool seen =
        std::ranges::any_of(taken, [&](const CurvePoint& one) { return near(position, one.position, 0.4 * step); });
    if (wanted && !seen) to_visit_.push_back(position);
  }
  if (!setup_.ascending) std::ranges::reverse(to_visit_);
  step_ = step;
  return !to_visit_.empty();
}

/// The mean over its texture.
FieldPlace MapSearch::PlaceOf(std::size_t region) const {
  FieldPlace place;
  double weights = 0.0;
  for (const TexturePart& part : curves_[region].Texture()) {
    const double x = (regions_[region].x + part.x * regions_[region].width - 0.5) * map_.width;
    const double y = (regions_[region].y + part.y * regions_[region].height - 0.5) * map_.height;
    weights += part.weight;
    place.x += part.weight * x;
    place.y += part.weight * y;
    place.square += part.weight * (x * x + y * y);
  }
  if (!(weights > 0.0)) return place;
  return {place.x / weights, place.y / weights, place.square / weights};
}

Advice MapSearch::Judge() {
  judged_ = true;
  for (std::size_t i = 0; i < curves_.size(); ++i) {
    const std::vector<CurvePoint> points = curves_[i].Points();
    const auto top = TopOf(points);
    const Verdict verdict = top ? JudgePeak(setup_, curves_[i], points, *top, kFitSteps * step_, step_)
                                : Refuse(curves_[i].Overexposed() ? kTooBright : kNoPeak);
    MapCell cell{.place = PlaceOf(i),
                 .sigma = std::hypot(verdict.sigma, kTopErrorPx * setup_.blur_px.value_or(step_)),
                 .cause = verdict.cause,
                 .reason = verdict.reason};
    if (verdict.focused) cell.position = verdict.position;
    map_.cells.push_back(std::move(cell));
  }
  const auto surface = FitSurface(map_.cells, setup_.blur_px.value_or(step_));
  if (!surface) return Refuse({surface.error().cause, surface.error().reason});
  map_.surface = *surface;
  double lowest = setup_.highest, highest = setup_.lowest;
  for (const drivers::Region& region : regions_) {
    const double x = (region.x + 0.5 * region.width - 0.5) * map_.width;
    const double y = (region.y + 0.5 * region.height - 0.5) * map_.height;
    const double at = surface->At({x, y, x * x + y * y});
    lowest = std::min(lowest, at);
    highest = std::max(highest, at);
  }
  map_.best = std::clamp(0.5 * (lowest + highest), setup_.lowest, setup_.highest);
  map_.left = std::max(highest - map_.best, map_.best - lowest);
  return GoAndLook{map_.best};
}

/// The regions as sharp as between the frames of the search beside this place, the median of them.
Advice MapSearch::Check(const std::vector<Look>& looks) const {
  std::vector<double> shares;
  for (std::size_t i = 0; i < curves_.size(); ++i) {
    if (!map_.cells[i].position || map_.cells[i].outlier) continue;
    SharpnessCurve curve = curves_[i];
    curve.Add(looks[i]);
    const std::vector<CurvePoint> taken = curve.Taken();
    const CurvePoint here = taken.back();
    std::vector<CurvePoint> points(taken.begin(), taken.end() - 1);
    std::ranges::stable_sort(points, {}, &CurvePoint::position);
    const auto above = std::ranges::lower_bound(points, here.position, {}, &CurvePoint::position);
    const CurvePoint& high = above == points.end() ? points.back() : *above;
    const CurvePoint& low = above == points.begin() ? points.front() : *(above - 1);
    const double span = high.position - low.position;
    const double part = span > 0.0 ? std::clamp((here.position - low.position) / span, 0.0, 1.0) : 0.0;
    shares.push_back(here.value / std::lerp(low.value, high.value, part));
  }
  const auto middle = shares.begin() + static_cast<std::ptrdiff_t>(shares.size() / 2);
  std::ranges::nth_element(shares, middle);
  if (*middle < kAsPromised) {
    return Refuse({Cause::Unclear,
                   "the frame at the best common focus is less sharp than the search promised: the "
                   "scene or its light has changed, or the lens did not stand where it reports"});
  }
  Verdict verdict;
  verdict.focused = true;
  verdict.position = map_.best;
  verdict.sigma = std::max(map_.surface->sigmas[0], setup_.resolution / std::sqrt(12.0));
  verdict.confidence =
      setup_.blur_px ? std::erf(kHalfDepthOfFieldPx * *setup_.blur_px / (std::sqrt(2.0) * verdict.sigma)) : 1.0;
  verdict.reason = std::to_string(map_.surface->used) + " of " + std::to_string(regions_.size()) +
                   " regions lie on one surface of best focus, checked by a last frame";
  return verdict;
}

int MapSearch::answered() const {
  const auto off = [&](const MapCell& cell) {
    return cell.position ? std::abs(*cell.position - map_.best) : setup_.highest - setup_.lowest;
  };
  return static_cast<int>(std::ranges::min_element(map_.cells, {}, off) - map_.cells.begin());
}

}  // namespace

Result<std::unique_ptr<RegionSearch>> MakeMapSearch(const Setup& setup, const MapGrid& grid) {
  const auto fits = [](int count) { return count >= MapGrid::kLeast && count <= MapGrid::kMost; };
  if (fits(grid.columns) && fits(grid.rows)) return std::make_unique<MapSearch>(setup, grid);
  return Fail(Code::InvalidArgument,
              "a grid has from " + std::to_string(MapGrid::kLeast) + " to " + std::to_string(MapGrid::kMost) +
                  " columns and rows",
              {.parameter = fits(grid.columns) ? "rows" : "columns",
               .minimum = static_cast<double>(MapGrid::kLeast),
               .maximum = static_cast<double>(MapGrid::kMost)});
}

}  // namespace lensd::autofocus
