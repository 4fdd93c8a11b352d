// Starts lensd on a private socket with a simulated lens and asks it the same things again and again, as bytes made
// ready before: what is timed is the daemon and the socket, not a client's JSON. Rounds alternate between the ways, so
// that what slows the machine slows all of them.
#include "bench/rpc/rpc.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <sysexits.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "base/result.h"
#include "bench/command.h"
#include "bench/outputs.h"
#include "bench/rpc/peers.h"
#include "io/svg.h"
#include "optics/planner.h"
#include "varlink/client.h"

namespace lensd::bench {
namespace {

using Clock = std::chrono::steady_clock;
using nlohmann::ordered_json;

constexpr const char* kScene = R"(version = 1
[camera]
width = 64
height = 48
pixel_um = 3.45
[lens]
model = "thin"
focal_length_mm = 25.0
f_number = [1.4, 16.0]
extension_mm = [0.0, 1.6]
steps = 8192
[[surface]]
kind = "wall"
distance_m = 1.2
constant = 0.5
)";

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

/// lensd with one simulated lens in a folder of its own; both go with this object.
class PrivateDaemon {
 public:
  static Result<std::unique_ptr<PrivateDaemon>> Start() {
    std::unique_ptr<PrivateDaemon> daemon(new PrivateDaemon);
    const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe");
    const std::string program = self.parent_path() / "lensd";
    std::ofstream(daemon->folder_ + "/scene.toml") << kScene;
    std::ofstream(daemon->folder_ + "/lensd.toml")
        << "version = 1\n[[lens]]\nname = \"a\"\ndriver = \"sim\"\nscene = \"scene.toml\"\n";
    const std::string config = daemon->folder_ + "/lensd.toml", socket = daemon->socket();
    const char* arguments[] = {program.c_str(), "--config", config.c_str(), "--socket", socket.c_str(), nullptr};
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    const int failed = ::posix_spawn(&daemon->process_, program.c_str(), &actions, nullptr,
                                     const_cast<char* const*>(arguments), environ);
    posix_spawn_file_actions_destroy(&actions);
    if (failed != 0) return Fail(Code::Disconnected, "cannot start " + program + ", which belongs beside lens-bench");
    const auto deadline = Clock::now() + std::chrono::seconds(20);
    while (!varlink::Client::Connect(socket)) {
      if (Clock::now() > deadline || ::waitpid(daemon->process_, nullptr, WNOHANG) != 0) {
        return Fail(Code::Disconnected, program + " did not open its socket");
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return daemon;
  }
  PrivateDaemon(const PrivateDaemon&) = delete;
  PrivateDaemon& operator=(const PrivateDaemon&) = delete;
  ~PrivateDaemon() {
    if (process_ > 0 && ::kill(process_, SIGTERM) == 0) ::waitpid(process_, nullptr, 0);
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  std::string socket() const { return folder_ + "/s"; }

 private:
  PrivateDaemon() {
    std::string pattern = std::filesystem::temp_directory_path() / "lens-bench-XXXXXX";
    if (::mkdtemp(pattern.data()) != nullptr) folder_ = pattern;
  }

  std::string folder_;
  pid_t process_ = -1;
};

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
  std::vector<Way> ways;
  ways.push_back({"socket echo, the plan's bytes", false, SocketEcho(plan, *answer)});
  ways.push_back({"sd-bus, the plan's text", true, SdBusCall(plan, *answer)});
  ways.push_back({"lensd GetInfo", false, Asking(client, Call("org.varlink.service.GetInfo", "{}"))});
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

int Bench(const Outputs& outputs, int rounds) {
  const auto fail = [](const Error& error) {
    std::cerr << "lens-bench rpc: " << error.message << "\n";
    return EX_UNAVAILABLE;
  };
  const auto daemon = PrivateDaemon::Start();
  if (!daemon) return fail(daemon.error());
  auto ways = WaysTo(**daemon);
  if (!ways) return fail(ways.error());
  constexpr int kWarmUp = 200;
  for (int round = -kWarmUp; round < rounds; ++round) {
    for (Way& way : *ways) {
      const auto start = Clock::now();
      if (!way.round_trip()) return fail({Code::Protocol, way.name + ": no good answer"});
      if (round >= 0) way.us.push_back(std::chrono::duration<double, std::micro>(Clock::now() - start).count());
    }
  }
  std::vector<ordered_json> rows;
  double get_info = 0.0;
  for (Way& way : *ways) {
    std::ranges::sort(way.us);
    if (way.name == "lensd GetInfo") get_info = At(way.us, 0.5);
  }
  for (Way& way : *ways) {
    rows.push_back({{"way", way.name},
                    {"peer", way.peer},
                    {"roundTrips", rounds},
                    {"roundTripUsP50", At(way.us, 0.5)},
                    {"roundTripUsP95", At(way.us, 0.95)},
                    {"beyondGetInfoUs", At(way.us, 0.5) - get_info}});
  }
  return WriteOutputs("lens-bench rpc", rows, {}, outputs, [&] { return io::ChartsSvg({ChartOf(rows)}, 1); });
}

}  // namespace

int RunRpc(int argc, char** argv) {
  Outputs outputs;
  int rounds = 3000;
  CLI::App app("What a question to the daemon costs: round trips to a private lensd, a bare socket and sd-bus.",
               argv[0]);
  app.add_option("--rounds", rounds, "round trips of each way")->check(CLI::Range(10, 1000000))->capture_default_str();
  app.add_option("--csv", outputs.csv, "write every figure to this file");
  app.add_option("--svg", outputs.svg, "write the chart to this file");
  app.add_flag("--json", outputs.as_json, "one line of JSON instead of the table");
  return ParseThen(app, argc, argv, [&] { return Bench(outputs, rounds); });
}

}  // namespace lensd::bench
