// Pairs of searches, one under each condition. Their differences scatter as the searches do; the mean of them is the
// shift, and its standard error what is not known of it. They are sweeps: depth from defocus stops a little short of
// where it would end coming from the other side, and each of these searches begins where the other condition's ended.
#include "rig/focus_shift_run.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "rig/procedures/command_guard.h"

namespace lensd::rig {
namespace {

using drivers::Axis;

class ShiftRun : public std::enable_shared_from_this<ShiftRun> {
 public:
  using Done = std::move_only_function<void(Result<ShiftOutcome>)>;
  ShiftRun(Rig& rig, const ShiftRequest& request, std::function<void(const ShiftProgress&)> progress, Done done)
      : rig_(rig),
        guard_(rig),
        request_(request),
        progress_(std::move(progress)),
        done_(std::move(done)),
        occupied_(rig.Occupy({Activity::Kind::Autofocus, 0, 2 * request_.pairs})),
        began_at_(rig.clock().Now()) {}

  void Next() {
    const int search = static_cast<int>(found_.size());
    if (search == 2 * request_.pairs) return Conclude();
    occupied_->step = search + 1;
    if (progress_) progress_({.search = search + 1, .of = 2 * request_.pairs, .frames = outcome_.frames});
    AutofocusRequest request;
    request.method = "sweep";
    if (request_.region) request.regions.push_back(*request_.region);
    if (search % 2 == 0) {
      request.conditions = request_.conditions;
      request.conditions->shift = SearchConditions::Shift::Ignore;
    }
    guard_.Autofocus(std::move(request), [self = shared_from_this()](Result<AutofocusOutcome> outcome) {
      self->OnSearched(std::move(outcome));
    });
  }

 private:
  void OnSearched(Result<AutofocusOutcome> outcome) {
    if (!outcome) return done_(PassOn(outcome));
    outcome_.frames += outcome->frames;
    if (!outcome->focused) {
      outcome_.cause = outcome->cause;
      outcome_.reason = outcome->reason;
      return End();
    }
    if (outcome->under) under_ = *outcome->under;
    found_.push_back(outcome->subject->position);
    Next();
  }

  void Conclude() {
    const OpticsTable* const optics = rig_.optics();
    const bool native = optics == nullptr || !optics->has_focus();
    const auto place = [&](Native position) {
      return native ? position.value : optics->ExtensionFromNative(position).value;
    };
    const auto n = static_cast<double>(request_.pairs);
    std::vector<double> shifts;
    for (std::size_t i = 0; i + 1 < found_.size(); i += 2) shifts.push_back(place(found_[i + 1]) - place(found_[i]));
    double mean = 0.0, square = 0.0;
    for (const double shift : shifts) mean += shift / n;
    for (const double shift : shifts) square += (shift - mean) * (shift - mean);
    // Sweeps that agree to less than a position have all stood at the same ones.
    const Native step{rig_.lens().axes[Axis::Focus]->resolution};
    const double least = std::abs(place(found_.back() + step) - place(found_.back()));
    outcome_.measured = true;
    outcome_.shift.size = {native, mean, std::max(std::sqrt(square / (n - 1.0) / n), least)};
    outcome_.shift.runs = request_.pairs;
    outcome_.shift.focal_length = under_.work.focal_length;
    if (request_.conditions.f_number && under_.search.f_number && under_.work.f_number) {
      outcome_.shift.f_numbers.emplace(*under_.search.f_number, *under_.work.f_number);
    }
    if (request_.conditions.filter) outcome_.shift.filters.emplace(*under_.search.filter, *under_.work.filter);
    End();
  }

  void End() {
    outcome_.elapsed = rig_.clock().Now() - began_at_;
    occupied_.reset();
    done_(std::move(outcome_));
  }

  Rig& rig_;
  CommandGuard guard_;
  ShiftRequest request_;
  std::function<void(const ShiftProgress&)> progress_;
  Done done_;
  std::shared_ptr<Activity> occupied_;
  Instant began_at_;
  ShiftOutcome outcome_;
  SearchedUnder under_;
  std::vector<Native> found_;  ///< under the conditions and without them, in turn
};

/// Why there is nothing to measure.
std::optional<Error> WhyNoPair(const Rig& rig, const ShiftRequest& request) {
  const auto wrong = [](const char* parameter, const char* why) {
    return Fail(Code::InvalidArgument, why, {.parameter = parameter}).error();
  };
  if (request.conditions.f_number.has_value() == request.conditions.filter.has_value()) {
    return wrong("fNumber", "give exactly one of f-number and filter: their shifts are measured separately");
  }
  if (request.pairs < 3) return wrong("pairs", "at least three pairs of searches are needed");
  const Status status = rig.GetStatus();
  if (request.conditions.f_number && status.f_number && SameFNumber(*request.conditions.f_number, *status.f_number)) {
    return wrong("fNumber", "the lens is at that f-number already: first move its iris to the f-number of normal use");
  }
  const auto& wheel = status.axes[Axis::Filter];
  if (request.conditions.filter && wheel && std::abs((*request.conditions.filter - wheel->position).value) < 0.5) {
    return wrong("filterPosition", "that filter is in place already: first move to the filter of normal use");
  }
  return std::nullopt;
}

}  // namespace

void MeasureFocusShift(Rig& rig, const ShiftRequest& request, std::function<void(const ShiftProgress&)> progress,
                       std::move_only_function<void(Result<ShiftOutcome>)> done) {
  if (auto why = WhyNoPair(rig, request)) return done(PassOn(*std::move(why)));
  std::make_shared<ShiftRun>(rig, request, std::move(progress), std::move(done))->Next();
}

}  // namespace lensd::rig
