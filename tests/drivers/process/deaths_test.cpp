// A driver that dies or hangs costs its device only, and is said to have.
#include <sys/wait.h>

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <map>
#include <memory>
#include <thread>
#include <vector>

#include "host_process.h"
#include "odd_device.h"
#include "open_files.h"

namespace lensd::drivers::process {
namespace {

using Make = std::function<Result<void>(Device&)>;

template <class T>
Result<void> Bare(const Result<T>& result) {
  if (!result) return PassOn(result);
  return {};
}

const std::map<std::string, Make>& Calls() {
  static const std::map<std::string, Make> calls = {
      {"StartHome", [](Device& device) { return device.lens->StartHome(Axis::Focus); }},
      {"StartMove", [](Device& device) { return device.lens->StartMove(Axis::Focus, Native{7.0}); }},
      {"Read", [](Device& device) { return Bare(device.lens->Read()); }},
      {"Stop", [](Device& device) { return device.lens->Stop(Axis::Focus); }},
      {"ResetFault", [](Device& device) { return device.lens->ResetFault(Axis::Focus); }},
      {"StartStream", [](Device& device) { return device.camera->Start(); }},
      {"NextFrame", [](Device& device) { return Bare(device.camera->Poll()); }},
      {"StopStream", [](Device& device) { return device.camera->Stop(); }},
  };
  return calls;
}

/// What each kind of death is called.
const std::map<std::string, std::string>& Deaths() {
  static const std::map<std::string, std::string> deaths = {{"abort", "signal 6"},
                                                            {"kill", "signal 9"},
                                                            {"exit", "exit status 3"},
                                                            {"throw", "exit status 70"},
                                                            {"segv", "signal 11"}};
  return deaths;
}

std::string Odd(const std::string& in, const std::string& how, int lines = 0) {
  return "in = \"" + in + "\"\nhow = \"" + how + "\"\nlines = " + std::to_string(lines) + "\n";
}

bool NoChildren() {
  return waitpid(-1, nullptr, WNOHANG) == -1 && errno == ECHILD;
}

}  // namespace

TEST(Deaths, InEveryCallAreDisconnectedWithSignalAndCall) {
  const int open_files = testing::OpenFiles();
  for (const auto& [call, make] : Calls()) {
    for (const auto& [how, ends] : Deaths()) {
      SCOPED_TRACE(call + " " + how);
      auto device = OpenOdd(Odd(call, how));
      ASSERT_TRUE(device.has_value()) << device.error().message;
      const auto died = make(*device);
      ASSERT_FALSE(died.has_value());
      EXPECT_EQ(died.error().code, Code::Disconnected);
      const std::string& message = died.error().message;
      EXPECT_TRUE(message.starts_with("the driver ended: " + ends + " in " + call)) << message;
      if (how == "throw") {
        EXPECT_NE(message.find("thrown on purpose"), message.npos) << message;
      }
      for (const auto& [unused, other] : Calls()) {
        const auto later = other(*device);
        ASSERT_FALSE(later.has_value());
        EXPECT_EQ(later.error().message, message);
      }
    }
  }
  EXPECT_TRUE(NoChildren());
  EXPECT_EQ(testing::OpenFiles(), open_files);
  auto anew = OpenOdd("");
  ASSERT_TRUE(anew.has_value());
  EXPECT_TRUE(anew->lens->Read().has_value());
}

TEST(Deaths, WhileOpening) {
  for (const auto& [how, ends] : Deaths()) {
    const auto device = OpenOdd(Odd("Open", how));
    ASSERT_FALSE(device.has_value());
    EXPECT_EQ(device.error().code, Code::Disconnected);
    EXPECT_NE(device.error().message.find(" in Open"), std::string::npos) << device.error().message;
  }
  EXPECT_TRUE(NoChildren());
}

TEST(Deaths, OfAProgramThatIsNotThereOrIsNoDriver) {
  Program program = OddProgram();
  program.command = {"/no/such/driver"};
  const auto missing = OpenOdd("", program);
  ASSERT_FALSE(missing.has_value());
  EXPECT_EQ(missing.error().code, Code::Disconnected);
  EXPECT_NE(missing.error().message.find("/no/such/driver"), std::string::npos);
  program.command = {"/bin/sh", "-c", "echo no driver at all; exit 5"};
  const auto none = OpenOdd("", program);
  ASSERT_FALSE(none.has_value());
  EXPECT_EQ(none.error().message, "the driver ended: exit status 5 in Open; it printed last: no driver at all");
  EXPECT_TRUE(NoChildren());
}

TEST(Deaths, ErrorsOfTheDriverArePassedOn) {
  const auto busy = OpenOdd("how = \"refuse\"");
  ASSERT_FALSE(busy.has_value());
  EXPECT_EQ(busy.error().code, Code::Busy);
  EXPECT_EQ(busy.error().message, "somebody else has it");
  const auto wrong = OpenOdd("\n\nnonsense = 1");
  ASSERT_FALSE(wrong.has_value());
  EXPECT_EQ(wrong.error().code, Code::BadData);
  EXPECT_TRUE(wrong.error().message.starts_with("odd.toml:3:")) << wrong.error().message;
  const auto device = OpenOdd("");
  ASSERT_TRUE(device.has_value());
  ASSERT_NE(device->findings.Of("iris"), nullptr);
  EXPECT_EQ(*device->findings.Of("iris"), (LeftOut{"iris", "it is loose", Code::Io}));
}

TEST(Deaths, TheLastTenLinesAreInTheReason) {
  auto device = OpenOdd(Odd("Read", "exit", 25));
  ASSERT_TRUE(device.has_value());
  const auto died = device->lens->Read();
  ASSERT_FALSE(died.has_value());
  EXPECT_EQ(
      died.error().message,
      "the driver ended: exit status 3 in Read; it printed last: line 16 | line 17 | line 18 | line 19 | line 20 | "
      "line 21 | line 22 | line 23 | line 24 | line 25");
}

TEST(Hangs, AreEndedByKillingTheProcess) {
  std::vector<std::thread> waiting;
  const auto hang = [](const std::string& call, const std::string& how) {
    Program program = OddProgram();
    program.call_at_most = std::chrono::seconds(3);
    auto device = OpenOdd(Odd(call, how), program);
    ASSERT_TRUE(device.has_value()) << device.error().message;
    const auto hung = Calls().at(call)(*device);
    ASSERT_FALSE(hung.has_value());
    EXPECT_EQ(hung.error().code, Code::Disconnected);
    EXPECT_EQ(hung.error().message, "the driver has not answered for 3 s in " + call + ", and was ended");
  };
  for (const auto& [call, unused] : Calls()) waiting.emplace_back(hang, call, "deaf");
  waiting.emplace_back(hang, "Read", "spin");
  for (std::thread& each : waiting) each.join();
  EXPECT_TRUE(NoChildren());
}

TEST(Hangs, WhoSharesTheProcessHearsWhyItWasEnded) {
  Program program = OddProgram();
  program.shares = "bus test";
  program.call_at_most = std::chrono::seconds(3);
  auto one = OpenOdd("", program);
  auto other = OpenOdd(Odd("Read", "deaf"), program);
  ASSERT_TRUE(one.has_value() && other.has_value());
  const auto hung = other->lens->Read();
  const auto neighbour = one->lens->Read();
  ASSERT_FALSE(hung.has_value() || neighbour.has_value());
  EXPECT_EQ(hung.error().message, "the driver has not answered for 3 s in Read, and was ended");
  EXPECT_EQ(neighbour.error().message, hung.error().message);
}

TEST(Hangs, AReadThatWaitsIsCutShortAndAStopFollows) {
  Lines lines;
  Program program = OddProgram();
  program.log = [&](std::string_view line) { lines.Add(line); };
  auto device = OpenOdd(Odd("Read", "wait"), program);
  ASSERT_TRUE(device.has_value());
  Result<LensState> read;
  std::thread reader([&] { read = device->lens->Read(); });
  while (!lines.Have("waiting in Read")) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  device->lens->CutReadShort();
  reader.join();
  ASSERT_FALSE(read.has_value());
  EXPECT_EQ(read.error().code, Code::Cancelled);
  EXPECT_TRUE(device->lens->Stop(Axis::Focus).has_value());
  EXPECT_TRUE(device->lens->StartMove(Axis::Focus, Native{3.0}).has_value());
}

TEST(Hangs, ACallThatWaitsIsInterruptedAndNoInterruptIsLeftOver) {
  Lines lines;
  Program program = OddProgram();
  program.log = [&](std::string_view line) { lines.Add(line); };
  auto device = OpenOdd(Odd("StartMove", "wait"), program);
  ASSERT_TRUE(device.has_value());
  Result<void> moved;
  std::thread mover([&] { moved = device->lens->StartMove(Axis::Focus, Native{3.0}); });
  while (!lines.Have("waiting in StartMove")) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  device->lens->CutReadShort();  // of a Read alone
  device->lens->Interrupt();
  mover.join();
  ASSERT_FALSE(moved.has_value());
  EXPECT_EQ(moved.error().code, Code::Cancelled);
  device->lens->Interrupt();
  EXPECT_TRUE(device->lens->Read().has_value());
}

TEST(Ends, TheDriverClosesItsDeviceAndEndsWithTheLastConnection) {
  Lines lines;
  Program program = OddProgram();
  program.log = [&](std::string_view line) { lines.Add(line); };
  auto device = OpenOdd("", program);
  ASSERT_TRUE(device.has_value());
  *device = {};
  EXPECT_TRUE(lines.Have("closed"));
  EXPECT_TRUE(NoChildren());
}

TEST(Ends, DevicesThatShareAProcess) {
  Program program = OddProgram();
  program.shares = "bus test";
  auto one = OpenOdd("", program);
  auto other = OpenOdd(Odd("Read", "exit"), program);
  ASSERT_TRUE(one.has_value() && other.has_value());
  EXPECT_TRUE(one->lens->Read().has_value());
  *one = {};
  one = OpenOdd("", program);
  ASSERT_TRUE(one.has_value());
  EXPECT_TRUE(one->lens->Read().has_value());
  const auto died = other->lens->Read();
  ASSERT_FALSE(died.has_value());
  EXPECT_TRUE(died.error().message.starts_with("the driver ended: exit status 3 in Read")) << died.error().message;
  EXPECT_EQ(one->lens->Read().error().code, Code::Disconnected);
  *other = {};
  auto anew = OpenOdd("", program);
  ASSERT_TRUE(anew.has_value()) << anew.error().message;
  EXPECT_TRUE(anew->lens->Read().has_value());
  *one = {};
  *anew = {};
  EXPECT_TRUE(NoChildren());
}

TEST(Ends, DevicesThatShareAProcessComeAndGoAtAnyTime) {
  Program program = OddProgram();
  program.shares = "busy bus";
  const char* level = std::getenv("LENSD_TEST_LEVEL");
  const int turns = level != nullptr && std::string_view(level) == "long" ? 1000 : 20;
  std::vector<std::jthread> lenses;
  for (int i = 0; i < 3; ++i) {
    lenses.emplace_back([&] {
      for (int turn = 0; turn < turns; ++turn) {
        auto device = OpenOdd("", program);
        ASSERT_TRUE(device.has_value()) << device.error().message;
        const auto read = device->lens->Read();
        EXPECT_TRUE(read.has_value()) << read.error().message;
      }
    });
  }
  lenses.clear();
  EXPECT_TRUE(NoChildren());
}

/// As after a kill of lensd: nobody says Close.
class EndOfLensd : public ::testing::Test {
 protected:
  /// Opens a device with this trouble, begins a Read, and is gone. How the process ended, and what it printed.
  void BeGoneInRead(const std::string& in, const std::string& how) {
    Program program = OddProgram();
    program.log = [this](std::string_view line) { lines_.Add(line); };
    const auto process = HostProcess::Start(program);
    ASSERT_TRUE(process.has_value());
    auto socket = (*process)->Connect();
    ASSERT_TRUE(socket.has_value());
    const std::string calls = R"({"method":"io.lensd.Driver.Open","parameters":{"device":"d","settings":{"in":")" + in +
                              R"(","how":")" + how + R"("}}})" + '\0' +
                              R"({"method":"io.lensd.Driver.Read","parameters":{"device":"d"}})" + '\0';
    ASSERT_EQ(write(socket->get(), calls.data(), calls.size()), static_cast<ssize_t>(calls.size()));
    char reply[64];
    ASSERT_GT(read(socket->get(), reply, sizeof reply), 0);  // it is open, and reads now
    *socket = daemon::Descriptor();
    const Error how_it_ended = (*process)->HowItEnded("Read");
    EXPECT_EQ(how_it_ended.message.substr(0, 39), "the driver ended: exit status 0 in Read") << how_it_ended.message;
  }

  Lines lines_;
};

TEST_F(EndOfLensd, EndsACallThatWaitsAndClosesTheDevice) {
  for (int turn = 0; turn < 20; ++turn) {
    lines_.Forget();
    BeGoneInRead("Read", "wait");
    EXPECT_TRUE(lines_.Have("closed"));
  }
}

TEST_F(EndOfLensd, WaitsForADeviceThatTakesItsTimeToClose) {
  BeGoneInRead("Close", "dawdle");
  EXPECT_TRUE(lines_.Have("closed"));
}

TEST_F(EndOfLensd, EndsTheProcessWhereACallHangs) {
  BeGoneInRead("Read", "deaf");
  EXPECT_FALSE(lines_.Have("closed"));
}

}  // namespace lensd::drivers::process
