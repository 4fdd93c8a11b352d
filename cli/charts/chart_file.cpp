// rsvg-convert reads and writes anonymous files in memory: no pipe fills up, no name can be mistaken for an option, and
// what it did not end in time is never seen. No shell is between.
#include "cli/charts/chart_file.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <sstream>
#include <utility>

#include "io/atomic_file.h"
#include "io/svg_colours.h"

namespace lensd::cli {
namespace {

constexpr const char* kProgram = "rsvg-convert";
constexpr int kPatienceMs = 60'000;

bool IsPng(const std::string& file) {
  return file.ends_with(".png");
}

/// A file in memory that ends with this.
class MemoryFile {
 public:
  explicit MemoryFile(const char* name) : descriptor_(memfd_create(name, MFD_CLOEXEC)) {}
  ~MemoryFile() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  int descriptor() const { return descriptor_; }
  bool Fill(const std::string& text) const {
    for (std::size_t done = 0; done < text.size();) {
      const ssize_t count = write(descriptor_, text.data() + done, text.size() - done);
      if (count < 0 && errno != EINTR) return false;
      if (count > 0) done += static_cast<std::size_t>(count);
    }
    return lseek(descriptor_, 0, SEEK_SET) == 0;
  }
  std::string Text() const {
    std::string text;
    std::array<char, 65536> buffer{};
    for (off_t at = 0;; at = static_cast<off_t>(text.size())) {
      const ssize_t count = pread(descriptor_, buffer.data(), buffer.size(), at);
      if (count <= 0) return text;
      text.append(buffer.data(), static_cast<std::size_t>(count));
    }
  }

 private:
  const int descriptor_;
};

bool Installed() {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path != nullptr ? path : "/usr/bin:/bin");
  for (std::string folder; std::getline(folders, folder, ':');) {
    if (access((folder + "/" + kProgram).c_str(), X_OK) == 0) return true;
  }
  return false;
}

std::string NotInstalled(const PlotText& text) {
  const std::string& file = text.file;
  return text.option + " '" + file + "': a PNG needs the program " + kProgram +
         ", which is not installed: sudo apt install librsvg2-bin, or name an SVG, as in " +
         file.substr(0, file.size() - 4) + ".svg";
}

/// Its wait status; nothing where it had to be ended.
std::optional<int> Await(pid_t child) {
  const int ended = static_cast<int>(syscall(SYS_pidfd_open, child, 0));  // glibc 2.36 declares its own for C alone
  pollfd waiting{.fd = ended, .events = POLLIN, .revents = 0};
  int ready = -1;
  do {
    ready = poll(&waiting, 1, kPatienceMs);
  } while (ready < 0 && errno == EINTR);
  if (ended >= 0) close(ended);
  if (ready <= 0) kill(child, SIGKILL);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return ready > 0 ? std::optional(status) : std::nullopt;
}

std::expected<std::string, Failure> PngOf(const std::string& svg, const PlotText& text) {
  const std::string& file = text.file;
  const MemoryFile in("chart.svg"), out("chart.png"), said("said");
  if (said.descriptor() < 0 || !in.Fill(svg)) return Refuse(Exit::CannotWrite, file + ": " + std::strerror(errno));
  posix_spawn_file_actions_t streams;
  posix_spawn_file_actions_init(&streams);
  posix_spawn_file_actions_adddup2(&streams, in.descriptor(), STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&streams, out.descriptor(), STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&streams, said.descriptor(), STDERR_FILENO);
  std::array<std::string, 3> words = {kProgram, "--format=png", "--zoom=2"};
  std::array<char*, 4> arguments = {words[0].data(), words[1].data(), words[2].data(), nullptr};
  pid_t child = 0;
  const int failed = posix_spawnp(&child, kProgram, &streams, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&streams);
  if (failed == ENOENT) return Refuse(Exit::CannotWrite, NotInstalled(text));
  if (failed != 0) return Refuse(Exit::CannotWrite, std::string(kProgram) + ": " + std::strerror(failed));
  const auto status = Await(child);
  if (!status) return Refuse(Exit::Timeout, file + ": " + kProgram + " took more than 60 s; nothing has been written");
  std::string png = out.Text();
  if (WIFEXITED(*status) && WEXITSTATUS(*status) == 0 && png.starts_with("\x89PNG")) return png;
  const std::string why = said.Text();
  return Refuse(Exit::CannotWrite, file + ": " + kProgram + " failed" +
                                       (why.empty() ? "" : ": " + why.substr(0, why.find('\n'))) +
                                       "; nothing has been written. An SVG needs no program: name it .svg");
}

io::Theme ThemeOf(const PlotText& text) {
  if (text.theme.empty()) return IsPng(text.file) ? io::Theme::Light : io::Theme::Viewer;
  return text.theme == "dark" ? io::Theme::Dark : io::Theme::Light;
}

}  // namespace

void AddPlotOptions(CLI::App& command, PlotText& text, const std::string& what, const std::string& group) {
  CLI::Option* plot =
      command.add_option("--plot", text.file, "draw " + what + ", as F.svg or F.png")->type_name("FILE");
  CLI::Option* theme = command
                           .add_option("--plot-theme", text.theme,
                                       "light or dark; when left out, an SVG follows its viewer and a PNG is light")
                           ->type_name("THEME")
                           ->needs(plot);
  if (group.empty()) return;
  plot->group(group);
  theme->group(group);
}

void AddRaysOption(CLI::App& command, PlotText& rays, const std::string& group) {
  rays.option = "--rays";
  CLI::Option* option = command
                            .add_option("--rays", rays.file,
                                        "draw the path of the light through the lens to the sensor, as F.svg or F.png")
                            ->type_name("FILE");
  command.get_option("--plot-theme")->remove_needs(command.get_option("--plot"));
  if (!group.empty()) option->group(group);
}

PlotText RaysInTheme(const PlotText& plot, const PlotText& rays) {
  PlotText themed = rays;
  themed.theme = plot.theme;
  return themed;
}

std::expected<void, Failure> CheckPlots(const PlotText& plot, const PlotText& rays) {
  if (!plot.theme.empty() && !plot.wanted() && !rays.wanted()) {
    return Refuse(Exit::Usage, "--plot-theme is of a drawing: name its file with --plot or --rays");
  }
  if (auto good = CheckPlot(plot); !good) return good;
  return CheckPlot(RaysInTheme(plot, rays));
}

std::expected<void, Failure> CheckPlot(const PlotText& text) {
  if (!text.wanted()) return {};
  if (!text.theme.empty() && text.theme != "light" && text.theme != "dark") {
    return Refuse(Exit::Usage, "--plot-theme '" + text.theme + "': say light or dark, as in --plot-theme dark");
  }
  if (!IsPng(text.file) && !text.file.ends_with(".svg")) {
    return Refuse(Exit::Usage,
                  text.option + " '" + text.file + "': charts are SVG or PNG, so the name has to end in .svg or .png");
  }
  if (IsPng(text.file) && !Installed()) return Refuse(Exit::CannotWrite, NotInstalled(text));
  return {};
}

std::expected<void, Failure> WritePlot(const PlotText& text, const std::string& svg) {
  if (!text.wanted()) return {};
  if (auto good = CheckPlot(text); !good) return good;
  std::string content = io::InTheme(svg, ThemeOf(text));
  if (IsPng(text.file)) {
    auto png = PngOf(content, text);
    if (!png) return PassOn(png);
    content = *std::move(png);
  }
  if (auto written = io::WriteFileAtomically(text.file, content); !written) {
    return RefuseOutput(written);
  }
  return {};
}

}  // namespace lensd::cli
