// A client that holds every reply against the interface file, and to the order of its calls.
#pragma once

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <deque>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "base/clock.h"
#include "proto/interfaces.h"
#include "varlink/frame.h"
#include "varlink/interface_definition.h"
#include "varlink/json_view.h"
#include "varlink/message.h"
#include "whole_daemon.h"

namespace lensd::fuzz {

using std::chrono::milliseconds;
using varlink::InterfaceDefinition;
using varlink::Json;

constexpr std::string_view kPrefix = "io.lensd.Lens.";

inline const InterfaceDefinition& Interface() {
  static const InterfaceDefinition definition = *InterfaceDefinition::Parse(proto::LensInterfaceText());
  return definition;
}

class Client {
 public:
  Client() : socket_(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    const sockaddr_un address = Address();
    if (connect(socket_, Generic(address), sizeof address) != 0) Found("it cannot be connected to");
  }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;
  ~Client() { close(socket_); }

  enum class Flag { None, Oneway, More };
  void Send(const std::string& method, const Json& parameters, Flag flag) {
    const varlink::Call call{std::string(kPrefix) + method, parameters, flag == Flag::Oneway, flag == Flag::More,
                             false};
    const std::string message = varlink::EncodeCall(call);
    if (message.size() > varlink::kMaxMessageBytes) return;
    // A daemon that reads no more while it owes answers is right; then the answers come first.
    std::size_t sent = 0;
    const Instant deadline = clock_.Now() + kNever;
    while (sent < message.size()) {
      const ssize_t count = send(socket_, message.data() + sent, message.size() - sent, MSG_NOSIGNAL | MSG_DONTWAIT);
      if (count > 0) sent += static_cast<std::size_t>(count);
      if (count < 0 && errno != EAGAIN) Found("it closed the connection");
      if (count < 0) Read(milliseconds(1));
      if (clock_.Now() > deadline) Found("it reads no more");
    }
    if (flag != Flag::Oneway) waiting_.push_back({method, flag == Flag::More});
  }
  /// What comes within `patience`, or until nothing is waited for; each reply is checked.
  void Read(Duration patience) {
    const Instant deadline = clock_.Now() + patience;
    do {
      pollfd ready{socket_, POLLIN, 0};
      const auto left = std::chrono::ceil<milliseconds>(deadline - clock_.Now()).count();
      const int readable = poll(&ready, 1, static_cast<int>(std::max<std::int64_t>(left, 0)));
      if (readable < 0 && errno == EINTR) continue;  // libFuzzer's own alarm
      if (readable <= 0) return;
      std::array<char, 65536> bytes;
      const ssize_t count = recv(socket_, bytes.data(), bytes.size(), MSG_DONTWAIT);
      if (count <= 0) Found("it closed the connection");
      frames_.Append({bytes.data(), static_cast<std::size_t>(count)});
      for (;;) {
        const auto message = frames_.Next();
        if (!message) Found("a reply is no message");
        if (!*message) break;
        Take(**message);
      }
    } while (!waiting_.empty() && clock_.Now() < deadline);
  }
  /// Calls without their last reply, streams left out.
  bool Waits() const {
    return !waiting_.empty() && !(waiting_.front().more && kEndless.contains(waiting_.front().method));
  }
  const std::string& first() const { return waiting_.front().method; }
  const Json& last() const { return last_; }
  std::optional<std::int64_t> session{};  ///< the one begun last
  std::optional<std::string> lease{};

 private:
  struct Waiting {
    std::string method;
    bool more = false;
  };
  static inline const std::set<std::string> kEndless = {"Monitor", "Status", "View"};

  void Take(std::string_view message) {
    const auto document = varlink::Document::Parse(message);
    if (!document || !document->root().is_object()) Found("a reply is no object: " + std::string(message));
    if (waiting_.empty()) Found("a reply that nobody asked for: " + std::string(message));
    const Waiting& asked = waiting_.front();
    const auto error = document->root().Given("error");
    const auto given = document->root().Given("parameters");
    const varlink::JsonView parameters = given ? *given : varlink::EmptyObject();
    const auto continues = document->root().Given("continues");
    if (continues && continues->boolean() && (!asked.more || error)) Found("a reply goes on that may not");
    if (error) {
      CheckError(asked.method, std::string(error->text()), parameters);
    } else if (const auto wrong =
                   Interface().FirstWrong(*Interface().methods().find(asked.method)->second.output, parameters)) {
      Found(asked.method + " answers with a wrong " + *wrong + ": " + std::string(message.substr(0, 400)));
    }
    last_ = parameters.ToJson();
    if (!error && asked.method == "AutofocusBegin") session = last_["session"].get<std::int64_t>();
    if (!error && asked.method == "TakeLease") lease = last_["lease"].get<std::string>();
    if (!continues || !continues->boolean()) waiting_.pop_front();
  }
  static void CheckError(const std::string& method, const std::string& name, varlink::JsonView parameters) {
    if (name.starts_with("org.varlink.service.")) return;
    const auto known =
        name.starts_with(kPrefix) ? Interface().errors().find(name.substr(kPrefix.size())) : Interface().errors().end();
    if (known == Interface().errors().end()) Found(method + " ends with an unknown " + name);
    if (name == std::string(kPrefix) + "Internal")
      Found(method + " ends with Internal: " + varlink::WriteJson(parameters.ToJson()));
    if (const auto wrong = Interface().FirstWrong(*known->second, parameters)) Found(name + " has a wrong " + *wrong);
  }

  MonotonicClock clock_;
  int socket_;
  varlink::FrameReader frames_{varlink::kMaxReplyBytes};
  std::deque<Waiting> waiting_;
  Json last_;
};

}  // namespace lensd::fuzz
