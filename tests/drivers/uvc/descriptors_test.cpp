// The descriptor walk (fact sheet uvc_camera_terminal, section 3).
#include "descriptors.h"

#include <gtest/gtest.h>

#include "discovery.h"
#include "scripted_transport.h"

namespace lensd::drivers::uvc {
namespace {

Bytes Join(std::initializer_list<const char*> parts) {
  Bytes all;
  for (const char* part : parts) {
    const Bytes bytes = FromHex(part);
    all.insert(all.end(), bytes.begin(), bytes.end());
  }
  return all;
}

constexpr auto kVc = "09 04 00 00 01 0E 01 00 00";
constexpr auto kHeader = "0D 24 01 10 01 00 00 00 00 00 00 01 01";
// The real camera of section 3: terminal 1, bmControls 0x00022A2E, focal lengths 0.
constexpr auto kTerminal = "12 24 02 01 01 02 00 00 00 00 00 00 00 00 03 2E 2A 02";
constexpr auto kStatus = "07 05 87 03 10 00 08";
constexpr auto kVs = "09 04 01 00 00 0E 02 00 00";
constexpr auto kYuyv = "1B 24 04 01 01 59 55 59 32 00 00 10 00 80 00 00 AA 00 38 9B 71 10 01 00 00 00 00";
constexpr auto kFrame640 =
    "22 24 05 01 00 80 02 E0 01 00 00 00 00 00 00 00 00 00 00 00 00 15 16 05 00 02 15 16 05 00 2A 2C 0A 00";
constexpr auto kColour = "06 24 0D 01 06 04";
constexpr auto kVsAlt2 = "09 04 01 02 01 0E 02 00 00";
constexpr auto kIso = "07 05 81 05 20 0B 01";  // 0x0B20: 800 bytes, twice a microframe

TEST(UvcDescriptors, Section3RealCamera) {
  const auto functions =
      ParseConfiguration(Join({kVc, kHeader, kTerminal, kStatus, kVs, kYuyv, kFrame640, kColour, kVsAlt2, kIso}));
  ASSERT_TRUE(functions.has_value()) << functions.error().message;
  ASSERT_EQ(functions->size(), 1u);
  const VideoFunction& function = functions->front();
  EXPECT_EQ(function.interface, 0);
  EXPECT_EQ(function.version, 0x0110);
  EXPECT_EQ(function.status_endpoint, 0x87);
  EXPECT_EQ(function.status_bytes, 16);
  ASSERT_EQ(function.terminals.size(), 1u);
  const CameraTerminal& terminal = function.terminals.front();
  EXPECT_EQ(terminal.id, 1);
  EXPECT_EQ(terminal.controls, 0x00022A2Eu);
  EXPECT_TRUE(terminal.Has(kAeMode.bit));
  EXPECT_TRUE(terminal.Has(kExposureAbsolute.bit));
  EXPECT_TRUE(terminal.Has(kFocusAbsolute.bit));
  EXPECT_TRUE(terminal.Has(kZoomAbsolute.bit));
  EXPECT_TRUE(terminal.Has(kFocusAuto.bit));
  EXPECT_FALSE(terminal.Has(kFocusRelative.bit));
  EXPECT_FALSE(terminal.Has(kIrisAbsolute.bit));
  EXPECT_TRUE(function.units.empty());
  ASSERT_EQ(function.streams.size(), 1u);
  const StreamInterface& stream = function.streams.front();
  ASSERT_EQ(stream.formats.size(), 1u);
  EXPECT_EQ(stream.formats[0].pixels, PixelFormat::Yuyv);
  EXPECT_EQ(stream.formats[0].transfer_characteristics, 6);
  ASSERT_EQ(stream.formats[0].frames.size(), 1u);
  EXPECT_EQ(stream.formats[0].frames[0].width, 640);
  EXPECT_EQ(stream.formats[0].frames[0].height, 480);
  EXPECT_EQ(stream.formats[0].frames[0].intervals, (std::vector<std::uint32_t>{333333, 666666}));
  ASSERT_EQ(stream.settings.size(), 1u);
  EXPECT_EQ(stream.settings[0].alternate, 2);
  EXPECT_TRUE(stream.settings[0].isochronous);
  EXPECT_EQ(stream.settings[0].packet_bytes, 1600u);
}

TEST(UvcDescriptors, TerminalBehindAnEndpointIsFound) {
  const auto functions = ParseConfiguration(Join({kVc, kHeader, kStatus, kTerminal}));
  ASSERT_TRUE(functions.has_value());
  ASSERT_EQ(functions->size(), 1u);
  EXPECT_EQ(functions->front().terminals.size(), 1u);
}

TEST(UvcDescriptors, Uvc10TerminalWithTwoControlBytes) {
  const auto functions = ParseConfiguration(Join({kVc, "11 24 02 05 01 02 00 00 00 00 00 00 00 00 02 20 02"}));
  ASSERT_TRUE(functions.has_value());
  ASSERT_EQ(functions->front().terminals.size(), 1u);
  EXPECT_EQ(functions->front().terminals[0].id, 5);
  EXPECT_EQ(functions->front().terminals[0].controls, 0x0220u);
}

TEST(UvcDescriptors, TerminalShorterThanItsControlsIsRefused) {
  // bControlSize says 3, the descriptor ends after 2.
  const auto functions = ParseConfiguration(Join({kVc, "11 24 02 01 01 02 00 00 00 00 00 00 00 00 03 2E 2A"}));
  ASSERT_FALSE(functions.has_value());
  EXPECT_EQ(functions.error().code, Code::Protocol);
}

TEST(UvcDescriptors, TwoFunctionsAndTwoTerminalsAreToldApart) {
  const auto functions = ParseConfiguration(
      Join({kVc, kHeader, kTerminal, "12 24 02 09 01 02 00 00 00 00 00 00 00 00 03 20 00 00",
            "09 04 02 00 00 0E 01 00 00", "12 24 02 01 01 02 00 00 00 00 00 00 00 00 03 80 00 00", kVs}));
  ASSERT_TRUE(functions.has_value());
  ASSERT_EQ(functions->size(), 2u);
  EXPECT_EQ((*functions)[0].terminals.size(), 2u);
  EXPECT_EQ((*functions)[0].streams.size(), 1u);
  EXPECT_EQ((*functions)[1].interface, 2);
  EXPECT_EQ((*functions)[1].terminals.size(), 1u);
  EXPECT_TRUE((*functions)[1].streams.empty());
}

TEST(UvcDescriptors, OtherInputTerminalsAndOtherClassesAreSkipped) {
  const auto functions =
      ParseConfiguration(Join({"09 04 00 00 00 03 01 01 00", kTerminal, kVc, "08 24 02 04 01 04 00 00"}));
  ASSERT_TRUE(functions.has_value());
  ASSERT_EQ(functions->size(), 1u);
  EXPECT_TRUE(functions->front().terminals.empty());
}

TEST(UvcDescriptors, EveryTruncationIsRefusedOrHarmless) {
  const Bytes whole = Join({kVc, kHeader, kTerminal, kStatus, kVs, kYuyv, kFrame640, kColour, kVsAlt2, kIso});
  int refused = 0;
  for (std::size_t length = 0; length < whole.size(); ++length) {
    const Bytes part(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(length));
    const auto functions = ParseConfiguration(part);
    if (!functions) ++refused;
    if (!functions) {
      EXPECT_EQ(functions.error().code, Code::Protocol);
    }
  }
  // Only cuts between descriptors leave something whole.
  EXPECT_EQ(refused, static_cast<int>(whole.size()) - 10);
}

TEST(UvcDescriptors, ActiveConfigurationOfSeveral) {
  Bytes all(18, 0);
  const Bytes first = FromHex("09 02 09 00 00 01 00 80 32"), second = FromHex("09 02 0B 00 00 02 00 80 32 02 00");
  all.insert(all.end(), first.begin(), first.end());
  all.insert(all.end(), second.begin(), second.end());
  EXPECT_EQ(ActiveConfiguration(all, "1"), first);
  EXPECT_EQ(ActiveConfiguration(all, "2"), second);
  EXPECT_TRUE(ActiveConfiguration(all, "3").empty());
  EXPECT_TRUE(ActiveConfiguration({}, "1").empty());
}

}  // namespace
}  // namespace lensd::drivers::uvc
