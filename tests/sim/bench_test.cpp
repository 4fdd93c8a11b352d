// A world as a bench: the truth at any instant, faults while it runs, pictures without noise.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "stage.h"

namespace lensd::sim {
namespace {

using drivers::Axis;
using std::chrono::milliseconds;

drivers::SimulatedFault FaultFor(const char* kind, int ms) {
  drivers::SimulatedFault fault{.kind = kind, .axis = {}, .lasts = {}, .steps = {}, .factor = {}};
  if (ms > 0) fault.lasts = milliseconds(ms);
  return fault;
}

struct Bench {
  explicit Bench(const Scene& scene = SmallScene()) : stage(scene) {}
  drivers::Simulation& simulation() { return *stage.world.device.simulation; }
  void Inject(const drivers::SimulatedFault& fault) {
    const auto injected = simulation().Inject(fault);
    ASSERT_TRUE(injected.has_value()) << injected.error().message;
  }
  void MoveFocus(double target) { ASSERT_TRUE(stage.lens().StartMove(Axis::Focus, Native{target}).has_value()); }
  double Focus() { return simulation().TruthAt({}, {})->positions[Axis::Focus]->value; }
  bool Complains() { return !stage.lens().Read()->axes[Axis::Focus]->fault.empty(); }
  Stage stage;
};

TEST(Bench, TellsTheTruthOfNowAndOfThen) {
  Bench bench;
  const Instant before = bench.stage.clock.Now();
  bench.MoveFocus(4000);
  bench.stage.Wait(2000);
  bench.Inject([] {
    auto jump = FaultFor("jump", 0);
    jump.steps = 250;
    return jump;
  }());
  bench.stage.Wait(10);
  EXPECT_NEAR(bench.Focus(), 4250.0, 1e-6);
  EXPECT_EQ(bench.stage.FocusCount(), 4000.0);
  EXPECT_EQ(bench.simulation().TruthAt(before, {})->positions[Axis::Focus]->value, 0.0);
  const auto truth = bench.simulation().TruthAt({}, 1.0);
  EXPECT_NEAR(truth->extension_m, 1.6e-3 * 4250.0 / 8191.0, 1e-12);
  // From similar triangles, for the wall at one dioptre.
  const double sensor_m = truth->focal_length_m + truth->extension_m;
  const double opening_m = truth->focal_length_m / truth->f_number;
  EXPECT_NEAR(*truth->blur_m, opening_m * (sensor_m * (1.0 / truth->focal_length_m - 1.0) - 1.0), 1e-12);
  EXPECT_FALSE(truth->positions[Axis::Zoom].has_value());
}

TEST(Bench, KnowsNeitherTheFutureNorWhatWasBefore) {
  Bench bench;
  const Instant now = bench.stage.clock.Now();
  EXPECT_EQ(bench.simulation().TruthAt(now + Duration(1), {}).error().code, Code::OutOfRange);
  EXPECT_EQ(bench.simulation().TruthAt(now - Duration(1), {}).error().code, Code::OutOfRange);
  EXPECT_EQ(bench.simulation().TruthAt(Instant(Duration::min()), {}).error().code, Code::OutOfRange);
  for (int i = 0; i < 2000; ++i) {
    bench.MoveFocus(i % 2 == 0 ? 10 : 0);
    bench.stage.Wait(5);
  }
  EXPECT_EQ(bench.simulation().TruthAt(now, {}).error().code, Code::OutOfRange);
  EXPECT_TRUE(bench.simulation().TruthAt(bench.stage.clock.Now() - milliseconds(500), {}).has_value());
}

TEST(Bench, AFaultTakesThePlaceOfItsKind) {
  Bench bench;
  bench.Inject(FaultFor("stall", 0));
  bench.stage.Wait(1);
  bench.MoveFocus(1000);
  bench.stage.Wait(1000);
  EXPECT_TRUE(bench.Complains());
  EXPECT_EQ(bench.Focus(), 0.0);
  bench.Inject(FaultFor("stall", 5));
  bench.stage.Wait(10);
  EXPECT_FALSE(bench.Complains());
  bench.MoveFocus(1000);
  bench.stage.Wait(1000);
  EXPECT_NEAR(bench.Focus(), 1000.0, 1e-6);
}

TEST(Bench, TheEndOfAFaultThatWasReplacedEndsNothing) {
  Bench bench;
  bench.Inject(FaultFor("stall", 100));
  bench.stage.Wait(50);
  bench.Inject(FaultFor("stall", 1000));
  bench.stage.Wait(100);
  bench.MoveFocus(1000);
  bench.stage.Wait(100);
  EXPECT_TRUE(bench.Complains());
}

TEST(Bench, DisconnectsAndReconnects) {
  Bench bench;
  for (int i = 0; i < 5000; ++i) {
    bench.Inject(FaultFor("disconnect", 0));
    bench.stage.Wait(1);
    ASSERT_EQ(bench.stage.lens().Read().error().code, Code::Disconnected);
    bench.Inject(FaultFor("reconnect", 0));
    bench.stage.Wait(1);
    ASSERT_TRUE(bench.stage.lens().Read().has_value());
  }
}

TEST(Bench, GetsWarmAndItsThermometerMayBeWrong) {
  Scene scene = SmallScene();
  scene.lens.drift_um_per_c = 2.0;
  Bench bench(scene);
  const auto warm = [&](const char* kind, double by_c) {
    auto fault = FaultFor(kind, 0);
    fault.by_c = by_c;
    bench.Inject(fault);
    bench.stage.Wait(1);
  };
  const auto extension = [&] { return bench.simulation().TruthAt({}, {})->extension_m; };
  const double cold = extension();
  warm("warmth", 7.0);
  EXPECT_NEAR(extension() - cold, 14e-6, 1e-12);
  EXPECT_EQ(bench.stage.lens().Read()->temperature, Celsius{27.0});
  warm("wrong-temperature", -3.0);
  EXPECT_NEAR(extension() - cold, 14e-6, 1e-12);
  EXPECT_EQ(bench.stage.lens().Read()->temperature, Celsius{24.0});
  const Instant then = bench.stage.clock.Now();
  bench.stage.Wait(10);
  warm("warmth", -1.0);  // in place of the one before
  EXPECT_NEAR(extension() - cold, -2e-6, 1e-12);
  EXPECT_NEAR(bench.simulation().TruthAt(then, {})->extension_m - cold, 14e-6, 1e-12);
  scene.lens.thermometer = false;
  EXPECT_FALSE(Bench(scene).stage.lens().Read()->temperature.has_value());
}

TEST(Bench, RefusesWhatNoSceneCouldSay) {
  Bench bench;
  EXPECT_EQ(bench.simulation().Inject(FaultFor("sulk", 0)).error().code, Code::InvalidArgument);
  auto zoom = FaultFor("stall", 0);
  zoom.axis = Axis::Zoom;
  EXPECT_EQ(bench.simulation().Inject(zoom).error().code, Code::Unsupported);
  auto all = FaultFor("missed-steps", 0);
  all.factor = 1.5;
  EXPECT_EQ(bench.simulation().Inject(all).error().code, Code::InvalidArgument);
  auto warm = FaultFor("warmth", 0);
  warm.by_c = 1001.0;
  EXPECT_EQ(bench.simulation().Inject(warm).error().code, Code::InvalidArgument);
  all.by_c = 1.0;
  all.factor.reset();
  EXPECT_EQ(bench.simulation().Inject(all).error().code, Code::InvalidArgument);
  all.by_c.reset();
  all.factor = std::nan("");
  EXPECT_EQ(bench.simulation().Inject(all).error().code, Code::InvalidArgument);
}

TEST(Bench, RendersWithoutNoise) {
  Scene scene = SmallScene();
  scene.camera.full_well_e = 1000.0;
  scene.camera.read_noise_e = 20.0;
  scene.camera.bits = 16;
  Bench bench(scene);
  bench.stage.Wait(100);
  const auto frame = bench.simulation().Render({});
  ASSERT_TRUE(frame.has_value());
  const auto [least, most] = std::ranges::minmax(*frame->samples);
  EXPECT_EQ(least, most);  // one light everywhere
  // 0.9 of full well for white, half of that; the working f-number is the nominal one at extension 0.
  EXPECT_NEAR(least, 0.45 * 65535.0, 2.0);
  ASSERT_TRUE(bench.stage.camera().SetExposure(milliseconds(5)).has_value());
  EXPECT_NEAR(bench.simulation().Render({})->samples->front(), 0.225 * 65535.0, 2.0);
}

}  // namespace
}  // namespace lensd::sim
