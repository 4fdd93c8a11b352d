// Every job is processes of this program, pinned to one processor: a fresh process takes other pages of memory and
// another moment, which is what makes times of one process look more certain than they are.
#include "bench/evidence/gather.h"

#include <fcntl.h>
#include <sched.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <thread>

#include "io/atomic_file.h"

namespace lensd::bench {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using Clock = std::chrono::steady_clock;

/// Keeps this thread, and with it the processes that it starts, on one processor while it lives.
class Pinned {
 public:
  explicit Pinned(bool wanted) : wanted_(wanted && sched_getaffinity(0, sizeof before_, &before_) == 0) {
    if (!wanted_) return;
    // The last one: the first often serves interrupts.
    int last = 0;
    for (int i = 0; i < CPU_SETSIZE; ++i) {
      if (CPU_ISSET(i, &before_)) last = i;
    }
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(last, &one);
    sched_setaffinity(0, sizeof one, &one);
  }
  Pinned(const Pinned&) = delete;
  Pinned& operator=(const Pinned&) = delete;
  ~Pinned() {
    if (wanted_) sched_setaffinity(0, sizeof before_, &before_);
  }

 private:
  cpu_set_t before_{};
  bool wanted_;
};

std::string TextIn(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// What lens-bench prints with these words and --json.
Result<json> AnswerOf(std::vector<std::string> words, const fs::path& scratch, std::chrono::seconds patience) {
  words.insert(words.begin(), "lens-bench");
  words.emplace_back("--json");
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  const fs::path output = scratch / "stdout", errors = scratch / "stderr";
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, output.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  posix_spawn_file_actions_addopen(&files, STDERR_FILENO, errors.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  pid_t child = 0;
  const int failed = posix_spawn(&child, "/proc/self/exe", &files, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  std::string command;
  for (const std::string& word : words) command += (command.empty() ? "" : " ") + word;
  if (failed != 0) return Fail(Code::Internal, "cannot start " + command);
  int status = 0;
  const auto deadline = Clock::now() + patience;
  while (waitpid(child, &status, WNOHANG) == 0) {
    if (Clock::now() > deadline) {
      kill(child, SIGKILL);
      waitpid(child, &status, 0);
      return Fail(Code::Timeout, command + " took more than " + std::to_string(patience.count()) + " s");
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    return Fail(Code::Internal, command + " failed: " + TextIn(errors));
  }
  json answer = json::parse(TextIn(output), nullptr, false);
  if (!answer.is_array() || answer.empty()) return Fail(Code::BadData, command + " printed no table as JSON");
  return answer;
}

Result<std::vector<EvidenceRow>> RunJob(const EvidenceJob& job, const Provenance& here, const fs::path& scratch,
                                        std::chrono::seconds patience) {
  const Pinned pinned(job.pinned);
  std::vector<std::string> words = {job.family};
  words.insert(words.end(), job.arguments.begin(), job.arguments.end());
  std::vector<json> answers;
  for (int i = 0; i < job.repeats; ++i) {
    auto answer = AnswerOf(words, scratch, patience);
    if (!answer) return PassOn(answer);
    answers.push_back(*std::move(answer));
    if (answers.back().size() != answers.front().size()) {
      return Fail(Code::BadData, job.Settings() + ": the processes did not print the same table");
    }
  }
  EvidenceRow like{.family = job.family,
                   .scene = job.scene,
                   .method = {},
                   .role = "ours",
                   .sweep = job.sweep,
                   .value = job.value,
                   .measure = {},
                   .unit = {},
                   .settings = job.Settings(),
                   .seed = job.seed,
                   .made = here};
  return job.rows(like, answers);
}

/// Do these rows stem from the same question, with whatever counts?
bool SameQuestion(const EvidenceRow& row, const EvidenceJob& job) {
  return job.sweep.empty() || row.value == job.value;
}

/// A folder for what processes print, gone with this object.
struct Scratch {
  Scratch() {
    std::string pattern = fs::temp_directory_path() / "lens-evidence-XXXXXX";
    if (::mkdtemp(pattern.data()) != nullptr) path = pattern;
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  ~Scratch() {
    std::error_code ignored;
    if (!path.empty()) fs::remove_all(path, ignored);
  }
  fs::path path;
};

bool IsWanted(const EvidenceJob& job, const GatherOptions& options) {
  const auto begins = [&](const std::string& scene) { return job.scene.starts_with(scene); };
  return (options.families.empty() || std::ranges::find(options.families, job.family) != options.families.end()) &&
         (options.scenes.empty() || std::ranges::any_of(options.scenes, begins));
}

}  // namespace

std::string EvidenceJob::Settings() const {
  std::string text = repeats > 1 ? std::to_string(repeats) + " times " : "";
  text += "lens-bench " + family;
  for (const std::string& argument : arguments) {
    text += argument.find(' ') == std::string::npos ? " " + argument : " '" + argument + "'";
  }
  return text;
}

Result<void> Gather(const std::vector<EvidenceJob>& jobs, const GatherOptions& options,
                    const std::function<void(const std::string&)>& say) {
  const Provenance here = ProvenanceHere();
  const Scratch scratch;
  if (scratch.path.empty()) return Fail(Code::Io, "cannot make a folder for what processes print");
  for (const EvidenceJob& job : jobs) {
    if (!IsWanted(job, options)) continue;
    const fs::path path = fs::path(options.directory) / job.family / (FileNameOf(job.scene) + ".csv");
    std::vector<EvidenceRow> rows;
    if (fs::exists(path)) {
      auto kept = RowsFromCsv(TextIn(path), path);
      if (!kept) return PassOn(kept);
      rows = *std::move(kept);
    }
    const std::string settings = job.Settings();
    if (std::ranges::any_of(rows, [&](const EvidenceRow& row) { return row.settings == settings; })) continue;
    const auto begin = Clock::now();
    auto more = RunJob(job, here, scratch.path, options.patience);
    if (!more) return PassOn(more);
    std::erase_if(rows, [&](const EvidenceRow& row) { return SameQuestion(row, job); });
    rows.insert(rows.end(), more->begin(), more->end());
    std::error_code trouble;
    fs::create_directories(path.parent_path(), trouble);
    if (auto written = io::WriteFileAtomically(path.string(), CsvOf(rows)); !written) return PassOn(written);
    const auto took = std::chrono::duration_cast<std::chrono::seconds>(Clock::now() - begin);
    say(settings + ": " + std::to_string(took.count()) + " s");
  }
  return {};
}

}  // namespace lensd::bench
