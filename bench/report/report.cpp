// The command `report`: every family run as a process of its own, its figures put on one page.
#include "bench/report/report.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/utsname.h>
#include <sys/wait.h>
#include <sysexits.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <csignal>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <sstream>
#include <thread>
#include <vector>

#include "base/result.h"
#include "bench/command.h"
#include "io/png.h"
#include "varlink/base64.h"

namespace lensd::bench {
namespace {

namespace fs = std::filesystem;

struct Options {
  std::string directory;
  std::string scenes = "scenes/score";
  int runs = 5;
  bool quick = false;
  int minutes = 30;
};

/// One family: how it is run, and what came of it.
struct Section {
  std::string name;
  std::string about;
  std::vector<std::string> arguments;
  std::string text = {};  ///< its table, and what it said on stderr
  int status = 0;         ///< exit status; -1: it did not end by itself
  double seconds = 0.0;
};

std::string Contents(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::string Escaped(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    if (c == '<')
      escaped += "&lt;";
    else if (c == '>')
      escaped += "&gt;";
    else if (c == '&')
      escaped += "&amp;";
    else
      escaped += c;
  }
  return escaped;
}

std::vector<Section> SectionsOf(const Options& options, const std::vector<std::string>& scenes) {
  std::vector<std::string> autofocus = {"--method", "all", "--runs", std::to_string(options.quick ? 1 : options.runs)};
  for (const std::string& scene : scenes) autofocus.insert(autofocus.end(), {"--scene", scene});
  const auto when = [&](std::vector<std::string> arguments) {
    return options.quick ? std::move(arguments) : std::vector<std::string>{};
  };
  return {
      {"autofocus", "Every method on the scoring scenes, each run from another start with other noise.", autofocus},
      {"plan", "The planner against its peers: time and error on the same problems.",
       when({"--quick", "--rounds", "1"})},
      {"measure", "Focus measures against OpenCV's and one read of the memory.",
       when({"--width", "640", "--height", "480", "--repeats", "3"})},
      {"render", "Renderers and their peers: time against error, cost against the disk's diameter.",
       when({"--width", "640", "--height", "480", "--repeats", "1", "--only", "disks"})},
      {"rpc", "What a question to the daemon costs, beside a bare socket and sd-bus.", when({"--rounds", "100"})},
      {"move", "A step of a ringing actuator, raw and shaped: what is left when.", when({"--points", "3"})},
  };
}

/// Runs the section as a process of its own, its output into a file. False: it could not be started.
bool Run(Section& section, const fs::path& directory, std::chrono::minutes patience) {
  const fs::path output = directory / (section.name + ".txt");
  std::vector<std::string> words = {"/proc/self/exe", section.name};
  words.insert(words.end(), section.arguments.begin(), section.arguments.end());
  for (const char* kind : {"csv", "svg"}) {
    words.insert(words.end(), {std::string("--") + kind, directory / (section.name + "." + kind)});
  }
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, output.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  posix_spawn_file_actions_adddup2(&files, STDOUT_FILENO, STDERR_FILENO);
  pid_t child = 0;
  const int failed = posix_spawn(&child, "/proc/self/exe", &files, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  if (failed != 0) return false;
  const auto began = std::chrono::steady_clock::now();
  int status = 0;
  while (waitpid(child, &status, WNOHANG) == 0) {
    if (std::chrono::steady_clock::now() > began + patience) {
      kill(child, SIGKILL);
      waitpid(child, &status, 0);
      break;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  section.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  section.status = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  section.text = Contents(output);
  fs::remove(output);
  return true;
}

std::string Machine() {
  std::ifstream cpus("/proc/cpuinfo");
  std::string line, model = "unknown processor";
  while (std::getline(cpus, line)) {
    if (!line.starts_with("model name")) continue;
    model = line.substr(line.find(':') + 2);
    break;
  }
  utsname name{};
  uname(&name);
  return model + ", " + std::to_string(std::thread::hardware_concurrency()) + " threads, " + name.sysname + " " +
         name.release;
}

std::string PageOf(const std::vector<Section>& sections, const fs::path& directory, bool quick) {
  std::ostringstream page;
  const std::time_t now = std::time(nullptr);
  char date[32];
  std::strftime(date, sizeof date, "%Y-%m-%d %H:%M", std::localtime(&now));
  page << "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>lens-bench report</title>\n<style>\n"
          "body{font:16px/1.45 sans-serif;max-width:1500px;margin:2em auto;padding:0 1em;color:#222}\n"
          "pre{font:12px/1.35 monospace;background:#f6f6f4;padding:1em;overflow-x:auto}\n"
          "img{max-width:100%;border:1px solid #ddd}.failed{color:#b00020;font-weight:bold}code{background:#f6f6f4}\n"
          "</style></head><body>\n<h1>lens-bench report</h1>\n<p>"
       << date << " on " << Escaped(Machine()) << "."
       << (quick
               ? " <b>Quick: too few runs and too small pictures for figures; this only shows that all of it works.</b>"
               : "")
       << "</p>\n<ul>\n";
  for (const Section& section : sections) {
    page << "<li><a href=\"#" << section.name << "\">" << section.name << "</a>: " << Escaped(section.about)
         << "</li>\n";
  }
  page << "</ul>\n";
  for (const Section& section : sections) {
    page << "<h2 id=\"" << section.name << "\">" << section.name << "</h2>\n<p>" << Escaped(section.about)
         << "</p>\n<p><code>lens-bench " << section.name;
    for (const std::string& argument : section.arguments) page << " " << Escaped(argument);
    page << "</code>, " << static_cast<long>(section.seconds + 0.5) << " s</p>\n";
    if (section.status != 0) {
      page << "<p class=\"failed\">"
           << (section.status < 0 ? "It did not end by itself."
                                  : "It failed with exit status " + std::to_string(section.status) + ".")
           << "</p>\n";
    }
    page << "<pre>" << Escaped(section.text) << "</pre>\n";
    const std::string chart = Contents(directory / (section.name + ".svg"));
    if (section.status == 0 && !chart.empty()) {
      page << "<img alt=\"" << section.name << "\" src=\"data:image/svg+xml;base64,"
           << varlink::EncodeBase64({reinterpret_cast<const std::uint8_t*>(chart.data()), chart.size()}) << "\">\n";
    }
  }
  page << "</body></html>\n";
  return page.str();
}

int Complain(const std::string& what, int status) {
  std::cerr << "lens-bench report: " << what << "\n";
  return status;
}

int Report(const Options& options) {
  std::error_code trouble;
  std::vector<std::string> scenes;
  for (const auto& entry : fs::directory_iterator(options.scenes, trouble)) {
    if (entry.path().extension() == ".toml") scenes.push_back(entry.path());
  }
  if (scenes.empty()) return Complain("no scene files in " + options.scenes + "; say --scenes FOLDER", EX_NOINPUT);
  std::ranges::sort(scenes);
  if (options.quick) scenes.resize(1);
  fs::create_directories(options.directory, trouble);
  if (trouble) return Complain("cannot make " + options.directory + ": " + trouble.message(), EX_CANTCREAT);
  std::vector<Section> sections = SectionsOf(options, scenes);
  int failures = 0;
  for (Section& section : sections) {
    std::cerr << section.name << " ..." << std::flush;
    if (!Run(section, options.directory, std::chrono::minutes(options.minutes))) {
      return Complain("cannot start " + section.name, EX_OSERR);
    }
    failures += section.status != 0;
    std::cerr << (section.status == 0 ? " done" : " FAILED") << " after " << static_cast<long>(section.seconds + 0.5)
              << " s\n";
  }
  const std::string page = PageOf(sections, options.directory, options.quick);
  const std::string path = fs::path(options.directory) / "report.html";
  if (auto written = io::WriteFileAtomically(path, page.data(), page.size()); !written) {
    return Complain(written.error().message, EX_IOERR);
  }
  std::cout << path << "\n";
  return failures == 0 ? EX_OK : EX_SOFTWARE;
}

}  // namespace

int RunReport(int argc, char** argv) {
  CLI::App app(
      "Runs autofocus, plan, measure, render, rpc and move one after the other and writes their tables and charts as "
      "one\n"
      "self-contained page, report.html, beside each one's CSV and SVG. Takes some ten minutes on a quiet machine.");
  Options options;
  app.add_option("-o,--output", options.directory, "folder, made where it is missing")->required();
  app.add_option("--scenes", options.scenes, "folder of the scene files for autofocus")->capture_default_str();
  app.add_option("--runs", options.runs, "of each autofocus method on each scene")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  app.add_option("--minutes", options.minutes, "longest time for one of them")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  app.add_flag("--quick", options.quick, "as little of everything as shows that it works");
  return ParseThen(app, argc, argv, [&] { return Report(options); });
}

}  // namespace lensd::bench
