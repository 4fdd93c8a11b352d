// One autofocus under conditions of its own, inside the rig.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "rig/impl.h"

namespace lensd::rig {

/// Sets exposure, filter and iris, has the rig search, brings them back, and moves on by the shift that was measured.
/// What it does is no command of a caller's: it displaces none, and what a caller has moved or stopped meanwhile it
/// leaves alone. It lives in the callbacks of what it waits for.
class ConditionedSearch : public std::enable_shared_from_this<ConditionedSearch> {
 public:
  /// Why the lens cannot be brought under these conditions and back; nothing is touched.
  static Result<void> Check(const Rig::Impl& rig, const AutofocusRequest& request);
  /// Begins one. Check() has found nothing.
  static void Begin(Rig::Impl& rig, AutofocusRequest request, ProgressCallback progress, AutofocusCallback done);

  ConditionedSearch(Rig::Impl& rig, AutofocusRequest request, ProgressCallback progress, AutofocusCallback done);

 private:
  struct Part {
    std::optional<Target> wanted;
    Native before;
    std::string was;             ///< `before` for people
    std::uint64_t commands = 0;  ///< callers' commands for the axis when it was set
    bool set = false;
    bool restored = false;
  };

  Result<void> Expose(const drivers::ExposureState& exposure);
  void Prepare();
  void OnPrepared(drivers::Axis axis, const Result<MoveOutcome>& moved);
  void Search();
  void Restore(Result<AutofocusOutcome> answer);
  void RestoreExposure();
  void RestoreAxes();
  void OnRestored(drivers::Axis axis, const Result<MoveOutcome>& moved);
  bool Stopped() const { return rig_.commands.all.stops != begun_.stops; }
  bool IsBack(drivers::Axis axis) const;
  std::string WhyLeft(drivers::Axis axis) const;
  void Stays(const std::string& what);
  void ApplyShift();
  void OnShifted(const ShiftSize& shift, const Result<MoveOutcome>& moved);
  void Finish();
  AutofocusOutcome Refusal(autofocus::Cause cause, std::string reason) const;
  FocusConditions Here() const;

  Rig::Impl& rig_;
  AutofocusRequest request_;
  std::shared_ptr<ProgressCallback> progress_;
  AutofocusCallback done_;
  drivers::PerAxis<Part> parts_{};
  drivers::ExposureState exposure_before_{};
  SearchedUnder under_{};
  struct Begun {
    Instant at{};
    std::uint64_t commands = 0;        ///< of callers, all in all
    std::uint64_t focus_commands = 0;  ///< for the focus
    std::uint64_t stops = 0;           ///< of whatever axes
    int motions = 0;
  } begun_;
  std::shared_ptr<Activity> activity_;
  std::optional<Result<AutofocusOutcome>> answer_;
};

}  // namespace lensd::rig
