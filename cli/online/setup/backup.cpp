// backup, restore: a rig's files to another host. The files themselves are read and written, so that a user who may
// administer lensd's folders, and no other, may do this.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <memory>

#include "cli/link/daemon_program.h"
#include "cli/online/commands.h"
#include "cli/online/setup/backup_file.h"
#include "io/atomic_file.h"
#include "proto/interfaces.h"
#include "varlink/client.h"
#include "varlink/json.h"

namespace lensd::cli {
namespace {

using varlink::Json;
namespace fs = std::filesystem;

struct BackupOptions {
  std::string file;
  DaemonFolders folders{.config = "/etc/lensd/lensd.toml", .state = "/var/lib/lensd"};
};

/// A folder that is gone with this.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (fs::temp_directory_path() / "lensctl-restore-XXXXXX").string();
    if (mkdtemp(name.data()) != nullptr) path_ = name;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    if (!path_.empty()) fs::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

Outcome MakeBackup(Session& session, const BackupOptions& options) {
  if (access(options.folders.config.c_str(), R_OK) != 0 && errno == EACCES) {
    return Refuse(Exit::NotPermitted, options.folders.config + " may not be read by you: a backup is made by root");
  }
  std::vector<std::string> outside;
  const auto backup = CollectBackup(options.folders, outside);
  if (!backup) return RefuseInput(backup);
  for (const std::string& path : outside) {
    session.Remark("not in the backup, since it lies outside of the configuration's folder: " + path);
  }
  if (auto written = io::WriteFileAtomically(options.file, BackupText(*backup)); !written) return RefuseOutput(written);
  Json files = Json::array();
  for (const BackedUp& file : backup->files) files.push_back(file.path);
  if (session.json()) {
    session.PrintJson({{"file", options.file}, {"files", files}, {"leftOut", outside}});
    return Exit::Done;
  }
  session.PrintText(options.file + ": " + std::to_string(backup->files.size()) + " files");
  for (const Json& path : files) session.PrintText("  " + path.get<std::string>());
  return Exit::Done;
}

/// A daemon that runs would write its own state over what is restored.
std::optional<Failure> WhyNotNow(const Session& session) {
  const auto running = varlink::Client::Connect(session.globals().socket.value_or(std::string(proto::kDefaultSocket)));
  if (!running) return std::nullopt;
  return Failure(Exit::Busy,
                 "lensd is running: end it first (systemctl stop lensd.socket lensd), start it again afterwards; "
                 "nothing has been changed");
}

/// What this host's lensd says of the configuration in the backup.
std::expected<void, Failure> Judge(const Backup& backup, const std::string& file) {
  const TemporaryFolder folder;
  if (folder.path().empty()) return Refuse(Exit::CannotWrite, "the temporary folder has no room to check it");
  if (auto unpacked = UnpackBackup(backup, folder.path()); !unpacked) return RefuseOutput(unpacked);
  const auto [status, said] = RunDaemonProgram(
      {"--check-config", "--config", folder.path() + "/config/" + kConfigName, "--state", folder.path() + "/state"},
      STDERR_FILENO);
  if (status == 127) return Refuse(Exit::Unavailable, "lensd is not installed here, so nothing can be restored");
  constexpr int kWrongConfiguration = 78;
  if (status != kWrongConfiguration) return {};
  std::string why = said;
  for (std::size_t at = why.find(folder.path()); at != why.npos; at = why.find(folder.path())) {
    why.erase(at, folder.path().size() + std::string_view("/config/").size());
  }
  std::ranges::replace(why, '\n', ';');  // one a mistake
  return Refuse(Exit::BadData,
                file + ": this lensd does not take the configuration in it: " + why + "; nothing has been changed");
}

Outcome Restore(Session& session, const BackupOptions& options) {
  const auto text = io::ReadWholeFile(options.file, std::size_t{256} << 20);
  if (!text) return RefuseInput(text);
  const auto backup = BackupFromText(*text, options.file);
  if (!backup) return PassOn(backup);
  if (auto running = WhyNotNow(session)) return std::unexpected(*std::move(running));
  if (auto good = Judge(*backup, options.file); !good) return PassOn(good);
  const auto kept = InstallBackup(*backup, options.folders);
  if (!kept) {
    return Refuse(Exit::CannotWrite, kept.error().message + "; nothing has been changed (root may restore)");
  }
  if (session.json()) {
    session.PrintJson(
        {{"restored", backup->files.size()}, {"host", backup->host}, {"made", backup->made}, {"kept", *kept}});
    return Exit::Done;
  }
  session.PrintText("restored " + std::to_string(backup->files.size()) + " files of " + backup->host + ", " +
                    backup->made);
  for (const std::string& path : *kept) session.PrintText("  the old file is kept as " + path);
  return Exit::Done;
}

void AddBackupCommand(CLI::App& root, Run& run, const char* name, const char* about,
                      Outcome (*act)(Session&, const BackupOptions&)) {
  auto options = std::make_shared<BackupOptions>();
  auto* command = root.add_subcommand(name, about)->group(kOnline);
  command->add_option("FILE", options->file, "the backup")->required();
  command->add_option("--config", options->folders.config, "the daemon's configuration")
      ->capture_default_str()
      ->type_name("FILE");
  command->add_option("--state", options->folders.state, "the daemon's state folder")
      ->capture_default_str()
      ->type_name("DIR");
  command->callback([&run, options, act] {
    run = [options, act](Session& session) -> Outcome {
      if (options->file.empty()) return Refuse(Exit::Usage, "FILE is empty: name the backup, such as rig.lensd");
      std::string& config = options->folders.config;
      if (config.empty() || options->folders.state.empty()) {
        return Refuse(Exit::Usage, "--config and --state name a file and a folder: they cannot be empty");
      }
      if (!config.contains('/')) config = "./" + config;  // its folder has a name then
      return act(session, *options);
    };
  });
}

}  // namespace

void AddBackup(CLI::App& root, Run& run) {
  AddBackupCommand(root, run, "backup",
                   "save configuration, calibrations, presets and positions in one file, for this host or another",
                   MakeBackup);
}

void AddRestore(CLI::App& root, Run& run) {
  AddBackupCommand(root, run, "restore",
                   "restore a backup, completely or not at all; lensd must not run, and the old files are kept",
                   Restore);
}

}  // namespace lensd::cli
