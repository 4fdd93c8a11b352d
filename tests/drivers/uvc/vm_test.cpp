// Inside the virtual machine: the driver through libusb on the simulated camera in the kernel's own USB stack, with the
// kernel's uvcvideo contending for it. Order and state are asserted, never time.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <map>
#include <random>

#include "discovery.h"
#include "drivers/uvc/driver.h"
#include "grating_scene.h"
#include "open_files.h"
#include "resident_memory.h"
#include "rig/rig.h"
#include "sim/devices/uvc_camera.h"
#include "stand.h"
#include "test_level.h"

namespace lensd::drivers::uvc {
namespace {

using sim::devices::StreamFaults;
using sim::devices::UvcCamera;
using sim::devices::UvcFaults;
using sim::devices::UvcModel;
using sim::devices::UvcOptions;

constexpr auto kPatience = std::chrono::seconds(30);

const MonotonicClock& Now() {
  static const MonotonicClock clock;
  return clock;
}

/// A wall before a lens whose whole travel takes a quarter of a second; pictures of 64 x 48.
std::shared_ptr<const sim::Scene> TheScene() {
  sim::Scene scene = testing::GratingScene(64, 48, 4096);
  scene.camera.frame_rate_hz = 20;
  return std::make_shared<const sim::Scene>(std::move(scene));
}

bool Eventually(const std::function<bool()>& done) {
  for (const auto limit = std::chrono::steady_clock::now() + kPatience; std::chrono::steady_clock::now() < limit;) {
    if (done()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return done();
}

int VideoNodes() {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator("/dev")) {
    if (entry.path().filename().string().starts_with("video")) ++count;
  }
  return count;
}

bool Present(const std::string& serial) {
  const auto all = ListCameras();
  return all && std::ranges::any_of(*all, [&](const UsbCamera& one) { return one.node.serial == serial; });
}

/// As a [[lens]] section would have it. The guest is slow: answers get more time.
Settings SettingsOf(const std::string& serial, std::map<std::string, Settings::Value> more = {}) {
  Settings::Table table;
  more.emplace("serial", serial);
  more.emplace("timeout_ms", std::int64_t{3000});
  for (auto& [key, value] : more) table.emplace(key, Settings(std::move(value), {"test", 1}));
  return Settings(Settings::Value(std::in_place_type<Settings::Table>, std::move(table)), {"test", 1});
}

/// One simulated camera of each kind for all tests: plugging in takes a while.
UvcCamera& CameraOf(const UvcOptions& options) {
  const Clock& clock = Now();  // made first, so that it is there when the cameras go
  static std::map<std::string, std::unique_ptr<UvcCamera>> cameras;
  auto& camera = cameras[options.serial];
  if (!camera) camera = UvcCamera::Create(TheScene(), clock, options).value();
  return *camera;
}

Result<void> PlugIn(const UvcOptions& options) {
  if (auto plugged = CameraOf(options).Plug(); !plugged) return plugged;
  CameraOf(options).SetFaults(UvcFaults{});
  CameraOf(options).SetFaults(StreamFaults{});
  if (!Eventually([&] { return Present(options.serial); })) return Fail(Code::Timeout, "the kernel does not see it");
  return {};
}

class UsbStand : public contract::RealStand {
 public:
  UsbStand(UvcOptions options, std::map<std::string, Settings::Value> keys)
      : options_(std::move(options)), settings_(SettingsOf(options_.serial, std::move(keys))) {}
  ~UsbStand() override {
    if (unplugged_) Plug();
  }
  Result<Device> Open() override {
    if (!unplugged_) {
      if (auto plugged = PlugIn(options_); !plugged) return PassOn(plugged);
    }
    return OpenUvc(settings_, clock());
  }
  bool Unplug() override {
    unplugged_ = true;
    CameraOf(options_).Unplug();
    return Eventually([&] { return !Present(options_.serial); });
  }
  void Plug() override { unplugged_ = !PlugIn(options_).has_value(); }
  Duration LookEvery() const override { return std::chrono::milliseconds(20); }

 private:
  const UvcOptions options_;
  const Settings settings_;
  bool unplugged_ = false;
};

const UvcOptions kBulk{.serial = "BULK"};
const UvcOptions kIsochronous{.serial = "ISO", .isochronous = true};
const UvcOptions kAsynchronous{.serial = "ASYNC", .asynchronous = true, .echo = true};

struct BulkYuyvStand : UsbStand {
  BulkYuyvStand() : UsbStand(kBulk, {{"feedback", std::string("counts")}, {"format", std::string("yuyv")}}) {}
};
struct IsochronousMjpegStand : UsbStand {
  IsochronousMjpegStand()
      : UsbStand(kIsochronous, {{"feedback", std::string("counts")}, {"format", std::string("mjpeg")}}) {}
};

class UvcBench : public ::testing::Test {
 protected:
  void Open(const UvcOptions& options, std::map<std::string, Settings::Value> keys = {}) {
    const auto plugged = PlugIn(options);
    ASSERT_TRUE(plugged.has_value()) << plugged.error().message;
    auto opened = OpenUvc(SettingsOf(options.serial, std::move(keys)), Now());
    ASSERT_TRUE(opened.has_value()) << opened.error().message;
    device_ = *std::move(opened);
    camera_ = &CameraOf(options);
  }
  bool ArrivesAt(double target) {
    return Eventually([&] {
      const auto state = device_.lens->Read();
      return state && !state->axes[Axis::Focus]->moving && state->axes[Axis::Focus]->position.value == target;
    });
  }
  std::optional<Frame> Next() {
    std::optional<Frame> next;
    Eventually([&] {
      auto frame = device_.camera->Poll();
      if (!frame) ADD_FAILURE() << frame.error().message;
      if (!frame || *frame) next = frame ? *frame : Frame{};
      return next.has_value();
    });
    return next;
  }

  Device device_;
  UvcCamera* camera_ = nullptr;
};

TEST_F(UvcBench, TheKernelLosesTheCameraAndGetsItBack) {
  ASSERT_TRUE(PlugIn(kBulk).has_value());
  ASSERT_TRUE(Eventually([] { return VideoNodes() > 0; })) << "uvcvideo does not bind";
  const int before = VideoNodes();
  Open(kBulk);
  EXPECT_LT(VideoNodes(), before);
  const auto second = OpenUvc(SettingsOf("BULK"), Now());
  EXPECT_EQ(CodeOf(second), Code::Busy);
  device_ = {};
  EXPECT_TRUE(Eventually([&] { return VideoNodes() == before; })) << "uvcvideo does not bind again";
}

TEST_F(UvcBench, ProbingFindsItWithoutTouchingIt) {
  ASSERT_TRUE(PlugIn(kBulk).has_value());
  ASSERT_TRUE(Eventually([] { return VideoNodes() > 0; }));
  const int nodes = VideoNodes();
  const auto found = ProbeUvc();
  ASSERT_TRUE(found.has_value()) << found.error().message;
  const auto one = std::ranges::find(*found, "BULK", &FoundDevice::serial);
  ASSERT_NE(one, found->end());
  EXPECT_TRUE(one->lens);
  EXPECT_TRUE(one->camera);
  EXPECT_EQ(one->config, "serial = \"BULK\"\n");
  EXPECT_EQ(one->problem, "");
  EXPECT_EQ(VideoNodes(), nodes);
}

TEST_F(UvcBench, AutomaticsAreOffWhileOpenAndRestored) {
  Open(kBulk);
  const auto automatics = [&] {
    bool on = false;
    camera_->Look([&](UvcModel& model) { on = model.auto_focus() && model.ae_mode() == 2; });
    return on;
  };
  EXPECT_FALSE(automatics());
  device_ = {};
  EXPECT_TRUE(automatics());
}

TEST_F(UvcBench, EveryFaultIsNamedAndLeftBehind) {
  Open(kBulk, {{"feedback", std::string("counts")}, {"timeout_ms", std::int64_t{400}}});
  const auto move = [&](double target) { return CodeOf(device_.lens->StartMove(Axis::Focus, Native{target})); };
  ASSERT_EQ(move(100), std::nullopt);
  ASSERT_TRUE(ArrivesAt(100));
  const std::pair<std::uint8_t, Code> stalls[] = {
      {1, Code::Busy}, {4, Code::OutOfRange}, {6, Code::Unsupported}, {0xFF, Code::Protocol}};
  for (const auto& [error, code] : stalls) {
    camera_->SetFaults(UvcFaults{.stall = 1, .error = error});
    EXPECT_EQ(move(200), code) << int{error};
  }
  camera_->SetFaults(UvcFaults{.lose = 1});
  EXPECT_EQ(CodeOf(device_.lens->Read()), Code::Timeout);
  camera_->SetFaults(UvcFaults{.late = 1, .delay = std::chrono::seconds(1)});
  EXPECT_EQ(move(300), Code::Timeout) << "obeyed, but late";
  EXPECT_TRUE(ArrivesAt(300));
  std::this_thread::sleep_for(std::chrono::seconds(1));  // whatever is late may come now
  camera_->SetFaults(UvcFaults{.shorten = 1});
  EXPECT_EQ(CodeOf(device_.lens->Read()), Code::Protocol);
  camera_->SetFaults(UvcFaults{.ignore = 1});
  EXPECT_EQ(move(400), std::nullopt);
  EXPECT_TRUE(Eventually([&] { return !device_.lens->Read()->axes[Axis::Focus]->moving; }));
  EXPECT_EQ(device_.lens->Read()->axes[Axis::Focus]->position, Native{300.0}) << "acknowledged and not obeyed";
  ASSERT_EQ(move(400), std::nullopt);
  EXPECT_TRUE(ArrivesAt(400));
}

TEST_F(UvcBench, AutomaticFocusThatComesOnIsSwitchedOffAgain) {
  Open(kBulk, {{"feedback", std::string("counts")}});
  camera_->Look([](UvcModel& model) { model.Reset(); });
  const auto moved = device_.lens->StartMove(Axis::Focus, Native{321.0});
  EXPECT_TRUE(moved.has_value()) << moved.error().message;
  EXPECT_TRUE(ArrivesAt(321));
}

TEST_F(UvcBench, AsynchronousMovesEndWithTheirEvent) {
  Open(kAsynchronous, {{"use", std::string("lens")}});
  ASSERT_TRUE(device_.lens->StartMove(Axis::Focus, Native{1000.0}).has_value());
  // It reads back 1000 at once; only the event says that it is there.
  EXPECT_TRUE(device_.lens->Read()->axes[Axis::Focus]->moving);
  ASSERT_TRUE(ArrivesAt(1000));
  EXPECT_NEAR(camera_->truth()->Now().focus_steps, 1000.0, 1.0);
}

TEST_F(UvcBench, RelativeFocusHomesAndMoves) {
  const UvcOptions relative{.serial = "REL", .relative_only = true};
  Open(relative, {{"use", std::string("lens")}, {"focus_travel_ms", std::int64_t{600}}});
  ASSERT_TRUE(device_.lens->StartHome(Axis::Focus).has_value());
  ASSERT_TRUE(Eventually([&] { return device_.lens->Read()->axes[Axis::Focus]->homed; }));
  EXPECT_NEAR(camera_->truth()->Now().focus_steps, 0.0, 1.0);
  ASSERT_TRUE(device_.lens->StartMove(Axis::Focus, Native{300.0}).has_value());
  ASSERT_TRUE(Eventually([&] { return !device_.lens->Read()->axes[Axis::Focus]->moving; }));
  EXPECT_GT(camera_->truth()->Now().focus_steps, 100.0);
  device_ = {};
  CameraOf(relative).Unplug();
}

TEST_F(UvcBench, DamagedPicturesAreDroppedWhole) {
  for (const UvcOptions& options : {kBulk, kIsochronous}) {
    Open(options, {{"format", std::string("yuyv")}});
    ASSERT_TRUE(device_.camera->Start().has_value());
    auto last = Next();
    ASSERT_TRUE(last && last->samples);
    for (const StreamFaults& fault :
         {StreamFaults{.flagged = 1}, StreamFaults{.dropped = 1}, StreamFaults{.garbled = 1}}) {
      camera_->SetFaults(fault);
      const auto frame = Next();
      ASSERT_TRUE(frame && frame->samples);
      EXPECT_EQ(frame->samples->size(), last->samples->size());
      EXPECT_GT(frame->sequence, last->sequence);
      last = frame;
    }
    device_ = {};
  }
}

/// Moves with random faults through the real stack, with the rig on top.
using UvcMoves = UvcBench;
TEST_F(UvcMoves, WithFaultsNeverLie) {
  Open(kBulk, {{"feedback", std::string("counts")},
               {"use", std::string("lens")},
               {"timeout_ms", std::int64_t{150}},
               {"command_interval_ms", std::int64_t{5}}});
  auto made = rig::Rig::Create({}, std::move(device_), Now());
  ASSERT_TRUE(made.has_value()) << made.error().message;
  rig::Rig& rig = **made;
  std::mt19937 random(11);
  const auto uniform = [&] { return std::uniform_real_distribution<double>(0, 1)(random); };
  const long moves = testing::ByLevel(60, 100, 300);
  int reached = 0, not_reached = 0, failed = 0, lies = 0;
  int open_files = 0;
  long resident = 0;
  for (long i = 0; i < moves; ++i) {
    if (i == moves / 4) {
      open_files = testing::OpenFiles();
      resident = testing::ResidentKilobytes();
    }
    UvcFaults faults;
    const int which = static_cast<int>(uniform() * 30);
    if (which == 0)
      faults = {.stall = 1 + static_cast<int>(uniform() * 4), .error = static_cast<std::uint8_t>(uniform() * 9)};
    if (which == 1 && uniform() < 0.5) faults.ignore = 1;  // each costs the time of a stall
    if (which == 2) faults.lose = 1 + static_cast<int>(uniform() * 3);
    if (which == 3) faults = {.late = 1, .delay = std::chrono::milliseconds(static_cast<int>(uniform() * 400))};
    if (which == 4) faults.shorten = 1;
    camera_->SetFaults(faults);
    // Short ones: the point is the conversation, not the travel.
    const double target = std::floor(400 + uniform() * 60);
    std::optional<Result<rig::MoveOutcome>> end;
    bool there = false;
    rig.Move(Axis::Focus, {.kind = rig::Target::Kind::Native, .value = target, .from = {}},
             [&](Result<rig::MoveOutcome> outcome) {
               end = std::move(outcome);
               there = std::abs(camera_->truth()->Now().focus_steps - target) <= 1.0;  // then, not later
             });
    for (const auto limit = std::chrono::steady_clock::now() + kPatience;
         !end && std::chrono::steady_clock::now() < limit;) {
      std::this_thread::sleep_until(std::min(rig.Step(Now().Now()), Now().Now() + std::chrono::milliseconds(5)));
    }
    ASSERT_TRUE(end) << "the move to " << target << " never ended";
    if (!*end) {
      ++failed;
    } else if ((*end)->reached) {
      ++reached;
      lies += there ? 0 : 1;
    } else {
      ++not_reached;
    }
  }
  std::printf("%ld moves: %d reached, %d not reached, %d failed with an error\n", moves, reached, not_reached, failed);
  EXPECT_EQ(lies, 0) << "moves reported reached that were not";
  EXPECT_GT(reached, moves / 2);
  EXPECT_GT(not_reached + failed, 0) << "no fault was ever noticed";
  EXPECT_EQ(testing::OpenFiles(), open_files);
  EXPECT_LT(testing::ResidentKilobytes() - resident, 4096);
}

}  // namespace

INSTANTIATE_TEST_SUITE_P(UvcUsb, LensContract, contract::Stands<BulkYuyvStand>());
INSTANTIATE_TEST_SUITE_P(UvcUsbBulkYuyv, CameraContract, contract::Stands<BulkYuyvStand>());
INSTANTIATE_TEST_SUITE_P(UvcUsbIsochronousMjpeg, CameraContract, contract::Stands<IsochronousMjpegStand>());

}  // namespace lensd::drivers::uvc
