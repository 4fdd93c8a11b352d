// Focus maps of lenses whose tilt and curvature are drawn at random: the truth is what the simulator's lens was made
// with, or where a plane was put; it shares no formula with the fit.
#include <cmath>
#include <random>
#include <sstream>

#include "rig/rig.h"
#include "rig_on_sim.h"
#include "tests/rig/rig_fixture.h"

namespace lensd::rig {
namespace {

using namespace std::chrono_literals;
using testing::RigOnSim;

const std::string kTextures = std::string(LENSD_SOURCE_DIR) + "/scenes/textures/";

/// 240 x 180 px of 5 um: half a diagonal is 0.75 mm, the frame 1.6 and 1.2 half diagonals. At f/2 a pixel of blur is
/// 10 um of extension.
constexpr double kWidth = 1.6, kHeight = 1.2;

std::string SceneText(const std::string& lens, const std::string& surfaces, const std::string& camera = "") {
  return "version = 1\n[camera]\nwidth = 240\nheight = 180\npixel_um = 5\nfull_well_e = 10000\nread_noise_e = 3\n" +
         camera +
         "[lens]\nmodel = \"thin\"\nfocal_length_mm = 25\nf_number = [2, 16]\nextension_mm = [0.3, 0.9]\nsteps = 2048\n"
         "speed_steps_per_s = 20000\nacceleration_steps_per_s2 = 400000\nsettle_ms = 4\ninitial_f_number = 2\n" +
         lens + surfaces;
}

std::string Wall(double distance_m, const std::string& more = "") {
  std::ostringstream text;
  text << "[[surface]]\nkind = \"wall\"\ndistance_m = " << distance_m << "\ntexture = \"" << kTextures
       << "gravel.png\"\n"
       << more;
  return text.str();
}

Result<AutofocusOutcome> MapOf(RigOnSim& sim, autofocus::MapGrid grid = {}) {
  Answers<AutofocusOutcome> answers;
  AutofocusRequest request;
  request.map = grid;
  sim.rig->Autofocus(std::move(request), nullptr, answers.Take());
  sim.RunUntil([&] { return !answers.all.empty(); }, 100s);
  return answers.only();
}

double InUm(Metres length) {
  return length.value * 1e6;
}

struct Tally {
  int within2 = 0, all = 0;
  double worst = 0.0;
  void Add(double found, double truth, double sigma) {
    const double off = std::abs(found - truth) / sigma;
    within2 += off <= 2.0;
    ++all;
    worst = std::max(worst, off);
  }
};

TEST(FocusMap, FindsTiltAndCurvatureWithinItsErrors) {
  std::mt19937 random(20);
  std::uniform_real_distribution<double> tilt(-40.0, 40.0), distance(0.9, 1.4);
  Tally tally;
  constexpr int kDraws = 1;  // a pupil that changes over the field is slow to render; tests/autofocus has many
  for (int draw = 0; draw < kDraws; ++draw) {
    const double curvature = tilt(random), right = tilt(random), down = tilt(random);
    std::ostringstream lens;
    lens << "field_curvature_um = " << curvature << "\nsensor_tilt_um = [" << right << ", " << down << "]\n";
    SCOPED_TRACE(lens.str());
    RigOnSim sim(SceneText(lens.str(), Wall(distance(random))), static_cast<std::uint64_t>(draw + 1));
    const auto outcome = MapOf(sim);
    ASSERT_TRUE(outcome) << outcome.error().message;
    ASSERT_TRUE(outcome->focused && outcome->map && outcome->map->surface) << outcome->reason;
    const auto& found = *outcome->map->surface;
    ASSERT_TRUE(found.curvature);
    for (const double sigma : {InUm(found.across.sigma), InUm(found.down.sigma), InUm(found.curvature_sigma)}) {
      EXPECT_LT(sigma, 4.0);
      EXPECT_GT(sigma, 0.05);
    }
    tally.Add(InUm(found.across.rise), right * kWidth, InUm(found.across.sigma));
    tally.Add(InUm(found.down.rise), down * kHeight, InUm(found.down.sigma));
    tally.Add(InUm(*found.curvature), curvature, InUm(found.curvature_sigma));
  }
  EXPECT_LT(tally.worst, 4.0);
}

TEST(FocusMap, AFlatWallBeforeAnUprightSensorHasNeither) {
  Tally tally;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    RigOnSim sim(SceneText("", Wall(0.8 + 0.1 * static_cast<double>(seed))), seed);
    const auto outcome = MapOf(sim);
    ASSERT_TRUE(outcome && outcome->focused && outcome->map->surface) << outcome->reason;
    const auto& found = *outcome->map->surface;
    tally.Add(InUm(found.across.rise), 0.0, InUm(found.across.sigma));
    tally.Add(InUm(found.down.rise), 0.0, InUm(found.down.sigma));
    tally.Add(InUm(*found.curvature), 0.0, InUm(found.curvature_sigma));
    EXPECT_LT(*found.left_px, 0.5);
    for (const auto& cell : outcome->map->cells) EXPECT_TRUE(cell.position && !cell.found.outlier) << cell.found.reason;
    // Where the wall is, and the lens stands there.
    EXPECT_NEAR(outcome->vergence->value, 1.0 / (0.8 + 0.1 * static_cast<double>(seed)), 2 * 10e-6 / (0.025 * 0.025));
  }
  EXPECT_GE(tally.within2, 0.8 * tally.all);
  EXPECT_LT(tally.worst, 4.0);
}

/// A target whose vergence is u0 + ux x + uy y, x and y from -1 to 1: where it cuts the optical axis it stands at an
/// angle whose tangent is ux over u0 times the sensor's distance over half the sensor's width.
TEST(FocusMap, ATurnedTargetIsToldAsItsAngle) {
  std::mt19937 random(21);
  std::uniform_real_distribution<double> slope(-0.06, 0.06);
  for (int draw = 0; draw < 2; ++draw) {
    const double u0 = 1.0, ux = slope(random), uy = slope(random);
    std::ostringstream plane;
    plane << "[[surface]]\nkind = \"plane\"\nvergence_d = [" << u0 << ", " << ux << ", " << uy << "]\ntexture = \""
          << kTextures << "gravel.png\"\n";
    SCOPED_TRACE(plane.str());
    RigOnSim sim(SceneText("", plane.str()), static_cast<std::uint64_t>(draw + 1));
    const auto outcome = MapOf(sim);
    ASSERT_TRUE(outcome && outcome->focused && outcome->map->surface) << outcome->reason;
    const auto& found = *outcome->map->surface;
    const double to_sensor = 1.0 / (1.0 / 0.025 - u0);
    const auto expect = [&](const FocusMapOutcome::Tilt& tilt, double change, double side_m) {
      ASSERT_TRUE(tilt.target && tilt.sensor);
      const double angle = std::atan(change / u0 * to_sensor / (0.5 * side_m));
      const double sigma = *tilt.sensor_sigma / outcome->map->magnification;
      EXPECT_NEAR(*tilt.target, angle, 4 * sigma + 0.02 * std::abs(angle));
    };
    expect(found.across, ux, 240 * 5e-6);
    expect(found.down, uy, 180 * 5e-6);
  }
}

TEST(FocusMap, ARefusalPutsTheLensBackAndSaysWhy) {
  RigOnSim blank(SceneText("", "[[surface]]\nkind = \"wall\"\ndistance_m = 1.0\nconstant = 0.5\n"), 1, 1234.0);
  auto outcome = MapOf(blank);
  ASSERT_TRUE(outcome) << outcome.error().message;
  EXPECT_FALSE(outcome->focused);
  EXPECT_EQ(outcome->cause, autofocus::Cause::NoTexture);
  EXPECT_NEAR(outcome->position.value, 1234.0, 1.0);
  EXPECT_NE(outcome->reason.find("0 of 20"), std::string::npos) << outcome->reason;

  RigOnSim frozen(SceneText("", Wall(1.0) + "[[fault]]\nat_ms = 200\nkind = \"freeze-frames\"\n"), 1, 1234.0);
  outcome = MapOf(frozen);
  ASSERT_TRUE(outcome) << outcome.error().message;
  EXPECT_EQ(outcome->cause, autofocus::Cause::SameFrame) << outcome->reason;
}

TEST(FocusMap, WhatHasNoExtensionOrTooFewPixelsIsRefusedAtOnce) {
  RigOnSim liquid(SceneText("liquid = true\n", Wall(1.0)));
  EXPECT_EQ(MapOf(liquid).error().code, Code::Unsupported);
  RigOnSim small(SceneText("", Wall(1.0)));
  EXPECT_EQ(MapOf(small, {13, 4}).error().code, Code::InvalidArgument);
  const auto fine = MapOf(small, {12, 12});  // 20 x 15 px each
  EXPECT_EQ(fine.error().code, Code::InvalidArgument);
}

}  // namespace
}  // namespace lensd::rig
