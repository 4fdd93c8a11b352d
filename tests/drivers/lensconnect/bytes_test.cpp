// What goes over the wire, byte for byte. Section numbers are those of the project's fact sheet "Computar LensConnect
// USB lens (CP2112 HID-to-SMBus bridge)".
#include <gtest/gtest.h>

#include <random>
#include <set>

#include "cp2112.h"
#include "lensconnect_lens.h"
#include "model_transport.h"
#include "registers.h"
#include "script_transport.h"

namespace lensd::drivers::lensconnect {
namespace {

using namespace std::chrono_literals;
using sim::devices::LensConnectAxis;
using sim::devices::LensConnectFault;
using testing::Script;

class Bytes : public ::testing::Test {
 protected:
  ~Bytes() override { EXPECT_TRUE(script_->steps.empty()) << script_->steps.size() << " steps were never met"; }
  Registers Make() { return Registers(std::make_unique<testing::ScriptTransport>(script_, clock_), clock_); }
  static constexpr const char* kComplete2 = "16 02 05 00 00 00 02";
  static constexpr const char* kComplete4 = "16 02 05 00 00 00 04";
  static constexpr const char* kNotAcknowledged = "16 03 00 00 00 00 00";

  SteppedClock clock_;
  std::shared_ptr<Script> script_ = std::make_shared<Script>();
};

// Section 3, byte examples: "SMBus config", with one retry instead of endless ones (same section: use a finite count).
TEST_F(Bytes, TheBusSettings) {
  script_->Expect("06 00 01 86 A0 40 00 03 E8 03 E8 00 00 01");
  EXPECT_TRUE(Make().Open());
}

// Section 2, report 0x06: fields are rejected one by one, silently.
TEST_F(Bytes, BusSettingsThatWereNotTakenAreAnError) {
  script_->feature = testing::FromHex("06 00 01 86 A0 40 00 03 E8 03 E8 00 00 00");
  script_->Expect("06 00 01 86 A0 40 00 03 E8 03 E8 00 00 01");
  const auto opened = Make().Open();
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, Code::Protocol);
}

// Section 3, byte examples: set pointer, read request, poll, force send. The pointer's write is polled as well.
TEST_F(Bytes, ReadingTheCapabilities) {
  script_->Expect("14 40 02 00 40");
  script_->Expect("15 01", {kComplete2});
  script_->Expect("10 40 00 02");
  script_->Expect("15 01", {"16 02 05 00 00 00 02"});
  script_->Expect("12 00 02", {"13 02 02 00 1E"});
  const auto value = Make().Read(address::kCapabilities);
  ASSERT_TRUE(value) << value.error().message;
  EXPECT_EQ(*value, 0x001E);
}

// Section 3: S0 after a finished read is 0x02, or 0x00 where the status was consumed; the length decides.
TEST_F(Bytes, AnIdleStatusInTheAnswerIsFine) {
  script_->Expect("14 40 02 00 42");
  script_->Expect("15 01", {"16 00 00 00 00 00 00"});
  script_->Expect("10 40 00 02");
  script_->Expect("15 01", {"16 01 02 00 00 00 00"});
  script_->Expect("15 01", {"16 00 00 00 00 00 00"});
  script_->Expect("12 00 02", {"13 00 02 00 04"});
  EXPECT_EQ(Make().Read(address::kStatus1).value_or(0xFFFF), 0x0004);
}

// Section 3, byte examples: "Move focus to 1000" and "Initialise iris".
TEST_F(Bytes, MovingFocusAndInitialisingTheIris) {
  script_->Expect("14 40 04 20 00 03 E8");
  script_->Expect("15 01", {kComplete4});
  script_->Expect("14 40 04 30 08 00 01");
  script_->Expect("15 01", {kComplete4});
  auto registers = Make();
  EXPECT_TRUE(registers.Write(0x2000 + address::kPosition, 1000));
  EXPECT_TRUE(registers.Write(0x3000 + address::kInitialize, 1));
}

// Section 2, errata E111: stray reports, here before, between and of the wrong kind.
TEST_F(Bytes, StrayReportsAreIgnored) {
  script_->input = {testing::FromHex("13 02 02 AA AA"), testing::FromHex("16 02 05 00 00 00 05")};
  script_->Expect("06 00 01 86 A0 40 00 03 E8 03 E8 00 00 01");
  script_->Expect("14 40 02 00 40");
  script_->Expect("15 01", {"13 02 02 BB BB", kComplete2});
  script_->Expect("10 40 00 02");
  script_->Expect("15 01", {kComplete2, "13 02 02 CC CC"});
  script_->Expect("12 00 02", {"16 02 05 00 00 00 02", "13 02 02 00 1E"});
  auto registers = Make();
  ASSERT_TRUE(registers.Open());
  EXPECT_EQ(registers.Read(address::kCapabilities).value_or(0), 0x001E);
}

// Two answers to one question: which one is ours? It asks again.
TEST_F(Bytes, TwoAnswersAreNone) {
  for (const bool twice : {true, false}) {
    if (!twice) script_->Expect("17 01");
    script_->Expect("14 40 02 00 40");
    script_->Expect("15 01", {kComplete2});
    script_->Expect("10 40 00 02");
    script_->Expect("15 01", {kComplete2});
    if (twice) script_->Expect("12 00 02", {"13 02 02 03 E8", "13 02 02 00 1E"});
    if (!twice) script_->Expect("12 00 02", {"13 02 02 00 1E"});
  }
  EXPECT_EQ(Make().Read(address::kCapabilities).value_or(0), 0x001E);
}

// Section 2, "Interrupt IN": longer answers come as several reports.
TEST_F(Bytes, AnAnswerInPieces) {
  script_->Expect("14 40 02 00 10");
  script_->Expect("15 01", {kComplete2});
  script_->Expect("10 40 00 18");
  script_->Expect("15 01", {"16 02 05 00 00 00 18"});
  script_->Expect("12 00 18",
                  {"13 02 0A 56 33 5A 33 2E 35 2F 32 35 43", "13 02 0E 53 20 20 00 00 00 00 00 00 00 00 00 00 00"});
  EXPECT_EQ(Make().ReadText(address::kModelName, 24).value_or("?"), "V3Z3.5/25CS");
}

// Section 3: retries must be finite. Each attempt after the first begins with a cancel.
TEST_F(Bytes, ThreeAttemptsAndNoMore) {
  for (int attempt = 0; attempt < 3; ++attempt) {
    if (attempt > 0) script_->Expect("17 01");
    script_->Expect("14 40 04 20 00 03 E8");
    script_->Expect("15 01", {kNotAcknowledged});
  }
  const auto written = Make().Write(0x2000 + address::kPosition, 1000);
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().code, Code::Timeout);
}

TEST_F(Bytes, ABridgeThatNeverAnswersEndsInATimeout) {
  for (int attempt = 0; attempt < 3; ++attempt) {
    if (attempt > 0) script_->Expect("17 01");
    script_->Expect("14 40 02 00 42");
    for (int question = 0; question < 3; ++question) script_->Expect("15 01");
  }
  const Instant before = clock_.Now();
  const auto read = Make().Read(address::kStatus1);
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().code, Code::Timeout);
  EXPECT_LE(clock_.Now() - before, 500ms);
}

// Section 2: what S1 says of a failed transfer (S0 = 3).
TEST_F(Bytes, FailuresByTheirCode) {
  const std::pair<const char*, Code> kinds[] = {{"16 03 00 00 00 00 00", Code::Timeout},
                                                {"16 03 01 00 00 00 00", Code::Busy},
                                                {"16 03 02 00 00 00 00", Code::Busy},
                                                {"16 03 03 00 00 00 00", Code::Protocol},
                                                {"16 03 04 00 00 00 00", Code::Protocol}};
  for (const auto& [reply, code] : kinds) {
    for (int attempt = 0; attempt < 3; ++attempt) {
      if (attempt > 0) script_->Expect("17 01");
      script_->Expect("14 40 04 20 00 03 E8");
      script_->Expect("15 01", {reply});
    }
    const auto written = Make().Write(0x2000, 1000);
    ASSERT_FALSE(written);
    EXPECT_EQ(written.error().code, code) << reply;
  }
}

// Section 4: "firmware update: never write", and nothing else but what a motor needs.
TEST_F(Bytes, OnlyMotorRegistersAreWritten) {
  auto registers = Make();
  for (const int where : {0xFF00, 0xFFAA, 0x0034, 0x0054, 0x0040, 0x2002, 0x2020, 0x2024, 0x1012, 0x5000}) {
    const auto written = registers.Write(static_cast<std::uint16_t>(where), 1);
    ASSERT_FALSE(written) << std::hex << where;
    EXPECT_EQ(written.error().code, Code::Internal);
  }
  EXPECT_EQ(script_->unexpected, 0);
}

}  // namespace
}  // namespace lensd::drivers::lensconnect
