// Profiles and settings: what is refused names its place.
#include <gtest/gtest.h>

#include "link.h"
#include "modbus_bench.h"
#include "profile.h"

namespace lensd::drivers::modbus {
namespace {

using ::lensd::io::ParseToml;

constexpr std::string_view kSmall =
    "version = 1\nname = \"small\"\n[status]\naddress = 1\nmoving = 0\n[position]\naddress = 2\n[[move]]\naddress = 4\n"
    "values = [\"s32 target\"]\n";

TEST(ModbusProfile, AllThatShipAreReadable) {
  std::string names(ShippedProfileNames());
  for (const char* name : {"oriental-az", "moons", "leadshine-rs", "generic"}) {
    EXPECT_NE(names.find(name), std::string::npos);
    const auto table = ParseToml(ShippedProfile(name), name);
    ASSERT_TRUE(table.has_value()) << table.error().message;
    const auto profile = ReadProfile(*table);
    EXPECT_TRUE(profile.has_value()) << profile.error().message;
  }
  EXPECT_EQ(ShippedProfile("other"), "");
}

TEST(ModbusProfile, WhatIsWrongIsNamedWithItsLine) {
  const std::string small(kSmall);
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = small;
    return text.replace(text.find(from), from.size(), to);
  };
  for (const auto& [text, place, words] : std::vector<std::array<std::string, 3>>{
           {with("version = 1", "version = 2"), "p.toml:1", "version"},
           {small + "bogus = 1\n", "p.toml:11", "bogus"},
           {with("moving = 0", "moving = 16"), "p.toml:5", "moving"},
           {with("moving = 0", "mowing = 0"), "p.toml:", "mo"},
           {with("\"s32 target\"", "\"s33 target\""), "p.toml:10", "s32"},
           {with("\"s32 target\"", "\"s32 speed\""), "p.toml:10", "speed"},
           {with("\"s32 target\"", "70000"), "p.toml:10", "70000"},
           {with("\"s32 target\"", "\"u16 -1\""), "p.toml:10", "-1"},
           {with("[position]\naddress = 2\n", ""), "p.toml", "position"},
           {with("address = 4", "address = 65536"), "p.toml:9", "address"},
           {small + "function = 6\n", "p.toml:8", "function"},
           {small + "[alarm]\naddress = 1\n[alarm.names]\nx = \"y\"\n", "p.toml:14", "names"}}) {
    SCOPED_TRACE(text);
    const auto table = ParseToml(text, "p.toml");
    ASSERT_TRUE(table.has_value()) << table.error().message;
    const auto profile = ReadProfile(*table);
    ASSERT_FALSE(profile.has_value());
    EXPECT_EQ(profile.error().code, Code::BadData);
    EXPECT_TRUE(profile.error().message.starts_with(place)) << profile.error().message;
    EXPECT_NE(profile.error().message.find(words), std::string::npos) << profile.error().message;
  }
}

TEST(ModbusProfile, TargetsThatDoNotFitAreRefused) {
  std::string text(kSmall);
  text.replace(text.find("s32 target"), 10, "s16 target");
  const auto profile = ReadProfile(*ParseToml(text, "p.toml"));
  ASSERT_TRUE(profile.has_value()) << profile.error().message;
  EXPECT_TRUE(RegistersOf(profile->move[0], *profile, -32768).has_value());
  EXPECT_EQ(RegistersOf(profile->move[0], *profile, 32768).error().code, Code::OutOfRange);
}

TEST(ModbusProfile, AlarmsHaveNamesByCodeOrByBit) {
  const auto az = ReadProfile(*ParseToml(ShippedProfile("oriental-az"), "az"));
  ASSERT_TRUE(az.has_value());
  EXPECT_EQ(AlarmText(*az, 0), "");
  EXPECT_EQ(AlarmText(*az, 0x4A), "alarm 0x4A: return to home incomplete");
  EXPECT_EQ(AlarmText(*az, 0x1200), "");  // the code is in the low byte
  EXPECT_EQ(AlarmText(*az, 0x99), "alarm 0x99: not in the profile, see the drive's manual");
  const auto moons = ReadProfile(*ParseToml(ShippedProfile("moons"), "moons"));
  ASSERT_TRUE(moons.has_value());
  EXPECT_EQ(AlarmText(*moons, 0x8001), "alarm 0x8001: position error, memory");
}

TEST(ModbusBusConfig, ReadsEndpointsAndRefusesTheRest) {
  const auto read = [](const std::string& text) {
    return ReadBusConfig(*ParseToml("name = \"b\"\ndriver = \"modbus\"\n" + text, "f.toml"));
  };
  for (const auto& [text, endpoint] : std::vector<std::pair<std::string, std::string>>{
           {"host = \"10.0.0.7:1502\"", "10.0.0.7:1502"},
           {"host = \"drive.local\"", "drive.local:502"},
           {"host = \"[::1]:1502\"", "::1:1502"},
           {"host = \"fe80::1\"", "fe80::1:502"},
           {"device = \"/dev/ttyUSB0\"\nbaud = 9600\nparity = \"even\"\nresponse_timeout_ms = 30", "/dev/ttyUSB0"}}) {
    const auto config = read(text);
    ASSERT_TRUE(config.has_value()) << config.error().message;
    EXPECT_EQ(config->Endpoint(), endpoint);
  }
  for (const std::string text :
       {"", "host = \"a\"\ndevice = \"/dev/x\"", "host = \"a:0\"", "host = \"a:70000\"",
        "device = \"/dev/x\"\nbaud = 12345", "device = \"/dev/x\"\nparity = \"mark\"", "host = \"a\"\nbaud = 9600",
        "host = \"a\"\nbogus = 1", "host = \"a\"\nresponse_timeout_ms = 0"}) {
    const auto config = read(text);
    ASSERT_FALSE(config.has_value()) << text;
    EXPECT_TRUE(config.error().message.starts_with("f.toml:")) << config.error().message;
  }
}

/// A drive whose flags lie in registers of their own, some of them inverted, in units of its own.
TEST(ModbusProfile, FlagsMayLieAnywhere) {
  const auto profile = ReadProfile(*ParseToml(
      "version = 1\nname = \"scattered\"\n[status]\nin_position = { address = 9, bit = 15 }\n"
      "ready = { address = 12, bit = 3, inverted = true }\n[position]\naddress = 2\ntype = \"s16\"\nscale = -0.5\n"
      "[[move]]\naddress = 4\nvalues = [\"s16 target\"]\n",
      "p.toml"));
  ASSERT_TRUE(profile.has_value()) << profile.error().message;
  EXPECT_EQ(profile->in_position->place.address, 9);
  EXPECT_EQ(profile->in_position->bit, 15);
  EXPECT_TRUE(profile->ready->inverted);
  EXPECT_EQ(profile->position_scale, -0.5);
}

}  // namespace
}  // namespace lensd::drivers::modbus
