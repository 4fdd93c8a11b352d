// Every call goes to lensd on a connection of its own and is answered when lensd answers; nothing here waits.
#include "web/service.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstring>
#include <utility>
#include <vector>

#include "proto/interfaces.h"
#include "varlink/base64.h"
#include "varlink/json.h"
#include "web/metrics_text.h"
#include "web/page_files.h"

namespace lensd::web {
namespace {

using varlink::Json;
// lensd takes 64 connections of one user: so many calls beside the Monitor and 16 Views leave room for Stop.
constexpr std::size_t kMostCalls = 40;
constexpr std::size_t kMostStreams = 64;
constexpr std::size_t kLongestSnapshot = std::size_t{256} << 20;
// An autofocus may take an hour; lensd ends it then, and other calls long before.
constexpr Duration kCallAtMost = std::chrono::hours(1) + std::chrono::minutes(1);
constexpr Duration kQuickCall = std::chrono::seconds(10);
constexpr Duration kSnapshotAtMost = std::chrono::minutes(2);
constexpr Duration kCallPing = std::chrono::seconds(15);

Answer MethodRefused(const char* allowed) {
  Answer answer = Refusal(405, "MethodNotAllowed", std::string("ask this by ") + allowed);
  answer.headers.emplace_back("Allow", allowed);
  return answer;
}

/// One call with a single answer.
class PlainCall {
 public:
  void Begin(const LensdLink& link, Exchange& exchange, std::string_view method, Json parameters) {
    call_ =
        link.Begin(method, std::move(parameters), /*more=*/false, kCallAtMost,
                   {.reply =
                        [&exchange](const varlink::Reply& reply, const File&) {
                          if (!reply.error.empty()) return exchange.Reply(AsWished(exchange, AnswerOf(reply)));
                          exchange.Reply({.body = varlink::WriteJson(reply.parameters) + "\n"});
                        },
                    .failed = [&exchange](const Error& why) { exchange.Reply(AsWished(exchange, AnswerOf(why))); }});
  }

 private:
  std::unique_ptr<UpstreamCall> call_;
};

/// One call with `more` as server-sent events: a line `data:` a reply, `event: error` at an error. A client that does
/// not read loses nothing and gets nothing: lensd waits with what comes at leisure, and what is here is bounded.
class CallStream : public std::enable_shared_from_this<CallStream> {
 public:
  CallStream(const LensdLink& link, Exchange& exchange) : link_(link), exchange_(exchange) {}
  void Begin(std::string_view method, Json parameters);
  std::optional<std::size_t> Read(char* to, std::size_t size);

 private:
  static constexpr std::size_t kMostPending = std::size_t{4} << 20;
  void Add(const std::string& text);
  void Take(const varlink::Reply& reply);
  void Failed(const Error& why);
  void Ping();

  const LensdLink& link_;
  Exchange& exchange_;
  std::unique_ptr<UpstreamCall> call_;
  std::string pending_;
  bool ended_ = false;
  Watch ping_;
};

void CallStream::Begin(std::string_view method, Json parameters) {
  call_ = link_.Begin(method, std::move(parameters), /*more=*/true, kCallAtMost,
                      {.reply = [this](const varlink::Reply& reply, const File&) { Take(reply); },
                       .failed = [this](const Error& why) { Failed(why); }});
  Ping();
}

void CallStream::Take(const varlink::Reply& reply) {
  if (!reply.error.empty() && !exchange_.replied()) return exchange_.Reply(AsWished(exchange_, AnswerOf(reply)));
  ended_ = !reply.continues;
  if (!reply.error.empty()) {
    const Json told{{"error", reply.error}, {"parameters", reply.parameters}};
    return Add("event: error\ndata: " + varlink::WriteJson(told) + "\n\n");
  }
  Add("data: " + varlink::WriteJson(reply.parameters) + "\n\n");
}

void CallStream::Failed(const Error& why) {
  if (!exchange_.replied()) return exchange_.Reply(AsWished(exchange_, AnswerOf(why)));
  ended_ = true;
  std::string line = AnswerOf(why).body;
  Add("event: error\ndata: " + line + "\n");
}

void CallStream::Add(const std::string& text) {
  class Body final : public Stream {
   public:
    explicit Body(std::shared_ptr<CallStream> call) : call_(std::move(call)) {}
    std::optional<std::size_t> Read(char* to, std::size_t size) override { return call_->Read(to, size); }

   private:
    const std::shared_ptr<CallStream> call_;
  };
  pending_ += text;
  if (pending_.size() > kMostPending) {
    call_.reset();
    ended_ = true;
    pending_.clear();  // the stream ends without its last event: the client sees that it missed something
  }
  if (exchange_.replied()) return exchange_.Wake();
  exchange_.Reply("text/event-stream", std::make_unique<Body>(shared_from_this()));
}

std::optional<std::size_t> CallStream::Read(char* to, std::size_t size) {
  if (pending_.empty() && ended_) return std::nullopt;
  const std::size_t count = std::min(size, pending_.size());
  std::memcpy(to, pending_.data(), count);
  pending_.erase(0, count);
  return count;
}

void CallStream::Ping() {
  ping_ = link_.loop().After(kCallPing, [this] {
    if (pending_.empty() && !ended_ && exchange_.replied()) Add(": ping\n\n");
    Ping();
  });
}

/// The pieces of a Snapshot, put together.
class SnapshotCall {
 public:
  void Begin(const LensdLink& link, Exchange& exchange, Json parameters) {
    call_ = link.Begin("Snapshot", std::move(parameters), /*more=*/true, kSnapshotAtMost,
                       {.reply = [this, &exchange](const varlink::Reply& reply, const File&) { Take(exchange, reply); },
                        .failed = [&exchange](const Error& why) { exchange.Reply(AnswerOf(why)); }});
  }

 private:
  void Take(Exchange& exchange, const varlink::Reply& reply) {
    if (!reply.error.empty()) return exchange.Reply(AnswerOf(reply));
    const auto piece = varlink::DecodeBase64(reply.parameters.value("data", ""));
    if (!piece || picture_.size() + piece->size() > kLongestSnapshot) {
      return exchange.Reply(Refusal(502, "Protocol", "lensd sent no picture"));
    }
    picture_.append(reinterpret_cast<const char*>(piece->data()), piece->size());
    if (!reply.continues) exchange.Reply({.type = "image/png", .body = std::move(picture_)});
  }

  std::unique_ptr<UpstreamCall> call_;
  std::string picture_;
};

/// Status, then Metrics, then the text of both. A lensd that is not there is a metric too.
class MetricsCall {
 public:
  MetricsCall(const LensdLink& link, Exchange& exchange, OwnMetrics own)
      : link_(link), exchange_(exchange), own_(own) {}
  void Begin() {
    Ask("Status", [this](const Json& status) {
      status_ = status;
      Ask("Metrics", [this](const Json& metrics) { Answer(metrics); });
    });
  }

 private:
  void Ask(const char* method, const std::function<void(const Json&)>& then) {
    call_ = link_.Begin(
        method, Json::object(), /*more=*/false, kQuickCall,
        {.reply = [this, then](const varlink::Reply& reply,
                               const File&) { reply.error.empty() ? then(reply.parameters) : Answer(nullptr); },
         .failed = [this](const Error&) { Answer(nullptr); }});
  }
  void Answer(const Json& metrics) {
    exchange_.Reply({.type = "text/plain; version=0.0.4; charset=utf-8", .body = MetricsText(status_, metrics, own_)});
  }

  const LensdLink& link_;
  Exchange& exchange_;
  const OwnMetrics own_;
  std::unique_ptr<UpstreamCall> call_;
  Json status_;
};

/// "Move", or a whole name of one of lensd's interfaces.
bool IsMethod(std::string_view name) {
  for (const std::string_view prefix : {"io.lensd.Lens.", "io.lensd.Simulator."}) {
    if (name.starts_with(prefix)) name.remove_prefix(prefix.size());
  }
  return !name.empty() && name.size() <= 64 &&
         std::ranges::all_of(name, [](unsigned char c) { return std::isalnum(c); });
}

std::string_view ShortName(std::string_view method) {
  const std::string own = std::string(proto::kLensInterface) + ".";
  return method.starts_with(own) ? method.substr(own.size()) : method;
}

}  // namespace

Service::Service(const LensdLink& link, Access access)
    : link_(link),
      access_(std::move(access)),
      views_(link),
      feed_(link),
      streams_(kMostStreams, access_.owners()),
      calls_(kMostCalls, access_.owners()) {}

bool Service::Seated(Exchange& exchange, Seats& seats, const char* what) const {
  const Seats::Answer taken = seats.Take(access_.OwnerOf(exchange));
  if (taken.outcome == Seats::Outcome::Taken) return exchange.Hold(taken.seat), true;
  const bool own = taken.outcome == Seats::Outcome::ShareTaken && access_.owners() > 1;
  exchange.Reply(Refusal(own ? 429 : 503, "TooMany",
                         own ? "this token has its share of " + std::string(what) + " open; end some of them first"
                             : "too many " + std::string(what) + " at a time; try again when others have ended"));
  return false;
}

std::optional<Answer> Service::Gate(const Exchange& exchange) const {
  if (auto refused = access_.Refused(exchange)) return refused;
  const std::string& path = exchange.path();
  const bool call = path.starts_with("/call/") || (path == "/session" && exchange.method() == "POST");
  if (call && exchange.method() != "POST") return MethodRefused("POST");
  if (!call && exchange.method() != "GET" && exchange.method() != "HEAD") return MethodRefused("GET");
  if (path == "/session" || FindPageFile(path) != nullptr) return std::nullopt;
  if (access_.RoleOf(exchange) != Role::Nobody) return std::nullopt;
  Answer answer =
      Refusal(401, "NoToken", "a token is needed: Authorization: Bearer TOKEN, or open the page with #token=TOKEN");
  answer.headers.emplace_back("WWW-Authenticate", "Bearer");
  return answer;
}

void Service::Handle(Exchange& exchange) {
  if (exchange.path() == "/session") return Session(exchange);
  if (exchange.method() == "POST") return Call(exchange);
  Get(exchange);
}

void Service::Get(Exchange& exchange) {
  const std::string& path = exchange.path();
  if (const PageFile* file = FindPageFile(path)) {
    return exchange.Reply({.type = std::string(file->type), .body = std::string(file->bytes)});
  }
  if (path == "/events" || path == "/live.mjpg") return Stream(exchange);
  if (path == "/history") return exchange.Reply({.body = varlink::WriteJson(feed_.History()) + "\n"});
  if (path == "/snapshot.png") return Snapshot(exchange);
  if (path == "/metrics") return Metrics(exchange);
  exchange.Reply(Refusal(404, "NotFound", "there is nothing with this name here"));
}

/// GET: what this client may do. POST {"token"}: the same, and a cookie that stands for the token from then on.
void Service::Session(Exchange& exchange) const {
  static constexpr std::array kNames{"none", "view", "move"};
  const auto told = [&](Role role) {
    const Json session{{"role", kNames.at(static_cast<std::size_t>(role))}, {"tokenNeeded", access_.needs_token()}};
    return Answer{.body = varlink::WriteJson(session) + "\n"};
  };
  if (exchange.method() != "POST") return exchange.Reply(told(access_.RoleOf(exchange)));
  const auto body = varlink::ParseJson(exchange.body());
  const auto token = body && body->is_object() && body->contains("token") ? (*body)["token"] : Json();
  if (!token.is_string()) return exchange.Reply(Refusal(400, "BadRequest", "the body is {\"token\": TEXT}"));
  const std::string text = token;
  const Role role = access_.RoleOfToken(text);
  if (role == Role::Nobody) return exchange.Reply(Refusal(401, "NoToken", "this token is not known here"));
  Answer answer = told(role);
  if (access_.needs_token()) answer.headers.emplace_back("Set-Cookie", CookieOf(text));
  exchange.Reply(answer);
}

void Service::Call(Exchange& exchange) {
  const std::string method = exchange.path().substr(std::strlen("/call/"));
  if (!IsMethod(method)) return exchange.Reply(Refusal(404, "NotFound", "call a method by its name: /call/Status"));
  auto parameters = varlink::ParseJson(exchange.body().empty() ? "{}" : exchange.body());
  if (!parameters || !parameters->is_object()) {
    return exchange.Reply(Refusal(400, "BadRequest", "the body is one JSON object: the parameters of the call"));
  }
  if (access_.RoleOf(exchange) != Role::Move && !IsForViewers(ShortName(method), *parameters)) {
    return exchange.Reply(
        Refusal(403, "NotPermitted", "this token is for looking on; to call " + method + " takes one for moving"));
  }
  if (parameters->contains("fd"))
    return exchange.Reply(Refusal(400, "BadRequest", "HTTP cannot carry files: leave fd out"));
  Begin(exchange, method, std::move(*parameters));
}

void Service::Begin(Exchange& exchange, const std::string& method, Json parameters) {
  // No client may be kept from stopping a lens by others who wait for something.
  if (ShortName(method) != "Stop" && !Seated(exchange, calls_, "calls")) return;
  if (exchange.Header("Accept").find("text/event-stream") != std::string_view::npos) {
    auto call = std::make_shared<CallStream>(link_, exchange);
    call->Begin(method, std::move(parameters));
    return exchange.Hold(std::move(call));
  }
  auto call = std::make_shared<PlainCall>();
  call->Begin(link_, exchange, method, std::move(parameters));
  exchange.Hold(std::move(call));
}

void Service::Snapshot(Exchange& exchange) {
  if (!Seated(exchange, calls_, "calls")) return;
  auto call = std::make_shared<SnapshotCall>();
  const std::string_view lens = exchange.Query("lens");
  call->Begin(link_, exchange, lens.empty() ? Json::object() : Json{{"lens", lens}});
  exchange.Hold(std::move(call));
}

void Service::Metrics(Exchange& exchange) {
  const OwnMetrics own{.connections = connections_ ? connections_() : 0,
                       .streams = streams_.taken(),
                       .views = views_.open(),
                       .frames = views_.frames,
                       .frames_dropped = views_.dropped};
  if (!Seated(exchange, calls_, "calls")) return;
  auto call = std::make_shared<MetricsCall>(link_, exchange, own);
  call->Begin();
  exchange.Hold(std::move(call));
}

void Service::Stream(Exchange& exchange) {
  if (!Seated(exchange, streams_, "streams")) return;
  if (exchange.path() == "/events") return feed_.Subscribe(exchange, std::string(exchange.Query("lens")));
  const auto key = ReadViewKey(exchange);
  if (!key) return exchange.Reply(Refusal(400, "BadRequest", key.error().message));
  views_.Show(exchange, *key);
}

}  // namespace lensd::web
