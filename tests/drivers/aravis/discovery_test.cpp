// Who has an address, asked of sockets that play the camera, and openings side by side.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstring>
#include <future>
#include <stdexcept>
#include <string_view>
#include <thread>
#include <vector>

#include "camera_search.h"
#include "discovery.h"
#include "gige_stand.h"

namespace lensd {
namespace {

using drivers::aravis::AskCamera;
using drivers::aravis::AskForFile;
using testing::GigeStand;
using testing::LoopbackTurn;
using namespace std::chrono_literals;

/// Holds the control port of an address on loopback, and says nothing.
class SilentPort {
 public:
  explicit SilentPort(const char* address) : socket_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in here{};
    here.sin_family = AF_INET;
    here.sin_port = htons(3956);
    inet_pton(AF_INET, address, &here.sin_addr);
    if (socket_ < 0 || bind(socket_, reinterpret_cast<const sockaddr*>(&here), sizeof here) != 0) {
      throw std::runtime_error(std::string(address) + " is in use");
    }
    const timeval limit{.tv_sec = 0, .tv_usec = 10000};
    setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
  }
  ~SilentPort() { close(socket_); }
  SilentPort(const SilentPort&) = delete;
  SilentPort& operator=(const SilentPort&) = delete;

  /// Answers what comes with what `make` makes of it, from the `first`-th packet on, until `end`.
  template <class Make>
  void Serve(int first, const std::atomic<bool>& end, Make make) const {
    for (int count = 0; !end;) {
      std::array<unsigned char, 64> packet{};
      sockaddr_in asker{};
      socklen_t size = sizeof asker;
      const auto got = recvfrom(socket_, packet.data(), packet.size(), 0, reinterpret_cast<sockaddr*>(&asker), &size);
      if (got < 8 || ++count < first) continue;
      const std::vector<unsigned char> answer = make(packet.data());
      sendto(socket_, answer.data(), answer.size(), 0, reinterpret_cast<const sockaddr*>(&asker), size);
    }
  }

 private:
  int socket_;
};

/// As GigE Vision has it: no error, DISCOVERY_ACK, 248 bytes, the number of the question.
std::vector<unsigned char> Acknowledge(const unsigned char* question) {
  std::vector<unsigned char> answer(8 + 248);
  answer[3] = 0x03;
  answer[5] = 0xf8;
  std::memcpy(answer.data() + 6, question + 6, 2);
  return answer;
}

TEST(AravisDiscovery, ACameraIsFoundThoughPacketsGetLost) {
  const LoopbackTurn turn;
  const SilentPort camera("127.0.0.41");
  std::atomic<bool> end = false;
  std::thread serving([&] {
    camera.Serve(3, end, [](const unsigned char* question) {
      EXPECT_EQ(question[0], 0x42);
      EXPECT_EQ(question[3], 0x02);
      return Acknowledge(question);
    });
  });
  const auto route = AskCamera("127.0.0.41");
  end = true;
  serving.join();
  ASSERT_TRUE(route) << route.error().message;
  EXPECT_EQ(route->camera, "127.0.0.41");
  EXPECT_EQ(route->here, "127.0.0.1");
}

TEST(AravisDiscovery, EveryReasonHasItsOwnWords) {
  const LoopbackTurn turn;
  const SilentPort silent("127.0.0.42"), stranger("127.0.0.43");
  std::atomic<bool> end = false;
  std::thread serving([&] {
    // An answer, but to another question.
    stranger.Serve(1, end, [](const unsigned char* question) {
      auto answer = Acknowledge(question);
      answer[7] ^= 1;
      return answer;
    });
  });
  const struct {
    const char *host, *words;
    Code code;
  } cases[] = {{"127.0.0.42", "nothing answers at 127.0.0.42", Code::Disconnected},
               {"127.0.0.43", "is no GigE Vision camera", Code::Protocol},
               {"127.0.0.44", "is there and refuses", Code::Disconnected},
               {"no-such-host.invalid", "there is no host \"no-such-host.invalid\"", Code::Disconnected}};
  for (const auto& each : cases) {
    const auto route = AskCamera(each.host);
    ASSERT_FALSE(route) << each.host;
    EXPECT_EQ(route.error().code, each.code) << route.error().message;
    EXPECT_NE(route.error().message.find(each.words), std::string::npos) << route.error().message;
  }
  end = true;
  serving.join();
}

/// As GigE Vision has it: no error, READMEM_ACK, the address asked for and 512 bytes from there.
std::vector<unsigned char> Memory(const unsigned char* question, std::string_view text) {
  std::vector<unsigned char> answer(8 + 4 + 512);
  answer[3] = 0x85;
  answer[4] = 0x02;
  answer[5] = 0x04;
  std::memcpy(answer.data() + 6, question + 6, 6);
  std::memcpy(answer.data() + 12, text.data(), text.size());
  return answer;
}

/// Aravis makes room for as many bytes as the camera says that it has, and ends the process where there are not as
/// many.
TEST(AravisDiscovery, AFileThatNoCameraCanHaveIsNotFetched) {
  const LoopbackTurn turn;
  const SilentPort camera("127.0.0.45"), silent("127.0.0.46");
  const struct {
    std::string_view first, second, refused;
  } cases[] = {{"Local:camera.zip;8000;1a2b?SchemaVersion=1.1.0", "", ""},
               {"Local:///camera.xml;8000;1000000", "", ""},
               {"Local:///camera.xml;8000;1000001", "", "16777217 bytes"},
               {"local:camera.xml;0;ffffffffffffffff", "", "18446744073709551615 bytes"},
               {"http://example.org/camera.xml", "Local:camera.xml;8000;7fffffffffff", "140737488355327 bytes"},
               {"File:camera.xml", "", ""}};
  for (const auto& each : cases) {
    std::atomic<bool> end = false;
    std::thread serving([&] {
      camera.Serve(1, end, [&](const unsigned char* question) {
        return Memory(question, question[10] == 0x02 ? each.first : each.second);
      });
    });
    const auto good = AskForFile({.camera = "127.0.0.45", .here = "127.0.0.1"});
    end = true;
    serving.join();
    EXPECT_EQ(good.has_value(), each.refused.empty()) << each.first;
    if (good) {
      EXPECT_EQ(good->front(), each.first);
      continue;
    }
    EXPECT_EQ(good.error().code, Code::Unsupported);
    EXPECT_NE(good.error().message.find(each.refused), std::string::npos) << good.error().message;
  }
  const auto mute = AskForFile({.camera = "127.0.0.46", .here = "127.0.0.1"});
  ASSERT_FALSE(mute);
  EXPECT_EQ(mute.error().code, Code::Disconnected) << mute.error().message;
}

/// Blocks of 512 bytes and a rest, from the place that the camera states; every third question gets no answer at first.
TEST(AravisDiscovery, AFileIsFetchedWhole) {
  const LoopbackTurn turn;
  const SilentPort camera("127.0.0.45");
  std::string memory(0x9000, '-');
  for (std::size_t i = 0; i < memory.size(); ++i) memory[i] = static_cast<char>(i * i >> 7);
  std::atomic<bool> end = false;
  std::thread serving([&] {
    camera.Serve(1, end, [&, count = 0](const unsigned char* question) mutable {
      const std::size_t from = question[10] * 256U + question[11], size = question[14] * 256U + question[15];
      if (++count % 3 == 0 || from + size > memory.size()) return std::vector<unsigned char>();
      auto answer = Memory(question, std::string_view(memory).substr(from, size));
      answer.resize(12 + size);
      return answer;
    });
  });
  const drivers::aravis::Route route = {.camera = "127.0.0.45", .here = "127.0.0.1"};
  const auto file = drivers::aravis::FetchFile(route, "Local:camera.zip;8000;6a1?SchemaVersion=1.1.0");
  const auto beyond = drivers::aravis::FetchFile(route, "Local:camera.zip;8f00;1000");
  end = true;
  serving.join();
  ASSERT_TRUE(file) << file.error().message;
  EXPECT_EQ(*file, memory.substr(0x8000, 0x6a1));
  ASSERT_FALSE(beyond);
  EXPECT_EQ(beyond.error().code, Code::Disconnected) << beyond.error().message;
  EXPECT_TRUE(drivers::aravis::IsPacked("Local:camera.zip;8000;6a1?SchemaVersion=1.1.0"));
  EXPECT_FALSE(drivers::aravis::IsPacked("Local:camera.xml;8000;6a1?Of=the.zip"));
}

/// Aravis would look for each for seconds, and hold a lock of the whole process meanwhile.
TEST(AravisDiscovery, AddressesThatAreSilentDelayNobody) {
  GigeStand stand;
  std::vector<std::unique_ptr<SilentPort>> ports;
  std::vector<std::future<Result<drivers::Device>>> dead;
  const MonotonicClock clock;
  for (int i = 0; i < 6; ++i) {
    const std::string address = "127.0.0." + std::to_string(51 + i);
    ports.push_back(std::make_unique<SilentPort>(address.c_str()));
    dead.push_back(std::async(std::launch::async, [address, &clock] {
      return drivers::aravis::OpenAravis(testing::Table({{"address", address}}), clock);
    }));
  }
  for (const char* key : {"serial", "id"}) {
    dead.push_back(std::async(std::launch::async, [key, &clock] {
      return drivers::aravis::OpenAravis(testing::Table({{key, std::string("Nobody-None-1")}}), clock);
    }));
  }
  std::this_thread::sleep_for(100ms);  // they are at it
  const Instant begin = clock.Now();
  const auto live = stand.Open();
  const Duration took = clock.Now() - begin;
  EXPECT_TRUE(live) << live.error().message;
  EXPECT_LT(took, 2s) << "Aravis takes 2.5 s for the first of them alone";
  for (auto& opening : dead) {
    const auto device = opening.get();
    ASSERT_FALSE(device);
    EXPECT_EQ(device.error().code, Code::Disconnected) << device.error().message;
  }
  EXPECT_LT(clock.Now() - begin, 10s) << "nor one another";
}

/// Who looks at a camera controls it for as long as that takes: a lens that is opened meanwhile waits for it, and
/// blames no other program.
TEST(AravisDiscovery, ASearchDoesNotKeepALensFromItsCamera) {
  GigeStand stand;
  const drivers::aravis::ListedCamera listed = {.id = "camera",
                                                .physical_id = "",
                                                .protocol = "GigEVision",
                                                .address = "127.0.0.1",
                                                .vendor = "",
                                                .model = "",
                                                .serial = ""};
  std::atomic<bool> end = false;
  std::atomic<int> looked = 0;
  std::thread search([&] {
    while (!end) looked += drivers::aravis::OpenListed(listed).has_value() ? 1 : 0;
  });
  constexpr int kOpenings = 20;
  const MonotonicClock clock;
  const Instant begin = clock.Now();
  for (int i = 0; i < kOpenings; ++i) {
    const auto device = stand.Open();
    EXPECT_TRUE(device) << device.error().message;
  }
  EXPECT_LT(clock.Now() - begin, 15s) << "half of what they take without turns";
  end = true;
  search.join();
  EXPECT_GT(looked, 0);
}

}  // namespace
}  // namespace lensd
