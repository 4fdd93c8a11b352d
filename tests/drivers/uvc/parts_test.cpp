// One bad part costs that part: the tables of tests/drivers/one-bad-part, and tables that are drawn with defects on
// random parts. Which parts are healthy is known from the draw.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "assemble.h"
#include "test_level.h"
#include "transport.h"

namespace lensd::drivers::uvc {
namespace {

using Fate = Reply::Outcome;
using ::testing::HasSubstr;

/// What a request of one control answers: a number of the control's length, or an outcome.
struct TableAnswer {
  std::uint32_t value = 0;
  Fate outcome = Fate::Done;
  int times = -1;       ///< how often the outcome comes before the value does; below 0: always
  int wrong_bytes = 0;  ///< so many more than were asked for
};

struct TableControl {
  std::uint16_t length = 2;
  std::map<std::uint8_t, TableAnswer> answers;  ///< by request; the current value is kGetCur's
  Fate set = Fate::Done;
};

/// A camera of one terminal (1) and one processing unit (2), by their tables.
class TableTransport final : public Transport {
 public:
  explicit TableTransport(SteppedClock& clock) : clock_(clock) {}
  std::map<std::pair<std::uint8_t, std::uint8_t>, TableControl> controls;  ///< by entity and selector

  Reply Control(const Setup& setup, std::span<const std::uint8_t> out, Duration) override {
    const auto entity = static_cast<std::uint8_t>(setup.index >> 8),
               selector = static_cast<std::uint8_t>(setup.value >> 8);
    if (entity == 0) return {Fate::Done, {6}};  // why it refused: there is no such control
    const auto found = controls.find({entity, selector});
    if (found == controls.end()) return {Fate::Stalled, {}};
    TableControl& control = found->second;
    if (!setup.in()) {
      if (control.set == Fate::Done) control.answers[kGetCur] = {FromLittle(out)};
      return {control.set, {}};
    }
    const auto answer = control.answers.find(setup.request);
    if (answer == control.answers.end()) return {Fate::Stalled, {}};
    if (answer->second.outcome != Fate::Done && answer->second.times != 0) {
      if (answer->second.times > 0) --answer->second.times;
      return {answer->second.outcome, {}};
    }
    const std::size_t length = setup.request == kGetInfo ? 1 : control.length;
    return {Fate::Done, ToLittle(answer->second.value, length + static_cast<std::size_t>(answer->second.wrong_bytes))};
  }
  void WaitUntil(Instant until) override { clock_.AdvanceTo(until); }
  std::vector<std::vector<std::uint8_t>> TakeStatus() override { return {}; }
  Result<void> StartStream(const StreamPipe&, PayloadSink&) override { return {}; }
  void StopStream() override {}
  bool Gone() const override { return false; }
  void BeginCall() override {}
  void Interrupt() override {}

 private:
  SteppedClock& clock_;
};

struct TableCamera {
  SteppedClock clock;
  std::shared_ptr<TableTransport> wire = std::make_shared<TableTransport>(clock);
  std::uint32_t bits = 0;
  bool gain = false;
  bool readable_pictures = true;

  /// Lines of a .uvc file: BIT SELECTOR LENGTH INFO MIN MAX RES CUR, "-" where the request is refused.
  void ReadTable(const std::string& path) {
    std::ifstream file(path);
    for (std::string line; std::getline(file, line);) {
      std::istringstream words(line);
      int bit = 0;
      std::string selector, word;
      TableControl control;
      if (!(words >> bit >> selector >> control.length)) continue;
      for (const std::uint8_t request : {kGetInfo, kGetMin, kGetMax, kGetRes, kGetCur}) {
        words >> word;
        if (word != "-") control.answers[request] = {static_cast<std::uint32_t>(std::stoul(word, nullptr, 0))};
      }
      bits |= 1u << bit;
      wire->controls[{1, static_cast<std::uint8_t>(std::stoul(selector, nullptr, 0))}] = control;
    }
  }
  TableControl& at(const UnitControl& control) {
    bits |= 1u << control.bit;
    return wire->controls[{1, control.selector}];
  }
  std::uint32_t now(const UnitControl& control) { return wire->controls[{1, control.selector}].answers[kGetCur].value; }

  Result<Device> Open(const UvcConfig& config = {}) {
    VideoFunction function;
    function.version = 0x0110;
    if (gain) function.units = {{2, 1, 1u << 9}};
    StreamInterface stream;
    stream.number = 1;
    if (readable_pictures) stream.formats = {{1, PixelFormat::Yuyv, 1, 0, {{1, 64, 48, 333333, {333333}, false}}}};
    function.streams = {stream};
    return MakeDevice(std::make_shared<Session>(wire, clock, function, CameraTerminal{1, bits},
                                                Identity{"webcam", "A1"}, ControlOptions{}),
                      config);
  }
};

struct Case {
  const char* table;
  const char* left_out;  ///< "": a part that is not the focus costs nothing
};
class OneBadPart : public ::testing::TestWithParam<Case> {};

TEST_P(OneBadPart, FocusWorks) {
  TableCamera camera;
  camera.ReadTable(std::string(PARTS_FOLDER "/") + GetParam().table);
  ASSERT_GE(camera.wire->controls.size(), 2u);
  const auto device = camera.Open();
  ASSERT_TRUE(device.has_value()) << device.error().message;
  ASSERT_NE(device->lens, nullptr);
  ASSERT_TRUE(device->lens->StartMove(Axis::Focus, Native{100.0}).has_value());
  EXPECT_EQ(camera.now(kFocusAbsolute), 100u);
  EXPECT_TRUE(device->lens->Read().has_value());
  const std::string part = GetParam().left_out;
  EXPECT_EQ(device->findings.left_out().size(), part.empty() ? 0u : 1u);
  EXPECT_EQ(device->findings.doubts().size(), part.empty() ? 1u : 0u);
  EXPECT_EQ(device->findings.Of(part) != nullptr, !part.empty());
}

INSTANTIATE_TEST_SUITE_P(Uvc, OneBadPart,
                         ::testing::Values(Case{"autofocus-refuses.uvc", ""}, Case{"exposure-mode-refuses.uvc", ""},
                                           Case{"zoom-fixed.uvc", "zoom"}));

TEST(UvcParts, PicturesThatCannotBeReadLeaveTheLens) {
  TableCamera camera;
  camera.ReadTable(PARTS_FOLDER "/zoom-fixed.uvc");
  camera.readable_pictures = false;
  const auto device = camera.Open();
  ASSERT_TRUE(device.has_value()) << device.error().message;
  EXPECT_EQ(device->camera, nullptr);
  ASSERT_NE(device->findings.Of("camera"), nullptr);
  EXPECT_THAT(device->findings.Of("camera")->reason, HasSubstr("no picture format of this camera can be read"));
  UvcConfig asks;
  asks.camera_config.format = PixelFormat::Yuyv;
  EXPECT_FALSE(camera.Open(asks).has_value());
}

// ---- drawn --------------------------------------------------------------------------------------------------------

enum class Health { Absent, Healthy, Ill };

struct Part {
  const char* name;
  UnitControl control;
  std::optional<Axis> axis{};
  Health health = Health::Absent;
  std::string defect{};
};

class Draw {
 public:
  explicit Draw(unsigned seed) : random_(seed) {}

  int Below(int count) { return static_cast<int>(random_() % static_cast<unsigned>(count)); }
  std::uint32_t Number(int below) { return static_cast<std::uint32_t>(Below(below)); }
  Fate Trouble() {
    constexpr std::array kTroubles = {Fate::Stalled, Fate::TimedOut, Fate::Failed};
    return kTroubles[static_cast<std::size_t>(Below(3))];
  }

  TableControl Healthy(std::uint16_t length) {
    TableControl control;
    control.length = length;
    const std::uint32_t low = Number(500), high = low + 10 + Number(1000);
    control.answers[kGetInfo] = {3};
    control.answers[kGetMin] = {low};
    control.answers[kGetMax] = {high};
    control.answers[kGetRes] = {Number(10)};  // 0 reads as 1
    control.answers[kGetCur] = {low + Number(static_cast<int>(high - low) + 1)};
    const int odd = Below(6);
    if (odd == 0) control.answers[kGetCur] = {high + 1 + Number(100)};  // it stands outside its own range
    if (odd == 1) control.answers.erase(kGetInfo);
    if (odd == 2) control.answers.erase(kGetRes);
    if (odd == 3) {  // asked once more it answers
      TableAnswer& answer = control.answers[Below(2) == 0 ? kGetMin : kGetCur];
      answer.outcome = Fate::Failed;
      answer.times = 1;
    }
    return control;
  }

  TableControl Ill(std::uint16_t length, std::string& defect) {
    TableControl control = Healthy(length);
    for (auto& [request, answer] : control.answers) answer = {answer.value};
    auto& answers = control.answers;
    const std::uint8_t one = std::array{kGetMin, kGetMax, kGetCur}[static_cast<std::size_t>(Below(3))];
    switch (Below(7)) {
      case 0:
        defect = "reversed";
        std::swap(answers[kGetMin], answers[kGetMax]);
        break;
      case 1:
        defect = "fixed";
        answers[kGetMax] = answers[kGetMin];
        break;
      case 2:
        defect = "step larger than the range";
        answers[kGetRes] = {answers[kGetMax].value - answers[kGetMin].value + 1 + Number(1000)};
        break;
      case 3:
        defect = "a question that is not answered";
        answers[one].outcome = Trouble();
        break;
      case 4:
        defect = "an answer of another length";
        answers[one].wrong_bytes = 1;
        break;
      case 5:
        defect = "no answer at all";
        for (auto& [request, answer] : answers) answer.outcome = Fate::Stalled;
        break;
      default:
        defect = "cannot be set";
        answers[kGetInfo] = {1};
    }
    return control;
  }

  Health health() {
    const int of_ten = Below(10);
    return of_ten < 3 ? Health::Absent : of_ten < 6 ? Health::Healthy : Health::Ill;
  }

  /// An automatism that is there, refuses to say how it is set, or refuses to be set.
  void Automatism(TableCamera& camera, const UnitControl& control, std::uint32_t modes) {
    const int kind = Below(4);
    if (kind == 0) return;
    TableControl& automatic = camera.at(control);
    automatic.length = 1;
    automatic.answers[kGetCur] = {modes == 0 ? Number(2) : 1u << Below(4)};
    automatic.answers[kGetRes] = {modes};
    if (kind == 1) automatic.answers[kGetCur].outcome = Trouble();
    if (kind == 2) automatic.set = Trouble();
  }

 private:
  std::mt19937 random_;
};

void Drive(const Device& device, const Part& part, TableCamera& camera, Draw& draw) {
  ASSERT_NE(device.lens, nullptr);
  const auto& can = device.lens->capabilities().axes[*part.axis];
  ASSERT_TRUE(can.has_value());
  auto& answers = camera.wire->controls[{1, part.control.selector}].answers;
  const std::uint32_t low = answers[kGetMin].value, high = answers[kGetMax].value;
  const std::uint32_t step = answers.contains(kGetRes) ? std::max(1u, answers[kGetRes].value) : 1;
  const std::uint32_t target = low + draw.Number(static_cast<int>((high - low) / step)) * step;
  const double unit = *part.axis == Axis::Iris ? 0.01 : 1.0;
  ASSERT_TRUE(device.lens->StartMove(*part.axis, Native{target * unit}).has_value());
  EXPECT_EQ(camera.now(part.control), target);
  const auto state = device.lens->Read();
  ASSERT_TRUE(state.has_value()) << state.error().message;
  ASSERT_TRUE(state->axes[*part.axis].has_value());
  EXPECT_EQ(state->axes[*part.axis]->position, Native{target * unit});
}

void CheckPart(const Device& device, const Part& part) {
  const LeftOut* left_out = device.findings.Of(part.name);
  EXPECT_EQ(left_out != nullptr, part.health == Health::Ill) << (left_out != nullptr ? left_out->reason : "");
  EXPECT_TRUE(left_out == nullptr || !left_out->reason.empty());
  if (part.axis && device.lens) {
    EXPECT_EQ(device.lens->capabilities().axes[*part.axis].has_value(), part.health == Health::Healthy);
  }
}

void PlayOne(unsigned seed) {
  Draw draw(seed);
  TableCamera camera;
  std::vector<Part> parts = {
      {"focus", kFocusAbsolute, Axis::Focus}, {"iris", kIrisAbsolute, Axis::Iris}, {"zoom", kZoomAbsolute, Axis::Zoom}};
  Part exposure{"exposure", kExposureAbsolute}, gain{"gain", kGain}, pictures{"camera", {}};
  std::string drawn;
  const auto draw_control = [&](Part& part) {
    part.health = draw.health();
    drawn += std::string(" ") + part.name;
    if (part.health == Health::Absent) return;
    const bool healthy = part.health == Health::Healthy;
    TableControl control = healthy ? draw.Healthy(part.control.length) : draw.Ill(part.control.length, part.defect);
    drawn += "=" + (healthy ? "healthy" : part.defect);
    camera.gain = camera.gain || &part == &gain;
    if (&part != &gain) camera.bits |= 1u << part.control.bit;
    const std::uint8_t entity = &part == &gain ? 2 : 1;
    camera.wire->controls[{entity, part.control.selector}] = std::move(control);
  };
  for (Part& part : parts) draw_control(part);
  draw_control(exposure);
  draw_control(gain);
  camera.readable_pictures = draw.Below(2) == 0;
  pictures.health = camera.readable_pictures ? Health::Healthy : Health::Ill;
  draw.Automatism(camera, kFocusAuto, 0);
  draw.Automatism(camera, kAeMode, kAeManual | kAeAuto | kAeAperturePriority);
  SCOPED_TRACE("seed " + std::to_string(seed) + ":" + drawn + (camera.readable_pictures ? "" : " no pictures"));
  const auto device = camera.Open();
  const bool any_axis = std::ranges::count(parts, Health::Healthy, &Part::health) > 0;
  if (!any_axis && !camera.readable_pictures) {
    ASSERT_FALSE(device.has_value());
    for (const Part& part : parts) {
      EXPECT_THAT(device.error().message, HasSubstr(part.health == Health::Ill ? part.name : ""));
    }
    EXPECT_THAT(device.error().message, HasSubstr("camera ("));
    return;
  }
  ASSERT_TRUE(device.has_value()) << device.error().message;
  EXPECT_EQ(device->camera != nullptr, camera.readable_pictures);
  for (const Part& part : parts) {
    SCOPED_TRACE(part.name);
    CheckPart(*device, part);
    if (part.health == Health::Healthy) Drive(*device, part, camera, draw);
  }
  CheckPart(*device, pictures);
  if (!device->camera) {
    for (const Part& part : {exposure, gain}) {
      EXPECT_EQ(device->findings.Of(part.name) != nullptr, part.health != Health::Absent) << part.name;
    }
    return;
  }
  CheckPart(*device, exposure);
  CheckPart(*device, gain);
  EXPECT_EQ(device->camera->capabilities().can_set_exposure, exposure.health == Health::Healthy);
  EXPECT_EQ(device->camera->capabilities().gain.has_value(), gain.health == Health::Healthy);
  EXPECT_TRUE(device->camera->ReadExposure().has_value());
  if (gain.health == Health::Healthy) {
    auto& answers = camera.wire->controls[{2, kGain.selector}].answers;
    EXPECT_TRUE(device->camera->SetGain(answers[kGetMin].value).has_value());
    EXPECT_EQ(answers[kGetCur].value, answers[kGetMin].value);
  }
}

TEST(UvcParts, DrawnDefectsCostThePartsThatHaveThem) {
  const long count = testing::ByLevel(300, 3'000, 1'000'000);
  for (long i = 0; i < count && !::testing::Test::HasFailure(); ++i) PlayOne(static_cast<unsigned>(i));
}

}  // namespace
}  // namespace lensd::drivers::uvc
