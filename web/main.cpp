// lens-web: lensd's interface as HTTP, and a page for people. A client of lensd like any other: if it ends, nothing
// moves and nothing stops.
#include <signal.h>
#include <sysexits.h>
#include <systemd/sd-daemon.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "loop/web_event_loop.h"
#include "proto/interfaces.h"
#include "web/access.h"
#include "web/alpaca/alpaca.h"
#include "web/http_server.h"
#include "web/link/lensd_link.h"
#include "web/service.h"

namespace lensd::web {
namespace {

constexpr std::size_t kLongestPath = 107;  // of a Unix socket

struct Options {
  std::string socket{proto::kDefaultSocket};
  std::string listen = "127.0.0.1:8480";
  std::optional<std::string> token_file{};
  std::vector<std::string> hosts{};
  std::string alpaca{};  ///< empty: none
};

/// The options, or the exit status where there is nothing more to do.
std::variant<Options, int> ParseOptions(int argc, char** argv) {
  Options options;
  std::string token_file;
  CLI::App app("lens-web: a page and HTTP for the lenses of lensd", "lens-web");
  app.set_version_flag("--version", "lens-web " LENSD_VERSION);
  app.add_option("--socket", options.socket, "where lensd listens")
      ->type_name("PATH")
      ->envname("LENSD_SOCKET")
      ->capture_default_str();
  app.add_option("--listen", options.listen,
                 "where to listen, unless systemd passes a socket; port 0 takes any free port")
      ->type_name("ADDRESS:PORT")
      ->capture_default_str();
  app.add_option("--token-file", token_file,
                 "file with lines \"view TOKEN\" and \"move TOKEN\"; without it everybody on this machine may do "
                 "everything, and\n"
                 "other machines cannot connect")
      ->type_name("FILE");
  app.add_option("--host", options.hosts, "another host name that browsers use, for example behind a proxy")
      ->type_name("NAME");
  app.add_option(
         "--alpaca", options.alpaca,
         "also serve the focusers by ASCOM Alpaca, and answer its discovery. Alpaca has no tokens: everybody who can\n"
         "connect can move the lenses")
      ->type_name("ADDRESS:PORT");
  app.footer("Exit status: 0 after SIGTERM or SIGINT, else as in sysexits.h: 64 usage, 74 input or output, 78 tokens.");
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& asked) {
    return app.exit(asked);
  } catch (const CLI::ParseError& error) {
    std::fprintf(stderr, "lens-web: %s; see lens-web --help\n", error.what());
    return EX_USAGE;
  }
  if (options.socket.empty() || options.socket.size() > kLongestPath) {
    std::fprintf(stderr, "lens-web: --socket has 1 to %zu characters\n", kLongestPath);
    return EX_USAGE;
  }
  if (!token_file.empty()) options.token_file = token_file;
  return options;
}

int Explain(const Error& error) {
  std::fprintf(stderr, "lens-web: %s\n", error.message.c_str());
  if (error.code == Code::BadData) return EX_CONFIG;
  return error.code == Code::InvalidArgument ? EX_USAGE : EX_IOERR;
}

/// What is served by ASCOM Alpaca beside the page.
class AlpacaSide {
 public:
  explicit AlpacaSide(const LensdLink& link) : service_(link) {}
  /// Nothing where `where` is empty.
  Result<void> Begin(EventLoop& loop, const std::string& where);

 private:
  Alpaca service_;
  std::unique_ptr<HttpServer> server_;
  std::unique_ptr<AlpacaDiscovery> discovery_;
};

Result<void> AlpacaSide::Begin(EventLoop& loop, const std::string& where) {
  if (where.empty()) return {};
  const auto endpoint = Listen(where);
  if (!endpoint) return PassOn(endpoint);
  auto server =
      HttpServer::Create(loop, *endpoint, Alpaca::Gate, [this](Exchange& exchange) { service_.Handle(exchange); });
  if (!server) return PassOn(server);
  server_ = std::move(*server);
  auto discovery = AlpacaDiscovery::Create(loop, endpoint->port);
  if (!discovery) return PassOn(discovery);
  discovery_ = std::move(*discovery);
  std::printf("Alpaca at %s:%d\n", endpoint->address.c_str(), endpoint->port);
  return {};
}

int Serve(const Options& options) {
  auto loop = EventLoop::Create();
  if (!loop) return Explain(loop.error());
  if (auto watched = (*loop)->QuitOnSignals(); !watched) return Explain(watched.error());
  const auto endpoint = Listen(options.listen);
  if (!endpoint) return Explain(endpoint.error());
  auto access = Access::Create(*endpoint, options.hosts, options.token_file);
  if (!access) return Explain(access.error());
  const LensdLink link(**loop, options.socket);
  Service service(link, std::move(*access));
  auto server = HttpServer::Create(
      **loop, *endpoint, [&service](const Exchange& exchange) { return service.Gate(exchange); },
      [&service](Exchange& exchange) { service.Handle(exchange); });
  if (!server) return Explain(server.error());
  service.CountConnections([&server] { return (*server)->connections(); });
  AlpacaSide alpaca(link);
  if (auto begun = alpaca.Begin(**loop, options.alpaca); !begun) return Explain(begun.error());
  // Programs that start it read the line of the page to learn its port.
  std::printf("http://%s:%d/\n", endpoint->address.c_str(), endpoint->port);
  std::fflush(stdout);
  sd_notify(0, "READY=1");
  const auto ended = (*loop)->Run();
  return ended ? EX_OK : Explain(ended.error());
}

int Main(int argc, char** argv) {
  const auto options = ParseOptions(argc, argv);
  if (const int* status = std::get_if<int>(&options)) return *status;
  sigset_t blocked;
  sigemptyset(&blocked);
  sigaddset(&blocked, SIGTERM);
  sigaddset(&blocked, SIGINT);
  sigprocmask(SIG_BLOCK, &blocked, nullptr);
  signal(SIGPIPE, SIG_IGN);
  return Serve(std::get<Options>(options));
}

}  // namespace
}  // namespace lensd::web

int main(int argc, char** argv) {
  try {
    return lensd::web::Main(argc, argv);
  } catch (const std::exception& failure) {
    std::fprintf(stderr, "lens-web: internal error: %s\n", failure.what());
    return EX_SOFTWARE;
  }
}
