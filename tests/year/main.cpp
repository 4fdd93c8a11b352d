// The program year: days of it, each from a seed of its own and in a process of its own; or one of them again.
#include <stdlib.h>
#include <sys/personality.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "disk.h"
#include "test_level.h"
#include "year.h"

namespace lensd::year {
namespace {

constexpr const char* kHelp = R"(usage: year [OPTION ...]
Runs lensd with 16 simulated lenses, clients, faults, disk errors, kills and power cuts, all under one clock and one
scheduler drawn from a seed, and holds what it says against the truth. Exit status 1: something was found.
  --days N        N runs with the seeds SEED, SEED+1, ... (1)
  --seed SEED     of the first (1)
  --hours H       simulated, of each run (24)
  --pace P        everything happens P times as often (1)
  --jobs N        runs at the same time (1)
  --level         N, H, P and J by LENSD_TEST_LEVEL: fast, ci, or long: a year, for a night
  --twice         each run twice and a third time without jumps of the time of day: the traces must be the same
  --trace FILE    writes what one run does, to compare
  --no-jumps      the time of day does not jump
  --planted NAME  with a fault: hidden-backlash, ignored-stop, long-lease, lying-disk
Examples:
  year --seed 42 --trace trace.txt          one day again, exactly
  year --days 365 --jobs 2                  a year
)";

struct Options {
  Wish wish;
  std::uint64_t days = 1;
  std::size_t jobs = 1;
  bool twice = false;
};

/// How much: for an edit, for CI (a quarter of a minute of processor time), or for a night.
void ByLevel(Options& options) {
  options.days = static_cast<std::uint64_t>(testing::ByLevel(1, 2, 365));
  options.jobs = static_cast<std::size_t>(testing::ByLevel(1, 1, 2));
  options.wish.hours = 0.5 * static_cast<double>(testing::ByLevel(1, 1, 48));
  options.wish.pace = static_cast<double>(testing::ByLevel(20, 20, 1));
}

bool Plant(Options& options, const std::string& name) {
  Planted& planted = options.wish.planted;
  const std::map<std::string, bool*> faults = {{"hidden-backlash", &planted.backlash_hidden},
                                               {"ignored-stop", &planted.stop_ignored},
                                               {"long-lease", &planted.lease_late},
                                               {"lying-disk", &planted.disk_lies}};
  const auto found = faults.find(name);
  if (found == faults.end()) return false;
  options.wish.planted_name = name;
  return *found->second = true;
}

bool Read(Options& options, const std::string& name, const char* value) {
  Wish& wish = options.wish;
  if (name == "--days")
    options.days = std::strtoull(value, nullptr, 10);
  else if (name == "--seed")
    wish.seed = std::strtoull(value, nullptr, 10);
  else if (name == "--hours")
    wish.hours = std::strtod(value, nullptr);
  else if (name == "--pace")
    wish.pace = std::strtod(value, nullptr);
  else if (name == "--jobs")
    options.jobs = std::strtoull(value, nullptr, 10);
  else if (name == "--trace")
    wish.trace = std::filesystem::absolute(value).string();
  else if (name == "--planted")
    return Plant(options, value);
  else
    return false;
  return true;
}

std::string Commit() {
  std::string commit;
  if (std::FILE* const git = popen("git -C " LENSD_SOURCE_DIR " rev-parse --short HEAD 2>/dev/null", "r")) {
    char letters[64] = {};
    if (std::fgets(letters, sizeof letters, git) != nullptr) commit.assign(letters, std::strcspn(letters, "\n"));
    pclose(git);
  }
  return commit.empty() ? "unknown" : commit;
}

std::string Again(const Wish& wish) {
  char text[256];
  std::snprintf(text, sizeof text, "year --seed %llu --hours %g --pace %g%s%s",
                static_cast<unsigned long long>(wish.seed), wish.hours, wish.pace,
                wish.planted_name.empty() ? "" : " --planted ", wish.planted_name.c_str());
  return text;
}

/// One run, in this process, whose end it is.
[[noreturn]] void RunHere(const Wish& wish, int report) {
  char folder[] = "/dev/shm/lensd-year-XXXXXX";
  if (mkdtemp(folder) == nullptr || chdir(folder) != 0) _exit(2);
  const rlimit at_most{1800, 1800};  // s: who hangs without end is a find too
  setrlimit(RLIMIT_CPU, &at_most);
  const std::string commit = Commit();
  machine::OnFound([&] {
    std::filesystem::remove_all(folder);
    return "seed " + std::to_string(wish.seed) + " commit " + commit + " step " + std::to_string(machine::Steps()) +
           " at " + std::to_string(1e-9 * static_cast<double>(machine::Now())) + " s; again: " + Again(wish);
  });
  if (!wish.trace.empty()) machine::TraceTo(wish.trace);
  machine::Begin(wish.seed);
  Year& year = *new Year(wish);  // what killed lives left points into it
  year.Run();
  const Figure hash{"", machine::TraceHash()};
  (void)!write(report, &hash, sizeof hash);
  for (const Figure& figure : year.figures()) (void)!write(report, &figure, sizeof figure);
  std::filesystem::remove_all(folder);
  std::fflush(nullptr);
  _exit(0);
}

/// A run in a process of its own.
struct Child {
  pid_t process = -1;
  int report = -1;
};

Child Start(const Wish& wish) {
  int ends[2];
  if (pipe(ends) != 0) _exit(2);
  std::fflush(nullptr);
  const pid_t process = fork();
  if (process == 0) {
    close(ends[0]);
    RunHere(wish, ends[1]);
  }
  close(ends[1]);
  return {process, ends[0]};
}

/// What it reported, its trace first; empty: it found something. The names are literals of this same program.
Figures End(const Child& child) {
  Figures figures;
  Figure figure;
  while (read(child.report, &figure, sizeof figure) == sizeof figure) figures.push_back(figure);
  close(child.report);
  int status = 0;
  waitpid(child.process, &status, 0);
  if (WIFSIGNALED(status)) std::fprintf(stderr, "year: FOUND: a run ended by signal %d\n", WTERMSIG(status));
  return status == 0 ? figures : Figures{};
}

/// The same three times, the last one with a time of day that does not jump.
bool SameTwice(Wish wish) {
  const Figures first = End(Start(wish)), second = End(Start(wish));
  wish.wall_jumps = false;
  const Figures steady = End(Start(wish));
  if (first.empty() || second.empty() || steady.empty()) return false;
  std::printf("seed %llu: trace %016llx, again %016llx, with a steady time of day %016llx\n",
              static_cast<unsigned long long>(wish.seed), static_cast<unsigned long long>(first[0].value),
              static_cast<unsigned long long>(second[0].value), static_cast<unsigned long long>(steady[0].value));
  return first[0].value == second[0].value && first[0].value == steady[0].value;
}

void Add(Figures& sums, const Figures& figures) {
  if (sums.empty()) return sums.assign(figures.begin(), figures.end());
  for (std::size_t i = 0; i < sums.size(); ++i) {
    const bool greatest = sums[i].name.starts_with("longest");
    sums[i].value = greatest ? std::max(sums[i].value, figures[i].value) : sums[i].value + figures[i].value;
  }
}

double Seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

void Report(const Options& options, const Figures& sums, double wall_s) {
  rusage used{};
  getrusage(RUSAGE_CHILDREN, &used);
  const double processor_s = Seconds(used.ru_utime) + Seconds(used.ru_stime);
  const double hours = options.wish.hours * static_cast<double>(options.days);
  std::printf(
      "%g simulated hours of 16 lenses in %.1f s of processor time (%.0f times as fast), %.1f s by the clock (%.0f "
      "times)\n",
      hours, processor_s, 3600.0 * hours / processor_s, wall_s, 3600.0 * hours / wall_s);
  for (const Figure& sum : sums) {
    if (!sum.name.empty()) {
      std::printf("%12llu %.*s\n", static_cast<unsigned long long>(sum.value), static_cast<int>(sum.name.size()),
                  sum.name.data());
    }
  }
}

int RunAll(const Options& options) {
  const auto began = std::chrono::steady_clock::now();
  std::vector<Child> running;
  Figures sums;
  bool well = true;
  const auto end_one = [&] {
    const Figures figures = End(running.front());
    running.erase(running.begin());
    well = well && !figures.empty();
    if (!figures.empty()) Add(sums, figures);
  };
  for (std::uint64_t day = 0; day < options.days && well; ++day) {
    Wish wish = options.wish;
    wish.seed += day;
    if (options.twice) {
      well = SameTwice(wish);
      continue;
    }
    if (running.size() >= options.jobs) end_one();
    running.push_back(Start(wish));
  }
  while (!running.empty()) end_one();
  if (well && !options.twice)
    Report(options, sums, std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count());
  return well ? 0 : 1;
}

int Main(int count, char** arguments) {
  Options options;
  for (int i = 1; i < count; ++i) {
    const std::string name = arguments[i];
    if (name == "--help") return std::fputs(kHelp, stdout), 0;
    if (name == "--level") {
      ByLevel(options);
    } else if (name == "--twice") {
      options.twice = true;
    } else if (name == "--no-jumps") {
      options.wish.wall_jumps = false;
    } else if (i + 1 < count && Read(options, name, arguments[i + 1])) {
      ++i;
    } else {
      return std::fputs(kHelp, stderr), 64;
    }
  }
  return RunAll(options);
}

}  // namespace
}  // namespace lensd::year

int main(int count, char** arguments) {
  // Addresses are to be the same each time: hashes of pointers order things.
  const int now = personality(0xffffffff);
  if (now >= 0 && (now & ADDR_NO_RANDOMIZE) == 0 && personality(static_cast<unsigned>(now) | ADDR_NO_RANDOMIZE) >= 0) {
    execv("/proc/self/exe", arguments);
  }
  return lensd::year::Main(count, arguments);
}
