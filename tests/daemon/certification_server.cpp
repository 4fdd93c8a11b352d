// The daemon's own server code serving org.varlink.certification instead of lenses, for foreign clients to test,
// and io.lensd.test, which floods a client.
//   certification_server SOCKET
#include <signal.h>

#include <cstdio>
#include <iostream>
#include <string>
#include <vector>

#include "certification_interface.h"
#include "daemon/server/router.h"
#include "daemon/server/server.h"
#include "loop/event_loop.h"
#include "loop/listener.h"
#include "proto/interfaces.h"

namespace lensd::daemon {
namespace {

using varlink::Json;

constexpr const char* kClientId = "certified";

/// What each call must bring, besides the client's id, is what the call before it answered.
struct Step {
  std::string method;
  Json wants;
  Json gives;
};

Json MyType() {
  return Json::parse(R"({
    "object": {"method": "org.varlink.certification.Test09", "parameters": {"map": {"foo": "Foo", "bar": "Bar"}}},
    "enum": "two",
    "struct": {"first": 1, "second": "2"},
    "array": ["one", "two", "three"],
    "dictionary": {"foo": "Foo", "bar": "Bar"},
    "stringset": {"one": {}, "two": {}, "three": {}},
    "nullable": null,
    "nullable_array_struct": null,
    "interface": {"foo": [null, {"foo": "foo", "bar": "bar"}, null, {"one": "foo", "two": "bar"}],
                  "anon": {"foo": true, "bar": false}}})");
}

std::vector<std::string> ManyReplies() {
  std::vector<std::string> replies;
  for (int i = 1; i <= 10; ++i) replies.push_back("Reply number " + std::to_string(i));
  return replies;
}

std::vector<Step> Steps() {
  const Json four{{"bool", false}, {"int", 2}, {"float", 3.14}, {"string", "a lot of string"}};
  const Json map{{"foo", "Foo"}, {"bar", "Bar"}};
  const Json set{{"one", Json::object()}, {"two", Json::object()}, {"three", Json::object()}};
  return {{"Test01", Json::object(), {{"bool", true}}},
          {"Test02", {{"bool", true}}, {{"int", 1}}},
          {"Test03", {{"int", 1}}, {{"float", 1.0}}},
          {"Test04", {{"float", 1.0}}, {{"string", "ping"}}},
          {"Test05", {{"string", "ping"}}, four},
          {"Test06", four, {{"struct", four}}},
          {"Test07", {{"struct", four}}, {{"map", map}}},
          {"Test08", {{"map", map}}, {{"set", set}}},
          {"Test09", {{"set", set}}, {{"mytype", MyType()}}},
          {"Test10", {{"mytype", MyType()}}, Json::object()},
          {"Test11", {{"last_more_replies", ManyReplies()}}, Json::object()},
          {"End", Json::object(), {{"all_ok", true}}}};
}

/// Absent and null are equal.
Json WithoutNulls(const Json& value) {
  if (!value.is_object()) return value;
  Json kept = Json::object();
  for (const auto& [key, member] : value.items()) {
    if (!member.is_null()) kept[key] = WithoutNulls(member);
  }
  return kept;
}

class Certification final : public Service {
 public:
  const varlink::InterfaceDefinition& definition() const override { return definition_; }

  const MethodTable& methods() const override { return methods_; }

 private:
  MethodTable Rows() {
    MethodTable rows;
    for (const auto& [name, unused] : definition_.methods()) {
      rows.push_back(
          {name, [this, method = std::string_view(name)](const ExchangePointer& exchange) { Serve(method, exchange); },
           Acts::InTurn, "", NeedsLease::No, MayChangeState::Yes, Streams::Yes});
    }
    return rows;
  }

  void Serve(std::string_view method, const ExchangePointer& exchange) {
    if (method == "Start") {
      at_ = 0;
      return exchange->Finish(varlink::WriteJson({{"client_id", kClientId}}));
    }
    Json got = exchange->parameters();
    if (got["client_id"] != kClientId) return exchange->Refuse(kPrefix + "ClientIdError", Json::object());
    got.erase("client_id");
    const Step* step = at_ < steps_.size() ? &steps_[at_] : nullptr;
    const bool flags_fit =
        exchange->call().more == (method == "Test10") && exchange->call().oneway == (method == "Test11");
    if (step == nullptr || step->method != method || !flags_fit || WithoutNulls(got) != WithoutNulls(step->wants)) {
      at_ = steps_.size();  // everything after a mistake is one, End included
      return exchange->Refuse(kPrefix + "CertificationError", {{"wants", step ? step->wants : Json()}, {"got", got}});
    }
    ++at_;
    if (method == "Test10") return AnswerManyTimes(exchange);
    exchange->Finish(varlink::WriteJson(step->gives));
  }

  static void AnswerManyTimes(const ExchangePointer& exchange) {
    const std::vector<std::string> replies = ManyReplies();
    for (const std::string& reply : replies) {
      const std::string text = varlink::WriteJson({{"string", reply}});
      reply == replies.back() ? exchange->Finish(text) : exchange->Continue(text);
    }
  }

  const std::string kPrefix = "org.varlink.certification.";
  const varlink::InterfaceDefinition definition_ = BuiltInDefinition(kCertificationInterface);
  const MethodTable methods_ = Rows();
  const std::vector<Step> steps_ = Steps();
  std::size_t at_ = steps_.size();
};

/// Answers with as many mebibytes as asked for, all at once, whether they are read or not.
class Flood final : public Service {
 public:
  const varlink::InterfaceDefinition& definition() const override { return definition_; }

  const MethodTable& methods() const override { return methods_; }

 private:
  static void Serve(const ExchangePointer& exchange) {
    const std::string kibibyte = varlink::WriteJson({{"text", std::string(1000, 'x')}});
    for (int left = exchange->parameters()["megabytes"].get<int>() * 1024; left > 0; --left) {
      exchange->Continue(kibibyte);
    }
    exchange->Finish(kibibyte);
  }

  const varlink::InterfaceDefinition definition_ =
      BuiltInDefinition("interface io.lensd.test\nmethod Flood(megabytes: int) -> (text: string)\n");
  const MethodTable methods_ = {{"Flood", Serve, Acts::InTurn, "", NeedsLease::No, MayChangeState::No, Streams::Yes}};
};

int Main(const std::string& path) {
  sigset_t blocked;
  sigemptyset(&blocked);
  sigaddset(&blocked, SIGTERM);
  sigaddset(&blocked, SIGINT);
  sigprocmask(SIG_BLOCK, &blocked, nullptr);
  auto loop = EventLoop::Create();
  auto listener = Listener::Open(path);
  const auto quit = [&loop](int) { (*loop)->Quit(); };
  if (!loop || !listener || !(*loop)->OnSignals({SIGTERM, SIGINT}, quit))
    return std::fprintf(stderr, "cannot serve\n"), 1;
  Certification certification;
  Flood flood;
  Router router({"lensd", "certification server", "1", "https://lensd.io"});
  router.Add(certification);
  router.Add(flood);
  auto server = Server::Create(**loop, listener->descriptor(), router, Limits{}, "org.varlink.certification.Busy",
                               [](std::string_view notice) { std::cerr << notice << "\n"; });
  if (!server) return std::fprintf(stderr, "cannot serve\n"), 1;
  return (*loop)->Run() ? 0 : 1;
}

}  // namespace
}  // namespace lensd::daemon

int main(int argc, char** argv) {
  if (argc != 2) return std::fprintf(stderr, "usage: certification_server SOCKET\n"), 64;
  return lensd::daemon::Main(argv[1]);
}
