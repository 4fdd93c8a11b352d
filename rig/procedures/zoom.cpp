// The way is divided so that within one part focus has to move by no more than the tolerance. Zoom and focus then start
// each part together, and wherever either is at any moment, focus is within one part's travel of where it belongs.
//
// Backlash: where focus follows against the direction it is otherwise approached from, its counts are shifted by the
// backlash, which the first part of the way takes up; at the end it goes past its place by no more than what is not
// known of the backlash, and comes back from its own side.
#include "rig/zoom.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "base/missing_optics.h"
#include "rig/procedures/command_guard.h"

namespace lensd::rig {
namespace {

using drivers::Axis;

constexpr double kTolerance_px = 2.0;
constexpr double kOfRange = 0.01;
constexpr int kFinest = 4096;  ///< parts at most
/// Of the tolerance, for what focus has to do within a part: where more of it is taken by what is not known, smaller
/// parts help little, and the bound says by how much it is exceeded.
constexpr double kLeast = 0.25;

class ZoomRun : public std::enable_shared_from_this<ZoomRun> {
 public:
  using Done = std::move_only_function<void(Result<ZoomOutcome>)>;
  ZoomRun(Rig& rig, const ZoomRequest& request, Done done)
      : rig_(rig),
        guard_(rig, {Axis::Zoom, Axis::Focus}),
        began_at_(rig.clock().Now()),
        request_(request),
        done_(std::move(done)) {}
  void Begin();

 private:
  struct Part {
    Native zoom;
    Native focus;  ///< as approached from its own side
  };
  /// What becomes of the focus' counts where it moves against its approach.
  struct Reversal {
    double shift = 0.0;   ///< of the counts
    double margin = 0.0;  ///< what is not known of it
    bool up = true;       ///< focus is approached moving up
    /// `by` against the approach.
    Native Against(double by) const { return Native{up ? -by : by}; }
  };
  struct UnderWay {
    int axes = 0;
    std::optional<Error> error;
  };
  Dioptres KeptFrom(const OpticsTable& table) const;
  Result<Native> FocusAt(Native zoom) const;
  Metres Unsure(const Part& part) const;
  Result<void> Divide(Native from, Native to);
  Metres Tolerance(const Status& status) const;
  Metres Off(Native zoom, Native focus, Native focus_there) const;
  void Next();
  void OnMoved(Axis axis, Result<MoveOutcome> moved);
  void TakeUp();
  void Finish();
  void MoveFocus(Native to, MoveCallback done);

  void Answer();

  Rig& rig_;
  CommandGuard guard_;
  const Instant began_at_;
  ZoomRequest request_;
  Done done_;
  std::shared_ptr<const OpticsTable> optics_;
  Reversal reversal_;
  bool against_ = false;     ///< focus last moved against its approach
  std::vector<Part> parts_;  ///< the first one is where both stand
  std::size_t next_ = 1;
  UnderWay under_way_;
  ZoomOutcome outcome_;
};

Metres ZoomRun::Tolerance(const Status& status) const {
  if (request_.tolerance) return *request_.tolerance;
  const auto* camera = rig_.camera();
  if (camera != nullptr && camera->pixel_um > 0.0 && status.f_number) {
    return Metres{kTolerance_px * camera->pixel_um * 1e-6 * status.f_number->value};
  }
  const auto [low, high] = rig_.SoftLimits(Axis::Focus);
  const Metres range = optics_->ExtensionFromNative(high) - optics_->ExtensionFromNative(low);
  return Metres{kOfRange * std::abs(range.value)};
}

/// The plane that is kept stands still; the lens centre may not.
Dioptres ZoomRun::KeptFrom(const OpticsTable& table) const {
  const Metres nearer = table.centre_shift() - optics_->centre_shift();
  const double kept = outcome_.kept.value;
  return Dioptres{kept / (1.0 - kept * nearer.value)};
}

/// Where focus belongs with the zoom there.
Result<Native> ZoomRun::FocusAt(Native zoom) const {
  Conditions there = optics_->conditions();
  there.zoom = zoom;
  const OpticsTable table = optics_->In(there);
  const auto extension = table.ExtensionInFocus(KeptFrom(table));
  if (!extension) return PassOn(extension);
  const Native focus = table.NativeFromExtension(*extension);
  const auto [low, high] = rig_.SoftLimits(Axis::Focus);
  const double resolution = rig_.lens().axes[Axis::Focus]->resolution;
  if (focus.value < low.value - resolution || focus.value > high.value + resolution) {
    return Fail(Code::OutOfRange, "at that focal length the plane in focus is out of the reach of focus");
  }
  return std::clamp(focus, low, high);
}

/// On the sensor side, with the zoom there: from where focus is to where it belongs.
Metres ZoomRun::Off(Native zoom, Native focus, Native focus_there) const {
  Conditions there = optics_->conditions();
  there.zoom = zoom;
  const OpticsTable table = optics_->In(there);
  return Metres{std::abs((table.ExtensionFromNative(focus) - table.ExtensionFromNative(focus_there)).value)};
}

/// What is not known of where focus stands, and of what its positions mean, holds on the way as well.
Metres ZoomRun::Unsure(const Part& part) const {
  Conditions there = optics_->conditions();
  there.zoom = part.zoom;
  const Native unsure{2.0 * (reversal_.margin + rig_.lens().axes[Axis::Focus]->resolution)};
  return Off(part.zoom, part.focus, part.focus + unsure) + 2.0 * optics_->In(there).ExtensionError(part.focus);
}

Result<void> ZoomRun::Divide(Native from, Native to) {
  const auto start = FocusAt(from);
  if (!start) return PassOn(start);
  const Metres tolerance = Tolerance(rig_.GetStatus());
  const double resolution = rig_.lens().axes[Axis::Zoom]->resolution;
  const double whole = std::abs((to - from).value);
  // Halved until focus is off by no more than the tolerance in any part: what focus does over the zoom is smooth.
  for (int count = 1;; count *= 2) {
    parts_ = {{from, *start}};
    Metres worst{0.0}, unsure{0.0};
    for (int i = 1; i <= count; ++i) {
      Native zoom = from + (to - from) * (static_cast<double>(i) / count);
      if (i < count) zoom = Native{from.value + std::round((zoom - from).value / resolution) * resolution};
      const auto focus = FocusAt(zoom);
      if (!focus) return PassOn(focus);
      worst = std::max(worst, Off(zoom, parts_.back().focus, *focus));
      parts_.push_back({zoom, *focus});
      unsure = std::max(unsure, Unsure(parts_.back()));
    }
    outcome_.tracking_bound = worst + unsure;
    const Metres left = std::max(tolerance - unsure, kLeast * tolerance);
    if (worst <= left || whole / count <= 2.0 * resolution || count >= kFinest) return {};
  }
}

void ZoomRun::Begin() {
  const Status status = rig_.GetStatus();
  optics_ = status.optics;
  const auto& zoom = status.axes[Axis::Zoom];
  for (const Axis axis : {Axis::Zoom, Axis::Focus}) {
    if (auto lost = WhyLost(axis, status.axes[axis])) return done_(PassOn(*std::move(lost)));
  }
  if (!optics_ || !optics_->has_zoom() || !optics_->has_focus() || !status.vergence || !zoom) {
    const std::string why = "focus cannot follow the zoom: the focal lengths or the focus of this lens are";
    return done_(Fail(Code::Unsupported, optics_ ? why + " not known" : OpticsMissing(why)));
  }
  const auto target = rig_.Resolve(Axis::Zoom, request_.target);
  if (!target) return done_(PassOn(target));
  outcome_.kept = *status.vergence;
  const Backlash backlash = rig_.backlash(Axis::Focus);
  const double resolution = rig_.lens().axes[Axis::Focus]->resolution;
  reversal_ = {.shift = backlash.steps,
               .margin = std::max(backlash.high - backlash.steps, backlash.steps - backlash.low),
               .up = rig_.approaches_up(Axis::Focus)};
  if (reversal_.shift > 0.0) reversal_.margin = std::max(reversal_.margin, resolution);
  if (auto divided = Divide(zoom->position, *target); !divided) return done_(PassOn(divided));
  outcome_.steps = static_cast<int>(parts_.size()) - 1;
  Next();
}

void ZoomRun::MoveFocus(Native to, MoveCallback done) {
  const auto [low, high] = rig_.SoftLimits(Axis::Focus);
  const Target target{
      .kind = Target::Kind::Native, .value = std::clamp(to, low, high).value, .from = {}, .take_up = 0.0};
  guard_.Move(Axis::Focus, target, std::move(done));
}

void ZoomRun::Next() {
  if (next_ == parts_.size()) return against_ ? TakeUp() : Finish();
  const Part& part = parts_[next_];
  const double ahead = (part.focus - parts_[next_ - 1].focus).value * (reversal_.up ? 1.0 : -1.0);
  if (ahead != 0.0) against_ = reversal_.shift > 0.0 && ahead < 0.0;
  const Native focus = against_ ? part.focus + reversal_.Against(reversal_.shift) : part.focus;
  under_way_.axes = 2;
  const auto self = shared_from_this();
  const Target zoom{.kind = Target::Kind::Native, .value = part.zoom.value, .from = {}, .take_up = 0.0};
  guard_.Move(Axis::Zoom, zoom, [self](Result<MoveOutcome> moved) { self->OnMoved(Axis::Zoom, std::move(moved)); });
  MoveFocus(focus, [self](Result<MoveOutcome> moved) { self->OnMoved(Axis::Focus, std::move(moved)); });
}

void ZoomRun::OnMoved(Axis axis, Result<MoveOutcome> moved) {
  if (!moved && !under_way_.error) under_way_.error = moved.error();
  if (moved && axis == Axis::Zoom) outcome_.zoom = *moved;
  if (moved && axis == Axis::Focus) outcome_.focus = *moved;
  if (--under_way_.axes > 0) return;
  if (under_way_.error) return done_(PassOn(*under_way_.error));
  for (MoveOutcome* one : {&outcome_.zoom, &*outcome_.focus}) {
    if (one->reached) continue;
    outcome_.zoom.reached = false;
    if (one == &outcome_.zoom) return Answer();
    outcome_.zoom.cause = MoveCause::FocusLost;
    outcome_.zoom.reason = "focus could not follow: " + one->reason;
    return Answer();
  }
  ++next_;
  Next();
}

/// From its own side, past the place by no more than what is not known of the backlash.
void ZoomRun::TakeUp() {
  const Native place = parts_.back().focus;
  const double past = std::ceil(reversal_.shift + reversal_.margin);
  MoveFocus(place + reversal_.Against(past), [self = shared_from_this()](Result<MoveOutcome> moved) {
    if (!moved) return self->done_(PassOn(moved));
    self->Finish();
  });
}

void ZoomRun::Finish() {
  MoveFocus(parts_.back().focus, [self = shared_from_this()](Result<MoveOutcome> moved) {
    if (!moved) return self->done_(PassOn(moved));
    self->outcome_.focus = *moved;
    if (!moved->reached) {
      self->outcome_.zoom.reached = false;
      self->outcome_.zoom.cause = MoveCause::FocusLost;
      self->outcome_.zoom.reason = "focus could not follow: " + moved->reason;
    }
    self->Answer();
  });
}

/// Both axes took all the time that the parts took together.
void ZoomRun::Answer() {
  outcome_.zoom.elapsed = rig_.clock().Now() - began_at_;
  if (outcome_.focus) outcome_.focus->elapsed = outcome_.zoom.elapsed;
  if (request_.tolerance && outcome_.tracking_bound > *request_.tolerance) {
    std::string& reason = outcome_.zoom.reason;
    if (!reason.empty()) reason += "; ";
    reason += "the tracking tolerance is finer than steps, backlash and calibration of focus allow";
  }
  done_(outcome_);
}

}  // namespace

void ZoomKeepingFocus(Rig& rig, const ZoomRequest& request, std::move_only_function<void(Result<ZoomOutcome>)> done) {
  if (auto possible = rig.Resolve(Axis::Zoom, request.target); !possible) return done(PassOn(possible));
  std::make_shared<ZoomRun>(rig, request, std::move(done))->Begin();
}

}  // namespace lensd::rig
