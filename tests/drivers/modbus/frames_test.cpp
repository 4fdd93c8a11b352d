// Frames on the wire, byte for byte as the makers' documents have them. Sheet sections: A Oriental Motor AZ, B
// Moons'/Applied Motion, C Leadshine RS. Both ends are held against them: what the driver asks and what the simulated
// drive answers.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <thread>

#include "link.h"
#include "modbus_bench.h"
#include "values.h"

namespace lensd::drivers::modbus {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes Hex(std::string_view text) {
  Bytes bytes;
  std::string digits;
  for (const char c : text) {
    if (c != ' ') digits += c;
    if (digits.size() == 2) {
      bytes.push_back(static_cast<std::uint8_t>(std::stoi(digits, nullptr, 16)));
      digits.clear();
    }
  }
  return bytes;
}

std::string Text(const Bytes& bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) {
    const std::string_view digits = "0123456789ABCDEF";
    text += (text.empty() ? "" : " ") + std::string{digits[byte >> 4], digits[byte & 15]};
  }
  return text;
}

/// Whether `frames` went over the wire in this order, others between them or not.
void ExpectInOrder(const std::vector<sim::WireFrame>& seen, bool from_client, const std::vector<std::string>& frames) {
  auto at = seen.begin();
  for (const std::string& frame : frames) {
    const Bytes wanted = Hex(frame);
    at = std::find_if(at, seen.end(),
                      [&](const sim::WireFrame& one) { return one.from_client == from_client && one.bytes == wanted; });
    if (at == seen.end()) {
      std::string all;
      for (const auto& one : seen) all += (one.from_client ? "  > " : "  < ") + Text(one.bytes) + "\n";
      FAIL() << "not on the wire, or not in this order: " << Text(wanted) << "\n" << all;
    }
    ++at;
  }
}

/// What the terminal answers to these bytes.
Bytes Exchange(const std::string& port, const Bytes& request) {
  const int line = open(port.c_str(), O_RDWR | O_NOCTTY);
  EXPECT_EQ(write(line, request.data(), request.size()), static_cast<ssize_t>(request.size()));
  Bytes answer;
  for (pollfd readable{line, POLLIN, 0}; poll(&readable, 1, answer.empty() ? 5000 : 50) > 0;) {
    std::array<std::uint8_t, 256> bytes{};
    const ssize_t count = read(line, bytes.data(), bytes.size());
    if (count <= 0) break;
    answer.insert(answer.end(), bytes.begin(), bytes.begin() + count);
  }
  close(line);
  std::this_thread::sleep_for(std::chrono::milliseconds(20));  // the next frame begins after a break
  return answer;
}

constexpr auto kAbsolute8500 =
    "01 10 00 58 00 10 20 00000000 00000001 00002134 000007D0 000005DC 000005DC 000003E8 00000001 E3 43";

TEST(ModbusFrames, OrientalAzSectionA) {
  Bench bench(true, {"oriental-az"});
  auto device = bench.Open("[drives.focus]\nunit = 1\nprofile = \"oriental-az\"\nrange = [0, 20000]\n");
  ASSERT_TRUE(device.has_value()) << device.error().message;
  Lens& lens = *device->lens;
  bench.wire.Record(true);
  ASSERT_TRUE(bench.Home(lens, Axis::Focus));
  ASSERT_TRUE(lens.StartMove(Axis::Focus, Native{8500}).has_value());
  ASSERT_TRUE(lens.Stop(Axis::Focus).has_value());
  ASSERT_TRUE(bench.Rests(lens, Axis::Focus));
  ASSERT_TRUE(lens.Read().has_value());
  bench.Alarm(1, 0x30);
  ASSERT_TRUE(lens.Read().has_value());
  ASSERT_TRUE(lens.ResetFault(Axis::Focus).has_value());
  const auto seen = bench.wire.Recorded();
  ExpectInOrder(seen, true,
                {"01 03 00 7E 00 02 A4 13",                                                       // status
                 "01 10 00 7C 00 02 04 00000010 F5 12",                                           // ZHOME on
                 "01 10 00 7C 00 02 04 00000000 F4 DE",                                           // all off
                 "01 03 00 CC 00 02 04 34",                                                       // feedback position
                 kAbsolute8500,                                                                   //
                 "01 10 00 7C 00 02 04 00000020 F5 06",                                           // STOP on
                 "01 10 00 7C 00 02 04 00000000 F4 DE",                                           //
                 "01 03 00 80 00 02 C5 E3",                                                       // present alarm
                 "01 10 01 80 00 02 04 00000001 37 9F", "01 10 01 80 00 02 04 00000000 F6 5F"});  // alarm reset
  ExpectInOrder(seen, false, {"01 10 00 58 00 10 40 16"});
}

TEST(ModbusFrames, OrientalAzExceptionsSectionA) {
  Bench bench(true, {"oriental-az"});
  EXPECT_EQ(Text(Exchange(bench.port(), Hex("01 03 40 00 00 02 D1 CB"))), "01 83 02 C0 F1");
  EXPECT_EQ(Text(Exchange(bench.port(), Hex("01 10 40 00 00 01 02 0000 E7 94"))), "01 90 02 CD C1");
}

TEST(ModbusFrames, MoonsSectionB) {
  Bench bench(true, {"moons"});
  auto device =
      bench.Open("[drives.focus]\nunit = 1\nprofile = \"moons\"\nrange = [0, 300000]\nhoming = \"not-needed\"\n");
  ASSERT_TRUE(device.has_value()) << device.error().message;
  Lens& lens = *device->lens;
  bench.wire.Record(true);
  ASSERT_TRUE(lens.StartMove(Axis::Focus, Native{200000}).has_value());
  ASSERT_TRUE(lens.Stop(Axis::Focus).has_value());
  const auto seen = bench.wire.Recorded();
  ExpectInOrder(seen, true,
                {"01 03 00 01 00 01 D5 CA",                              // status
                 "01 10 00 1B 00 05 0A 0258 0258 00F0 0003 0D40 CD 83",  // move profile
                 "01 06 00 7C 00 67 09 F8",                              // FP
                 "01 06 00 7C 00 E1 88 5A"});                            // SK
  ExpectInOrder(seen, false, {"01 03 02 00 09 78 42", "01 10 00 1B 00 05 70 0D", "01 06 00 7C 00 67 09 F8"});
}

TEST(ModbusFrames, MoonsLowHalfFirstSectionB) {
  Bench bench(true, {"moons"});
  auto device = bench.Open(
      "[drives.focus]\nunit = 1\nprofile = \"moons\"\nrange = [0, 300000]\nhoming = \"not-needed\"\nword_order = "
      "\"low-first\"\n");
  ASSERT_TRUE(device.has_value()) << device.error().message;
  bench.wire.Record(true);
  ASSERT_TRUE(device->lens->StartMove(Axis::Focus, Native{200000}).has_value());
  ExpectInOrder(bench.wire.Recorded(), true, {"01 10 00 1B 00 05 0A 0258 0258 00F0 0D40 0003 7B 9A"});
}

TEST(ModbusFrames, MoonsOnTcpSectionB) {
  Bench bench(false, {"moons"});
  auto device =
      bench.Open("[drives.focus]\nunit = 1\nprofile = \"moons\"\nrange = [0, 300000]\nhoming = \"not-needed\"\n");
  ASSERT_TRUE(device.has_value()) << device.error().message;
  bench.wire.Record(true);
  ASSERT_TRUE(device->lens->StartMove(Axis::Focus, Native{200000}).has_value());
  auto seen = bench.wire.Recorded();
  std::erase_if(seen, [](const sim::WireFrame& one) { return one.bytes.size() < 2; });
  for (auto& one : seen) one.bytes[0] = one.bytes[1] = 0;  // the transaction's number is free
  ExpectInOrder(seen, true, {"0000 0000 0006 01 06 007C 0067"});
}

/// Opcodes the driver has no use for: through the link alone.
TEST(ModbusFrames, MoonsOtherOpcodesSectionB) {
  Bench bench(true, {"moons"});
  BusConfig config;
  config.device = bench.port();
  ModbusLink link(config, 'N');
  ASSERT_TRUE(link.Open().has_value());
  bench.wire.Record(true);
  for (const std::uint16_t opcode : {0x66, 0x96}) {
    ASSERT_TRUE(link.Write(1, 6, 0x7C, std::array{opcode}).has_value());
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  ExpectInOrder(bench.wire.Recorded(), true, {"01 06 00 7C 00 66 C8 38", "01 06 00 7C 00 96 C8 7C"});
  const auto refused = link.Write(1, 6, 0x7C, std::array<std::uint16_t, 1>{0x0001});
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code, Code::Protocol);
  EXPECT_EQ(link.outcome(), ModbusLink::Outcome::Answered);
}

TEST(ModbusFrames, LeadshineSectionC) {
  Bench bench(true, {"leadshine-rs"});
  auto device = bench.Open("[drives.focus]\nunit = 1\nprofile = \"leadshine-rs\"\nrange = [0, 20000]\n");
  ASSERT_TRUE(device.has_value()) << device.error().message;
  Lens& lens = *device->lens;
  bench.wire.Record(true);
  ASSERT_TRUE(bench.Home(lens, Axis::Focus));
  ASSERT_TRUE(lens.StartMove(Axis::Focus, Native{10000}).has_value());
  ASSERT_TRUE(lens.Stop(Axis::Focus).has_value());
  bench.Alarm(1, 0xE0);
  ASSERT_TRUE(lens.ResetFault(Axis::Focus).has_value());
  const auto seen = bench.wire.Recorded();
  ExpectInOrder(seen, true,
                {"01 03 10 03 00 01 70 CA",                                             // status
                 "01 06 60 02 00 20 37 D2",                                             // home
                 "01 03 10 14 00 02 80 CF",                                             // position
                 "01 10 62 00 00 08 10 0001 0000 2710 012C 0064 0064 0000 0010 7A FB",  // absolute 10000, 300 r/min
                 "01 06 60 02 00 40 37 FA",                                             // stop
                 "01 06 18 01 11 11 12 F6"});                                           // alarm reset
  ExpectInOrder(seen, false, {"01 10 62 00 00 08 DE 77"});
}

TEST(ModbusFrames, LeadshinePrintedFrameSectionC) {
  Bench bench(true, {});
  bench.wire.AddDrive(7, sim::MakeModbusDrive("leadshine-rs"));
  auto device = bench.Open(
      "[drives.focus]\nunit = 7\nprofile = \"leadshine-rs\"\nrange = [0, 20000]\nhoming = \"not-needed\"\n"
      "parameters = { speed = 0, acceleration = 10000, deceleration = 10000 }\n");
  ASSERT_TRUE(device.has_value()) << device.error().message;
  bench.wire.Record(true);
  (void)device->lens->StartMove(Axis::Focus, Native{10000});
  ExpectInOrder(bench.wire.Recorded(), true, {"07 10 62 00 00 08 10 0001 0000 2710 0000 2710 2710 0000 0010 8D 50"});
  ExpectInOrder(bench.wire.Recorded(), false, {"07 10 62 00 00 08 DE 11"});
}

TEST(ModbusFrames, LeadshineSavesAndRefusesSectionC) {
  Bench bench(true, {"leadshine-rs"});
  EXPECT_EQ(Text(Exchange(bench.port(), Hex("01 06 18 01 22 11 06 06"))), "01 06 18 01 22 11 06 06");
  EXPECT_EQ(Text(Exchange(bench.port(), Hex("01 03 10 03 00 01 70 CB"))), "01 83 08 40 F6");  // its checksum is wrong
  EXPECT_EQ(Text(Exchange(bench.port(), Hex("01 02 00 00 00 01 B9 CA"))), "01 82 01 81 60");
  // Printed as 01 06 01 91 00 20 DD 7B, of which the checksum is wrong.
  EXPECT_EQ(Text(Exchange(bench.port(), Hex("01 06 01 91 00 20 D8 03"))), "01 06 01 91 00 20 D8 03");
}

TEST(ModbusValues, WordOrdersAndSigns) {
  for (const std::int64_t value : {0LL, 1LL, -1LL, 200000LL, -2147483648LL, 2147483647LL}) {
    for (const WordOrder order : {WordOrder::HighFirst, WordOrder::LowFirst}) {
      std::vector<std::uint16_t> registers;
      AppendNumber(registers, NumberType::S32, order, value);
      EXPECT_EQ(NumberAt(registers, NumberType::S32, order), value);
    }
  }
  std::vector<std::uint16_t> registers;
  AppendNumber(registers, NumberType::S32, WordOrder::LowFirst, 200000);
  EXPECT_EQ(registers, (std::vector<std::uint16_t>{0x0D40, 0x0003}));
  EXPECT_EQ(NumberAt(std::array<std::uint16_t, 1>{0xFFFF}, NumberType::S16, WordOrder::HighFirst), -1);
  EXPECT_EQ(NumberAt(std::array<std::uint16_t, 1>{0xFFFF}, NumberType::U16, WordOrder::HighFirst), 65535);
  EXPECT_FALSE(Fits(NumberType::U16, -1));
  EXPECT_FALSE(Fits(NumberType::S16, 32768));
}

}  // namespace
}  // namespace lensd::drivers::modbus
