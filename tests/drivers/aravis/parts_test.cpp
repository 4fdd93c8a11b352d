// One bad part costs that part: cameras whose descriptions have defects on random parts. Which parts are healthy is
// known from the draw.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "gige_stand.h"
#include "test_level.h"

namespace lensd {
namespace {

using drivers::Axis;
using ::testing::HasSubstr;

/// The element of that name, up to the end of its tag.
std::pair<std::size_t, std::size_t> Element(const std::string& text, const std::string& name) {
  const std::size_t named = text.find(" Name=\"" + name + "\"");
  EXPECT_NE(named, std::string::npos) << name;
  const std::size_t begin = text.rfind('<', named);
  const std::string tag = text.substr(begin + 1, named - begin - 1);
  return {begin, text.find("</" + tag + ">", named)};
}

/// What stands in a child of an element.
std::string Child(const std::string& text, const std::string& name, const std::string& child) {
  const auto [begin, end] = Element(text, name);
  const std::size_t from = text.find("<" + child + ">", begin) + child.size() + 2;
  EXPECT_LT(from, end) << name << " " << child;
  return text.substr(from, text.find('<', from) - from);
}

void SetChild(std::string& text, const std::string& name, const std::string& child, const std::string& value) {
  const auto [begin, end] = Element(text, name);
  const std::size_t open = text.find("<" + child + ">", begin);
  if (open == std::string::npos || open > end) {
    text.insert(end, "<" + child + ">" + value + "</" + child + ">");
    return;
  }
  const std::size_t from = open + child.size() + 2;
  text.replace(from, text.find('<', from) - from, value);
}

enum class Defect { None, Reversed, Fixed, StepTooLarge, Unreadable, NotWritable };

struct Part {
  const char* name;
  const char* feature;
  const char* converter;  ///< between the feature and its register; "": none
  const char* target;     ///< the register that is written
  Defect defect = Defect::None;
};

void Spoil(std::string& text, const Part& part) {
  const std::string low = Child(text, part.feature, "Min"), high = Child(text, part.feature, "Max");
  switch (part.defect) {
    case Defect::None:
      break;
    case Defect::Reversed:
      SetChild(text, part.feature, "Min", high);
      SetChild(text, part.feature, "Max", low);
      break;
    case Defect::Fixed:
      SetChild(text, part.feature, "Max", low);
      break;
    case Defect::StepTooLarge:
      SetChild(text, part.feature, "Inc", "100000000");
      break;
    case Defect::Unreadable:
      SetChild(text, part.converter, "FormulaFrom", "TO + (");
      break;
    case Defect::NotWritable:
      SetChild(text, part.target, "AccessMode", "RO");
  }
}

void PlayOne(unsigned seed) {
  std::mt19937 random(seed);
  const auto below = [&](int count) { return static_cast<int>(random() % static_cast<unsigned>(count)); };
  std::vector<Part> axes = {{"focus", "FocusStepper", "FocusConverter", "FocusTarget"},
                            {"iris", "Aperture", "IrisConverter", "IrisTarget"}};
  Part exposure{"exposure", "ExposureTime", "ExposureConverter", ""}, gain{"gain", "GainRaw", "", ""};
  for (Part& axis : axes) axis.defect = static_cast<Defect>(below(2) == 0 ? 0 : 1 + below(5));
  exposure.defect = std::array{Defect::None, Defect::Reversed, Defect::Fixed, Defect::Unreadable}[random() % 4];
  gain.defect = std::array{Defect::None, Defect::Reversed, Defect::Fixed}[random() % 3];
  const bool pictures = below(3) > 0;
  SCOPED_TRACE("seed " + std::to_string(seed) + ": focus " + std::to_string(static_cast<int>(axes[0].defect)) +
               " iris " + std::to_string(static_cast<int>(axes[1].defect)) + " exposure " +
               std::to_string(static_cast<int>(exposure.defect)) + " gain " +
               std::to_string(static_cast<int>(gain.defect)) + (pictures ? "" : ", no pictures"));
  sim::GigeOptions options;
  options.edit_description = [&](std::string text) {
    for (const Part& part : {axes[0], axes[1], exposure, gain}) Spoil(text, part);
    if (pictures) return text;
    // Formats that nobody knows, and the one that is set is none of those that are.
    SetChild(text, "PixelFormatRegister", "Address", "0x9100");
    const auto [begin, end] = Element(text, "PixelFormat");
    for (std::size_t at = text.find("<Value>", begin); at < end; at = text.find("<Value>", at + 1)) {
      const std::size_t from = at + 7;
      const std::size_t length = text.find('<', from) - from;
      text.replace(from, length, std::string(length - 1, '0') + std::to_string(1 + at % 9));
    }
    return text;
  };
  testing::GigeStand stand(options);
  const auto device = stand.Open();
  const bool any_axis = std::ranges::count(axes, Defect::None, &Part::defect) > 0;
  if (!any_axis && !pictures) {
    ASSERT_FALSE(device.has_value());
    for (const char* said : {"focus (", "iris (", "camera ("}) EXPECT_THAT(device.error().message, HasSubstr(said));
    return;
  }
  ASSERT_TRUE(device.has_value()) << device.error().message;
  const auto left_out = [&](const char* part) { return device->findings.Of(part) != nullptr; };
  for (const Part& part : axes) {
    SCOPED_TRACE(part.name);
    EXPECT_EQ(left_out(part.name), part.defect != Defect::None);
    const Axis axis = *drivers::AxisFromName(part.name);
    EXPECT_EQ(device->lens && device->lens->capabilities().axes[axis], part.defect == Defect::None);
    if (part.defect != Defect::None) continue;
    const auto& can = *device->lens->capabilities().axes[axis];
    EXPECT_TRUE(device->lens->StartMove(axis, Native{can.minimum.value + 10 * can.resolution}).has_value());
    const auto state = device->lens->Read();
    ASSERT_TRUE(state.has_value()) << state.error().message;
    EXPECT_TRUE(state->axes[axis].has_value());
  }
  EXPECT_EQ(left_out("camera"), !pictures);
  EXPECT_EQ(device->camera != nullptr, pictures);
  if (!device->camera) {
    EXPECT_TRUE(left_out("exposure") && left_out("gain")) << "the camera has both";
    return;
  }
  EXPECT_EQ(left_out("exposure"), exposure.defect != Defect::None);
  EXPECT_EQ(device->camera->capabilities().can_set_exposure, exposure.defect == Defect::None);
  EXPECT_EQ(left_out("gain"), gain.defect != Defect::None);
  EXPECT_EQ(device->camera->capabilities().gain.has_value(), gain.defect == Defect::None);
  EXPECT_TRUE(device->camera->Start().has_value());
}

TEST(AravisParts, DrawnDefectsCostThePartsThatHaveThem) {
  const long count = testing::ByLevel(5, 12, 2'000);
  for (long i = 0; i < count && !::testing::Test::HasFailure(); ++i) PlayOne(static_cast<unsigned>(i));
}

}  // namespace
}  // namespace lensd
