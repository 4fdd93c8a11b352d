// The client against a service that answers late: whose reply is whose.
#include "varlink/client.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <filesystem>
#include <string>
#include <thread>

namespace lensd::varlink {
namespace {

using namespace std::chrono_literals;

/// One connection; writes what it is told to.
class SlowService {
 public:
  SlowService() : path_(::testing::TempDir() + "late-" + std::to_string(getpid())) {
    std::filesystem::remove(path_);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path_.copy(address.sun_path, path_.size());
    listening_ = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    EXPECT_EQ(bind(listening_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    EXPECT_EQ(listen(listening_, 1), 0);
    auto client = Client::Connect(path_);
    EXPECT_TRUE(client.has_value());
    client_.emplace(*std::move(client));
    client_->SetDeadline(std::chrono::steady_clock::now() + 10s);
    connection_ = accept(listening_, nullptr, nullptr);
  }
  ~SlowService() {
    close(connection_);
    close(listening_);
    std::filesystem::remove(path_);
  }
  SlowService(const SlowService&) = delete;
  SlowService& operator=(const SlowService&) = delete;

  Client& client() { return *client_; }
  void Say(const std::string& reply) const {
    EXPECT_EQ(write(connection_, reply.c_str(), reply.size() + 1), static_cast<ssize_t>(reply.size() + 1));
  }
  /// A call nobody answers while the client waits.
  void GiveUp(const char* method) {
    client_->SetDeadline(std::chrono::steady_clock::now() + 10ms);
    const auto reply = client_->Invoke(method);
    ASSERT_FALSE(reply.has_value());
    ASSERT_EQ(reply.error().code, Code::Timeout);
    client_->SetDeadline(std::chrono::steady_clock::now() + 10s);
  }

 private:
  std::string path_;
  int listening_ = -1, connection_ = -1;
  std::optional<Client> client_;
};

TEST(VarlinkClient, ALateReplyIsNotTakenForTheNextOnes) {
  SlowService service;
  service.GiveUp("a.b.First");
  service.GiveUp("a.b.Second");
  service.Say(R"({"parameters":{"of":"first, a part"},"continues":true})");
  service.Say(R"({"parameters":{"of":"first"}})");
  service.Say(R"({"error":"a.b.Second","parameters":{}})");
  service.Say(R"({"parameters":{"of":"third"}})");
  service.Say(R"({"parameters":{"of":"fourth"}})");
  for (const char* of : {"third", "fourth"}) {
    const auto reply = service.client().Invoke("a.b.Next");
    ASSERT_TRUE(reply.has_value()) << reply.error().message;
    EXPECT_EQ(reply->parameters["of"], of);
  }
}

TEST(VarlinkClient, WhatIsLateMayStayAwayTillTheDeadline) {
  SlowService service;
  service.GiveUp("a.b.First");
  service.Say(R"({"parameters":{"of":"first"}})");
  service.GiveUp("a.b.Second");
  Client moved = std::move(service.client());
  service.Say(R"({"parameters":{"of":"second"}})");
  service.Say(R"({"parameters":{"of":"third"}})");
  const auto reply = moved.Invoke("a.b.Third");
  ASSERT_TRUE(reply.has_value()) << reply.error().message;
  EXPECT_EQ(reply->parameters["of"], "third");
}

TEST(VarlinkClient, PartsOfAReplyComeOneByOne) {
  SlowService service;
  Call call;
  call.method = "a.b.Watch";
  call.more = true;
  ASSERT_TRUE(service.client().Send(call).has_value());
  service.Say(R"({"parameters":{"of":1},"continues":true})");
  service.Say(R"({"parameters":{"of":2},"continues":true})");
  for (int of = 1; of <= 2; ++of) {
    const auto reply = service.client().Receive();
    ASSERT_TRUE(reply.has_value()) << reply.error().message;
    EXPECT_EQ(reply->parameters["of"], of);
  }
}

}  // namespace
}  // namespace lensd::varlink
