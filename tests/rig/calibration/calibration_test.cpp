// What positions mean: curves rise where their points do, every conversion has its inverse, the file says it all, and
// the error is part of what is told.
#include "rig/calibration.h"

#include <gtest/gtest.h>  // before rapidcheck/gtest.h, which needs it

#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "io/toml.h"
#include "optics/conjugates.h"
#include "rig/calibration/curve.h"
#include "rig/optics_table.h"
#include "tests/rig/calibration_samples.h"

namespace lensd::rig {
namespace {

using namespace std::chrono_literals;

// ---- curves -------------------------------------------------------------------------------------------------------

RC_GTEST_PROP(CalibrationProperty, CurvesRiseBetweenRisingPointsAndInvert, ()) {
  const int count = *rc::gen::inRange(2, 12);
  std::vector<Curve::Knot> knots;
  double at = *rc::gen::inRange(-1000, 1000), value = *rc::gen::inRange(-1000, 1000);
  for (int i = 0; i < count; ++i) {
    knots.push_back({at, value});
    at += *rc::gen::inRange(1, 100000) * 1e-2;
    value += *rc::gen::inRange(1, 100000) * 1e-3;  // slopes differ by up to 10^10
  }
  const auto curve = Curve::Through(knots);
  RC_ASSERT(curve.has_value());
  RC_ASSERT(curve->rising());
  for (const auto& knot : knots) RC_ASSERT(std::abs(curve->At(knot.at) - knot.value) < 1e-9);
  const double span = knots.back().at - knots.front().at;
  double before = curve->At(knots.front().at - 0.5 * span);
  for (int i = 1; i <= 400; ++i) {
    const double x = knots.front().at + span * (-0.5 + 2.0 * i / 400);
    const double here = curve->At(x);
    RC_ASSERT(here > before);
    before = here;
    // As exact as the curve's own rounding allows where it is flat.
    RC_ASSERT(std::abs(curve->At(curve->Inverse(here)) - here) <= 1e-12 * (1.0 + std::abs(here)));
  }
}

RC_GTEST_PROP(CalibrationProperty, EveryConversionHasItsInverse, ()) {
  auto calibration = With({Measured(*rc::gen::inRange(2, 20))});
  calibration->iris = AxisCurve{0.01, {{Native{0}, 2.1}, {Native{40}, 4.5}, {Native{70}, 9.0}, {Native{100}, 15.0}}};
  calibration->zoom = AxisCurve{0.01, {{Native{0}, 0.025}, {Native{30}, 0.03}, {Native{100}, 0.05}}};
  const double stretch = *rc::gen::inRange(-20, 20) * 1e-3;
  calibration->breathing = {{Metres{0.0}, 1.0}, {Metres{1.2e-3}, 1.0 + stretch}};
  const OpticsTable table =
      Table(calibration).In({.zoom = Native{1.0 * *rc::gen::inRange(0, 100)}, .filter = {}, .temperature = {}});
  const Native focus{*rc::gen::inRange(0, 1000000) * 1e-3}, other{*rc::gen::inRange(0, 100000) * 1e-3};
  const Metres extension = table.ExtensionFromNative(focus);
  RC_ASSERT(std::abs((table.NativeFromExtension(extension) - focus).value) < 1e-7);
  const Dioptres vergence = table.VergenceFromExtension(extension);
  const auto back = table.ExtensionInFocus(vergence);
  RC_ASSERT(back.has_value());
  RC_ASSERT(std::abs((*back - extension).value) < 1e-15);
  RC_ASSERT(std::abs((table.NativeFromFNumber(table.FNumberFromNative(other)) - other).value) < 1e-9);
  RC_ASSERT(std::abs((table.NativeFromFocalLength(table.FocalLengthFromNative(other)) - other).value) < 1e-9);
}

TEST(Curve, RefusesWhatIsNoCurve) {
  EXPECT_FALSE(Curve::Through({{0, 1}}));
  EXPECT_FALSE(Curve::Through({{0, 1}, {0, 2}}));
  EXPECT_FALSE(Curve::Through({{0, 1}, {1, NAN}}));
  // Between them no other number is left, as fuzzing found.
  EXPECT_FALSE(Curve::Through({{0, 0}, {4.9e-324, 1e-303}, {30, 1.5e-3}}));
  EXPECT_FALSE(Curve::Through({{1, 0}, {std::nextafter(1, 2), 1e-3}}));
  EXPECT_TRUE(Curve::Through({{0, 1}, {1, 2}})->rising());
  EXPECT_FALSE(Curve::Through({{0, 1}, {1, 2}, {2, 1.5}})->rising());
}

// ---- what a calibration changes -----------------------------------------------------------------------------------

TEST(OpticsTable, TwoPointsAreAStraightLineAndManyFollowTheLens) {
  FocusCurve stops;
  stops.error = Metres{20e-6};
  stops.points = {{Native{100}, Metres{0.0}, {}}, {Native{900}, Metres{0.8e-3}, {}}};
  EXPECT_NEAR(Table(With({stops})).ExtensionFromNative(Native{500}).value, 0.4e-3, 1e-15);
  const OpticsTable fine = Table(With({Measured(21)}));
  double worst = 0.0;
  for (double steps = 0; steps <= 1000; steps += 7) {
    worst = std::max(worst, std::abs(fine.ExtensionFromNative(Native{steps}).value - TrueExtension(steps)));
  }
  EXPECT_LT(worst, 0.1e-6);
  EXPECT_GT(std::abs(Table(nullptr).ExtensionFromNative(Native{500}).value - TrueExtension(500)), 20e-6);
}

TEST(OpticsTable, VergencesAndDistancesAreCalibratedWithoutAnExactFocalLength) {
  // The true lens has 25.5 mm where the plate says 25: what was measured is where it focuses.
  FocusCurve curve;
  curve.error = Metres{1e-6};
  for (double steps = 0; steps <= 1000; steps += 50) {
    curve.points.push_back(
        {Native{steps}, std::nullopt, optics::FocalPlane(Metres{25.5e-3}, Metres{TrueExtension(steps)})});
  }
  RigConfig config;
  config.focal_length_tolerance = 0.03;
  const OpticsTable table = Table(With({curve}), config);
  for (double steps = 0; steps <= 1000; steps += 12.5) {
    const Dioptres truth = optics::FocalPlane(Metres{25.5e-3}, Metres{TrueExtension(steps)});
    const Metres extension = table.ExtensionFromNative(Native{steps});
    EXPECT_NEAR(table.VergenceFromExtension(extension).value, truth.value, table.VergenceError(Native{steps}).value);
    EXPECT_LT(table.VergenceError(Native{steps}).value, 0.002);
    EXPECT_NEAR(extension.value, TrueExtension(steps), table.ExtensionError(Native{steps}).value);
  }
  // The same lens by its extension: now the plane is as uncertain as the focal length.
  const OpticsTable by_extension = Table(With({Measured(21)}), config);
  const Dioptres plane = by_extension.VergenceFromExtension(by_extension.ExtensionFromNative(Native{800}));
  const Dioptres truth = optics::FocalPlane(Metres{25.5e-3}, Metres{TrueExtension(800)});
  EXPECT_NEAR(plane.value, truth.value, by_extension.VergenceError(Native{800}).value);
  EXPECT_GT(by_extension.VergenceError(Native{800}).value, 0.02);
}

TEST(OpticsTable, GradesTellHowFarToTrust) {
  EXPECT_EQ(Table(nullptr).grade(), Grade::Uncalibrated);
  EXPECT_FALSE(Table(nullptr).error());
  FocusCurve part = Measured();
  part.points = {part.points.begin() + 2, part.points.end() - 2};
  const OpticsTable table = Table(With({part}));
  EXPECT_EQ(table.GradeAt(Native{500}), Grade::Calibrated);
  EXPECT_EQ(table.ExtensionError(Native{500}).value, 0.5e-6);
  EXPECT_EQ(table.error()->value, 0.5e-6);
  // Beyond what was measured: an estimate that holds here.
  EXPECT_EQ(table.GradeAt(Native{0}), Grade::Approximate);
  EXPECT_GT(table.ExtensionError(Native{0}).value, 0.5e-6);
  EXPECT_NEAR(table.ExtensionFromNative(Native{0}).value, TrueExtension(0), table.ExtensionError(Native{0}).value);
}

TEST(OpticsTable, BetweenTwoZoomsEveryFocalLengthLiesBetweenTheirCurves) {
  drivers::NominalOptics zoom = Nominal();
  zoom.max_focal_length_m = 0.05;
  FocusCurve wide = Measured(), tele = Measured(11, 1.2);
  wide.focal_length = Metres{0.025};
  tele.focal_length = Metres{0.05};
  const OpticsTable table = Table(With({wide, tele}), {}, zoom);
  const auto at = [&](double native) {
    return table.In({.zoom = Native{native}, .filter = {}, .temperature = {}}).ExtensionFromNative(Native{600}).value;
  };
  EXPECT_NEAR(at(0), TrueExtension(600), 1e-12);
  EXPECT_NEAR(at(100), 1.2 * TrueExtension(600), 1e-12);
  EXPECT_NEAR(at(50), 1.1 * TrueExtension(600), 1e-12);
  const OpticsTable middle = table.In({.zoom = Native{50}, .filter = {}, .temperature = {}});
  EXPECT_NEAR(middle.focal_length().value, 0.0375, 1e-12);
  EXPECT_EQ(middle.grade(), Grade::Calibrated);
  EXPECT_NEAR(middle.NativeFromExtension(middle.ExtensionFromNative(Native{321})).value, 321, 1e-7);
  // Only one zoom measured: elsewhere it is a guess.
  const OpticsTable single = Table(With({wide}), {}, zoom);
  EXPECT_EQ(single.In({.zoom = Native{0}, .filter = {}, .temperature = {}}).grade(), Grade::Calibrated);
  EXPECT_EQ(single.In({.zoom = Native{50}, .filter = {}, .temperature = {}}).grade(), Grade::Approximate);
}

TEST(OpticsTable, FiltersWavelengthsAndTemperaturesChooseTheirCurve) {
  FocusCurve red = Measured(), blue = Measured(11, 1.01);
  red.filter = 1;
  blue.filter = 2;
  const OpticsTable filters = Table(With({red, blue}));
  const auto through = [&](double filter) {
    return filters.In({.zoom = {}, .filter = Native{filter}, .temperature = {}});
  };
  EXPECT_NEAR(through(1).ExtensionFromNative(Native{500}).value, TrueExtension(500), 1e-12);
  EXPECT_NEAR(through(2).ExtensionFromNative(Native{500}).value, 1.01 * TrueExtension(500), 1e-12);
  EXPECT_EQ(through(3).grade(), Grade::Approximate);
  EXPECT_NEAR(through(3).ExtensionFromNative(Native{500}).value, 1.005 * TrueExtension(500), 1e-12);

  FocusCurve cold = Measured(), hot = Measured(11, 1.02);
  cold.temperature = Celsius{10};
  hot.temperature = Celsius{30};
  const OpticsTable warm = Table(With({cold, hot})).In({.zoom = {}, .filter = {}, .temperature = Celsius{25}});
  EXPECT_NEAR(warm.ExtensionFromNative(Native{500}).value, 1.015 * TrueExtension(500), 1e-12);

  FocusCurve at450 = Measured(), at650 = Measured(11, 1.04);
  at450.wavelength = Metres{450e-9};
  at650.wavelength = Metres{650e-9};
  RigConfig config;
  config.wavelength = Metres{500e-9};
  EXPECT_NEAR(Table(With({at450, at650}), config).ExtensionFromNative(Native{500}).value, 1.01 * TrueExtension(500),
              1e-12);
  config.wavelength.reset();
  EXPECT_EQ(Table(With({at450, at650}), config).grade(), Grade::Approximate);
}

TEST(OpticsTable, TemperatureIsCorrectedOnRequestAndOtherwiseCountsInTheBound) {
  auto calibration = With({Measured()});
  calibration->temperature = TemperatureModel{Metres{2e-6}, Metres{0.1e-6}, Celsius{20}, Celsius{0}, Celsius{40}};
  const Conditions hot{.zoom = {}, .filter = {}, .temperature = Celsius{30}};
  const OpticsTable off = Table(calibration).In(hot);
  EXPECT_NEAR(off.ExtensionFromNative(Native{500}).value, TrueExtension(500), 1e-12);
  EXPECT_NEAR(off.ExtensionError(Native{500}).value, 0.5e-6 + 10.05 * 2.1e-6, 1e-12);
  RigConfig config;
  config.temperature.compensate = true;
  const OpticsTable on = Table(calibration, config).In(hot);
  EXPECT_NEAR(on.ExtensionFromNative(Native{500}).value, TrueExtension(500) + 20e-6, 1e-12);
  EXPECT_NEAR(on.ExtensionError(Native{500}).value, 0.5e-6 + 10.05 * 0.1e-6 + 0.05 * 2e-6, 1e-12);
  EXPECT_NEAR(on.NativeFromExtension(on.ExtensionFromNative(Native{444})).value, 444, 1e-7);
  // No thermometer: wherever it may be used.
  EXPECT_NEAR(Table(calibration, config).ExtensionError(Native{500}).value, 0.5e-6 + 42e-6, 1e-12);
  config.temperature.metres_per_degree.reset();
  // Without a coefficient it works, uncorrected: or it could not be given the calibration that has one.
  const OpticsTable unknown = Table(With({Measured()}), config).In(hot);
  EXPECT_NEAR(unknown.ExtensionFromNative(Native{500}).value, TrueExtension(500), 1e-12);
}

// The mechanism lags: the same place has a smaller count moving down than moving up.
TEST(OpticsTable, AnApproachFromTheOtherSideShiftsByTheBacklash) {
  FocusCurve downward;
  downward.approach_near = false;
  downward.error = Metres{0.5e-6};
  for (double steps = 0; steps <= 1000; steps += 50) {
    downward.points.push_back({Native{steps}, Metres{TrueExtension(steps + 37.0)}, {}});
  }
  auto calibration = With({downward});
  EXPECT_FALSE(OpticsTable::Create(Nominal(), Motors(), RigConfig{}, calibration));
  calibration->backlash[Axis::Focus] = Backlash{37.0, 36.0, 38.0, true};
  const OpticsTable table = Table(calibration);
  EXPECT_NEAR(table.ExtensionFromNative(Native{500}).value, TrueExtension(500), 0.1e-6);
  EXPECT_NEAR(table.ExtensionError(Native{500}).value, 0.5e-6 + 0.9e-6, 0.05e-6);
  // Curves of the lens' own approach come first.
  calibration->focus.push_back(Measured(11, 1.1));
  EXPECT_NEAR(Table(calibration).ExtensionFromNative(Native{500}).value, 1.1 * TrueExtension(500), 1e-12);
}

TEST(OpticsTable, NominalFiguresHoldMovingTowardNear) {
  RigConfig config;
  const auto near = OpticsTable::Create(Nominal(), Motors(), config, nullptr);
  ASSERT_TRUE(near);
  config.axes[Axis::Focus].approach_near = false;
  const auto unknown = OpticsTable::Create(Nominal(), Motors(), config, nullptr);
  ASSERT_TRUE(unknown);
  EXPECT_GE(unknown->ExtensionError(Native{500}).value,
            0.099 * (near->ExtensionFromNative(Native{1000}) - near->ExtensionFromNative(Native{0})).value);
  config.axes[Axis::Focus].backlash = 37.0;
  const auto far = OpticsTable::Create(Nominal(), Motors(), config, nullptr);
  ASSERT_TRUE(far);
  for (const double position : {0.0, 123.0, 500.0, 963.0}) {
    EXPECT_NEAR(far->ExtensionFromNative(Native{position}).value,
                near->ExtensionFromNative(Native{position + 37.0}).value, 1e-12);
    const Metres there = far->ExtensionFromNative(Native{position});
    EXPECT_NEAR(far->NativeFromExtension(there).value, position, 1e-9);
  }
  EXPECT_EQ(far->ExtensionError(Native{500}).value, near->ExtensionError(Native{500}).value);
}

TEST(OpticsTable, RefusesACalibrationThatContradictsTheWiring) {
  RigConfig config;
  config.axes[Axis::Focus].direction = drivers::Direction::NearNegative;
  const auto made = OpticsTable::Create(Nominal(), Motors(), config, With({Measured()}));
  ASSERT_FALSE(made);
  EXPECT_NE(made.error().message.find("near-negative"), std::string::npos) << made.error().message;
}

TEST(OpticsTable, BreathingChangesTheFocalLengthAndThePlane) {
  auto calibration = With({Measured()});
  calibration->breathing = {{Metres{0.0}, 1.0}, {Metres{1e-3}, 1.02}};
  const OpticsTable table = Table(calibration);
  const Metres extension{0.5e-3};
  EXPECT_NEAR(table.FocalLengthAt(extension).value, 1.01 * kFocalLength, 1e-12);
  EXPECT_NEAR(table.VergenceFromExtension(extension).value, 0.5e-3 / (0.02525 * 0.02575), 1e-9);
}

// ---- the file -----------------------------------------------------------------------------------------------------

Result<Calibration> Read(const std::string& text) {
  auto settings = io::ParseToml(text, "lens.toml");
  if (!settings) return PassOn(settings);
  return ReadCalibration(*settings);
}

Calibration Everything() {
  Calibration all = *With({Measured(3), Measured(4, 1.1)});
  all.serial = "A\"1\\2";
  all.made = "2026-11-21 by hand";
  all.grade = Grade::Approximate;
  all.focus[1].approach_near = false;
  all.focus[1].focal_length = Metres{0.0123};
  all.focus[1].filter = 2;
  all.focus[1].wavelength = Metres{550e-9};
  all.focus[1].temperature = Celsius{-3.5};
  all.focus[1].points[0].extension.reset();
  all.focus[1].points[0].vergence = Dioptres{0.0};
  all.iris = AxisCurve{0.02, {{Native{0}, 1.4}, {Native{99}, 16.0}}};
  all.zoom = AxisCurve{0.01, {{Native{0}, 0.05, Metres{21e-3}}, {Native{99}, 0.0123, Metres{0.0}}}};
  all.breathing = {{Metres{0.0}, 1.0}, {Metres{1e-3}, 0.98}};
  all.temperature = TemperatureModel{Metres{-1.5e-6}, Metres{0.1e-6}, Celsius{21}, Celsius{-10}, Celsius{50}};
  all.backlash[Axis::Focus] = Backlash{200.3, 199.0, 201.6, true};
  all.backlash[Axis::Iris] = Backlash{3, 3, 3, false};
  const FocusAtConditions under{Native{7}, Native{2}, Celsius{21.5}, FNumber{2.8}, Metres{550e-9}, false};
  all.focus_at = FocusAtSamples{
      {{"x", "mm"}, {"angle", ""}},
      {{{12.5, -30.0}, Native{1210.25}, Native{1.5}, under, "today"}, {{0.0, 1.0}, Native{-3.0}, Native{0.5}, {}, ""}}};
  return all;
}

TEST(CalibrationFile, SaysEverythingAndReadsBack) {
  const Calibration all = Everything();
  const std::string text = CalibrationText(all);
  const auto read = Read(text);
  ASSERT_TRUE(read) << read.error().message << "\n" << text;
  EXPECT_EQ(CalibrationText(*read), text);
  EXPECT_EQ(read->serial, all.serial);
  EXPECT_EQ(read->grade, all.grade);
  ASSERT_EQ(read->focus.size(), 2u);
  EXPECT_NEAR(read->focus[1].wavelength->value, 550e-9, 1e-18);
  EXPECT_EQ(read->focus[1].points[0].vergence->value, 0.0);
  EXPECT_NEAR(read->focus[0].points[1].extension->value, all.focus[0].points[1].extension->value, 1e-15);
  EXPECT_EQ(read->backlash[Axis::Focus]->low, 199.0);
  EXPECT_TRUE(read->backlash[Axis::Focus]->measured);
  EXPECT_EQ(read->temperature->coldest.value, -10.0);
  EXPECT_NEAR(read->zoom->points[0].centre_shift->value, 21e-3, 1e-15);
  ASSERT_EQ(read->focus_at->samples.size(), 2u);
  EXPECT_EQ(read->focus_at->coordinates, all.focus_at->coordinates);
  EXPECT_EQ(read->focus_at->samples[0].at, all.focus_at->samples[0].at);
  EXPECT_NEAR(read->focus_at->samples[0].under.wavelength->value, 550e-9, 1e-18);
  EXPECT_FALSE(read->focus_at->samples[0].under.approach_up);
  EXPECT_FALSE(read->focus_at->samples[1].under.zoom);
}

TEST(CalibrationFile, SaysWhereItIsWrong) {
  const std::string head = "version = 1\nserial = \"\"\n";
  const std::string focus = head + "[[focus]]\napproach = \"near\"\nerror_um = 1\n";
  const std::pair<std::string, std::string> wrong[] = {
      {"serial = \"\"\n", "lens.toml:1: the calibration version the file must say version = 1"},
      {"version = 2\nserial = \"\"\n",
       "lens.toml:1: the calibration version must be 1: this lensd reads version 1 alone"},
      {"version = 1\n", "serial is missing"},
      {head + "colour = 1\n", "lens.toml:3: unknown key \"colour\""},
      {head + "[[focus]]\nerror_um = 1\npoints = []\n", "approach is missing"},
      {head + "[zoom]\npoints = [{ steps = 0, focal_length_mm = 8, centre_shift_mm = 0 },\n{ steps = 9, "
              "focal_length_mm = 9 }]\n",
       "lens.toml:5: a point of [zoom] centre_shift_mm must be in all points"},
      {focus + "points = [{ steps = 0, extension_mm = 0 }]\n", "two or more"},
      {focus + "points = [{ steps = 0, extension_mm = 0 }, { steps = 9 }]\n", "exactly one of"},
      {focus + "points = [{ steps = 0, extension_mm = 0 },\n{ steps = 0, extension_mm = 1 }]\n",
       "lens.toml:7: steps must rise"},
      {focus + "points = [{ steps = 0, extension_mm = 0, colour = 1 }, { steps = 9, extension_mm = 1 }]\n", "colour"},
      {focus + "points = [{ steps = 0, extension_mm = 0 }, { steps = 9, extension_mm = 1 }]\n" +
           focus.substr(head.size()) + "points = [{ steps = 0, extension_mm = 0 }, { steps = 9, extension_mm = 1 }]\n",
       "lens.toml:7: there is another [[focus]]"},
      {head + "[iris]\npoints = [{ steps = 0, f_number = 2 }, { steps = 9, f_number = 2 }]\n", "rise or fall"},
      {head + "[backlash.focus]\nsteps = 5\ninterval = [6, 7]\n", "must contain steps"},
      {head + "[temperature]\nreference_c = 20\n", "um_per_c is missing"},
  };
  for (const auto& [text, message] : wrong) {
    const auto read = Read(text);
    ASSERT_FALSE(read) << text;
    EXPECT_EQ(read.error().code, Code::BadData);
    EXPECT_NE(read.error().message.find(message), std::string::npos) << read.error().message << "\nfor\n" << text;
  }
}

}  // namespace
}  // namespace lensd::rig
