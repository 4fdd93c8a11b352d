// A lens whose focus shifts with its iris and its filter, for searches under conditions of their own.
#pragma once

#include <gtest/gtest.h>

#include <optional>
#include <string>

#include "rig_on_sim.h"

namespace lensd::rig {

using namespace std::chrono_literals;
using drivers::Axis;
using testing::RigOnSim;

inline constexpr double kWidest = 2.8, kWork = 8.0;
inline constexpr double kShiftUm = 60.0;  // that the widest opening needs more
inline constexpr double kFilterUm = 45.0;
inline constexpr double kSubjectD = 1.0 / 1.2;

inline std::string SceneOf(const std::string& surface) {
  return "version = 1\n[camera]\nwidth = 256\nheight = 256\nexposure_ms = 8\nframe_rate_hz = 200\n"
         "full_well_e = 10000\nread_noise_e = 3.0\nbits = 12\n"
         "[lens]\nfocal_length_mm = 25.0\nf_number = [2.8, 16.0]\nextension_mm = [0.0, 1.2]\nsteps = 8192\n"
         "speed_steps_per_s = 20000\ninitial_f_number = 8.0\nfocus_shift_um = 60\nfilter_focus_um = [0, 45]\n"
         "[[surface]]\nkind = \"wall\"\n" +
         surface + "\n[truth]\nregion = [0.1, 0.1, 0.8, 0.8]\n";
}
inline const std::string kWall = "distance_m = 1.2\ntexture = \"" LENSD_SOURCE_DIR "/scenes/textures/brick.png\"";
inline const std::string kBlank = "distance_m = 1.2\nconstant = 0.5";

inline SearchConditions WideOpen() {
  SearchConditions conditions;
  conditions.exposure.exposure = 1ms;
  conditions.f_number = FNumber{kWidest};
  return conditions;
}

/// What a lens stands at but for focus.
struct Stand {
  double iris = 0.0, filter = 0.0;
  Duration exposure{};
  bool operator==(const Stand&) const = default;
};

class Bench : public RigOnSim {
 public:
  explicit Bench(const std::string& scene, std::uint64_t seed = 1,
                 std::shared_ptr<const Calibration> calibration = nullptr)
      : RigOnSim(scene, seed, 3000, {}, std::move(calibration)) {
    // It begins between two steps, where no motor can go back to.
    for (const double step : {50.0, 60.0})
      Move(Axis::Iris, {.kind = Target::Kind::Native, .value = step, .from = {}, .take_up = {}});
  }
  void Move(Axis axis, const Target& target) {
    std::optional<Result<MoveOutcome>> moved;
    rig->Move(axis, target, [&](Result<MoveOutcome> outcome) { moved = std::move(outcome); });
    RunUntil([&] { return moved.has_value(); }, 10s);
    EXPECT_TRUE(moved && *moved && (*moved)->reached);
  }
  Stand Now() {
    const Status status = rig->GetStatus();
    return {status.axes[Axis::Iris]->position.value, status.axes[Axis::Filter]->position.value,
            *rig->SetExposure({})->exposure};
  }
  void Begin(const SearchConditions& conditions) {
    AutofocusRequest request;
    request.conditions = conditions;
    Begin(std::move(request));
  }
  void Begin(AutofocusRequest request) {
    rig->Autofocus(std::move(request), nullptr, [this](Result<AutofocusOutcome> ended) { answer = std::move(ended); });
  }
  const Result<AutofocusOutcome>& End() {
    RunUntil([this] { return answer.has_value(); }, std::chrono::minutes(5));
    if (!answer) answer = Fail(Code::Internal, "no answer");
    return *answer;
  }
  /// Steps on until the search itself has begun: the iris stands where it is wanted.
  void RunIntoTheSearch() {
    RunUntil([this] { return rig->GetStatus().activity.step > 0; }, 10s);
    ASSERT_GT(rig->GetStatus().activity.step, 0);
    ASSERT_LT(rig->GetStatus().f_number->value, 3.0);
  }
  double OffUm() const {
    const sim::TrueState state = truth->Now();
    const double to_sensor = state.optics.sensor_distance_m;
    return 1e6 * (state.focal_plane_d - kSubjectD) * to_sensor * to_sensor;
  }
  std::optional<Result<AutofocusOutcome>> answer;
};

}  // namespace lensd::rig
