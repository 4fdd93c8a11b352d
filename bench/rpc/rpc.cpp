// Starts lensd on a private socket with a simulated lens and asks it the same things again and again, as bytes made
// ready before: what is timed is the daemon and the socket, not a client's JSON. Rounds alternate between the ways, so
// that what slows the machine slows all of them. Then many clients ask for the status at a rate of their own.
#include "bench/rpc/rpc.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <sysexits.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>

#include "base/result.h"
#include "bench/command.h"
#include "bench/outputs.h"
#include "bench/rpc/open_loop.h"
#include "bench/rpc/peers.h"
#include "bench/rpc/private_daemon.h"
#include "io/svg.h"
#include "optics/planner.h"
#include "varlink/client.h"

namespace lensd::bench {
namespace {

using Clock = std::chrono::steady_clock;
using nlohmann::ordered_json;

constexpr const char* kPlanParameters =
    R"({"request":{"limits":[{"name":"near","kind":"sharp","limitUm":8.0,"depths":[{"oneEnd":{"distanceM":1.1},)"
    R"("otherEnd":{"distanceM":1.2}}]},{"name":"far","kind":"blurred","limitUm":20.0,"side":"behind","depths":[)"
    R"({"oneEnd":{"distanceM":4.0},"otherEnd":{"distanceM":6.0}}]}]}})";

optics::PlanRequest SamePlan() {
  using optics::PlanDepth;
  optics::PlanRequest request;
  request.focal_length = 0.025;
  request.f_numbers = {1.4, 16.0};
  request.extensions = {0.0, 0.0016};
  request.limits = {{"near", optics::LimitKind::Sharp, {{PlanDepth::Distance(1.1), PlanDepth::Distance(1.2)}}, 8e-6},
                    {"far",
                     optics::LimitKind::Blurred,
                     {{PlanDepth::Distance(4.0), PlanDepth::Distance(6.0)}},
                     20e-6,
                     optics::Side::Behind}};
  return request;
}

/// A connection that sends bytes and reads to the end of a message.
class RawClient {
 public:
  explicit RawClient(const std::string& path) : socket_(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    connected_ = ::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
    const timeval patience{10, 0};
    ::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  }
  RawClient(const RawClient&) = delete;
  RawClient& operator=(const RawClient&) = delete;
  ~RawClient() { ::close(socket_); }

  /// The reply without its end, if one came.
  std::optional<std::string> Ask(const std::string& message) {
    if (!connected_ || ::send(socket_, message.c_str(), message.size() + 1, MSG_NOSIGNAL) < 0) return std::nullopt;
    std::string reply;
    char buffer[8192];
    while (reply.empty() || reply.back() != '\0') {
      const ssize_t got = ::recv(socket_, buffer, sizeof buffer, 0);
      if (got <= 0) return std::nullopt;
      reply.append(buffer, static_cast<std::size_t>(got));
    }
    reply.pop_back();
    return reply;
  }

 private:
  int socket_;
  bool connected_ = false;
};

std::string Call(const std::string& method, const std::string& parameters) {
  return R"({"method":")" + method + R"(","parameters":)" + parameters + "}";
}

struct Way {
  std::string name;
  bool peer = false;
  RoundTrip round_trip;
  std::vector<double> us{};
};

double At(std::vector<double>& sorted, double share) {
  return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
}

RoundTrip Asking(const std::shared_ptr<RawClient>& client, std::string message) {
  return [client, message = std::move(message)] {
    const std::optional<std::string> reply = client->Ask(message);
    return reply && !reply->starts_with("{\"error\"");
  };
}

Result<std::vector<Way>> WaysTo(const PrivateDaemon& daemon) {
  const auto client = std::make_shared<RawClient>(daemon.socket());
  const std::string plan = Call("io.lensd.Lens.Plan", kPlanParameters);
  const std::optional<std::string> answer = client->Ask(plan);
  if (!answer || answer->find("\"feasible\":true") == std::string::npos) {
    return Fail(Code::Protocol, "lensd did not answer the plan: " + answer.value_or("no reply"));
  }
  const auto whole_client = varlink::Client::Connect(daemon.socket());
  if (!whole_client) return PassOn(whole_client);
  const auto shared = std::make_shared<varlink::Client>(*varlink::Client::Connect(daemon.socket()));
  const std::string get_info = Call("org.varlink.service.GetInfo", "{}");
  const std::optional<std::string> info = client->Ask(get_info);
  if (!info) return Fail(Code::Protocol, "lensd did not answer GetInfo");
  std::vector<Way> ways;
  ways.push_back({"epoll echo, GetInfo's bytes", false, EpollEcho(get_info, *info)});
  ways.push_back({"socket echo, the plan's bytes", false, SocketEcho(plan, *answer)});
  ways.push_back({"sd-bus, the plan's text", true, SdBusCall(plan, *answer)});
  ways.push_back({"lensd GetInfo", false, Asking(client, get_info)});
  ways.push_back({"lensd Status", false, Asking(client, Call("io.lensd.Lens.Status", "{}"))});
  ways.push_back({"lensd Plan, two limits", false, Asking(client, plan)});
  ways.push_back({"lensd Plan, with the client's JSON", false, [shared] {
                    const auto reply = shared->Invoke("io.lensd.Lens.Plan", varlink::Json::parse(kPlanParameters));
                    return reply.has_value() && reply->error.empty();
                  }});
  ways.push_back({"the plan in this process", false, [request = SamePlan()] {
                    const auto planned = optics::Plan(request);
                    return planned && planned->feasible;
                  }});
  return ways;
}

io::Chart ChartOf(const std::vector<ordered_json>& rows) {
  io::Chart chart;
  chart.title = "What a question to the daemon costs";
  chart.subtitle = "one client; half of the round trips are shorter than a dot, 95 % shorter than a cross";
  chart.x = {.label = "round trip", .unit = "us", .scale = io::Scale::Log};
  chart.y = {.label = "way, in the order of the table"};
  chart.legend = io::LegendPlace::None;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double y = static_cast<double>(rows.size() - i);
    chart.points.push_back(
        {.points = {{{rows[i]["roundTripUsP50"].get<double>(), y}, rows[i]["way"]}}, .marker = io::Marker::Dot});
    chart.points.push_back(
        {.points = {{{rows[i]["roundTripUsP95"].get<double>(), y}, ""}}, .marker = io::Marker::Cross});
  }
  return chart;
}

ordered_json RowOf(const std::string& way, bool peer, std::vector<double>& us, double get_info) {
  std::ranges::sort(us);
  return {{"way", way},
          {"peer", peer},
          {"roundTrips", us.size()},
          {"roundTripUsP50", At(us, 0.5)},
          {"roundTripUsP95", At(us, 0.95)},
          {"roundTripUsP99", At(us, 0.99)},
          {"roundTripUsP999", At(us, 0.999)},
          {"beyondGetInfoUs", At(us, 0.5) - get_info}};
}

/// One after the other, in turn.
Result<void> Time(std::vector<Way>& ways, int rounds) {
  constexpr int kWarmUp = 200;
  for (int round = -kWarmUp; round < rounds; ++round) {
    for (Way& way : ways) {
      const auto start = Clock::now();
      if (!way.round_trip()) return Fail(Code::Protocol, way.name + ": no good answer");
      if (round >= 0) way.us.push_back(std::chrono::duration<double, std::micro>(Clock::now() - start).count());
    }
  }
  return {};
}

Result<std::vector<ordered_json>> OneByOne(int rounds) {
  const auto daemon = PrivateDaemon::Start(1);
  if (!daemon) return PassOn(daemon);
  auto ways = WaysTo(**daemon);
  if (!ways) return PassOn(ways);
  if (auto timed = Time(*ways, rounds); !timed) return PassOn(timed);
  auto& get_info = std::ranges::find(*ways, "lensd GetInfo", &Way::name)->us;
  std::ranges::sort(get_info);
  std::vector<ordered_json> rows;
  for (Way& way : *ways) rows.push_back(RowOf(way.name, way.peer, way.us, At(get_info, 0.5)));
  return rows;
}

std::string Counted(int count, const std::string& what, const std::string& whats) {
  return std::to_string(count) + " " + (count == 1 ? what : whats);
}

int Bench(const Outputs& outputs, int rounds, int calls) {
  const auto fail = [](const Error& error) {
    std::cerr << "lens-bench rpc: " << error.message << "\n";
    return EX_UNAVAILABLE;
  };
  auto rows = OneByOne(rounds);
  if (!rows) return fail(rows.error());
  const double get_info =
      rows->front()["roundTripUsP50"].get<double>() - rows->front()["beyondGetInfoUs"].get<double>();
  for (const auto& [lenses, clients] :
       {std::pair(1, 1), std::pair(1, 64), std::pair(4, 16), std::pair(16, 1), std::pair(16, 64)}) {
    auto us = AskAtRate(lenses, clients, calls);
    if (!us) return fail(us.error());
    rows->push_back(RowOf("Status: " + Counted(lenses, "lens", "lenses") + ", " + Counted(clients, "client", "clients"),
                          false, *us, get_info));
  }
  return WriteOutputs("lens-bench rpc", *rows, {}, outputs, [&] { return io::ChartsSvg({ChartOf(*rows)}, 1); });
}

}  // namespace

int RunRpc(int argc, char** argv) {
  Outputs outputs;
  int rounds = 3000, calls = 5000;
  CLI::App app("What a question to the daemon costs: round trips to a private lensd, a bare socket and sd-bus.",
               argv[0]);
  app.add_option("--rounds", rounds, "round trips of each way")->check(CLI::Range(10, 1000000))->capture_default_str();
  app.add_option("--calls", calls,
                 "calls at 1,000 a second, each time: from one lens and one client to 16 lenses and 64")
      ->check(CLI::Range(100, 1000000))
      ->capture_default_str();
  app.add_option("--csv", outputs.csv, "write every figure to this file");
  app.add_option("--svg", outputs.svg, "write the chart to this file");
  app.add_flag("--json", outputs.as_json, "one line of JSON instead of the table");
  return ParseThen(app, argc, argv, [&] { return Bench(outputs, rounds, calls); });
}

}  // namespace lensd::bench
