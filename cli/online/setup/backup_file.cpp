// A restore must not end halfway: everything is written beside its place first, which finds full disks and missing
// rights; what remains are renames, and those that were made are taken back where one fails.
#include "cli/online/setup/backup_file.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <ctime>
#include <filesystem>
#include <set>
#include <string_view>
#include <system_error>
#include <utility>

#include "io/atomic_file.h"
#include "io/checked_file.h"
#include "io/toml.h"
#include "varlink/base64.h"
#include "varlink/json.h"

namespace lensd::cli {
namespace {

using varlink::Json;
namespace fs = std::filesystem;

constexpr std::string_view kFormat = "lensd-backup";
constexpr int kBackupVersion = 1;
constexpr std::string_view kBefore = ".before-restore";
constexpr std::string_view kStaged = ".restoring";
constexpr std::size_t kLargestFile = std::size_t{64} << 20;
constexpr std::array<std::string_view, 6> kStateFiles = {".position.json", ".calibration.toml", ".presets.toml",
                                                         ".refocus.toml",  ".slope.toml",       ".last.toml"};

bool IsStateFile(const std::string& name) {
  return std::ranges::any_of(kStateFiles, [&](std::string_view end) { return name.ends_with(end); });
}

/// Every text in the settings that may name a file.
void TextsIn(const Settings& settings, std::vector<std::string>& texts) {
  if (const auto* text = std::get_if<std::string>(&settings.value())) texts.push_back(*text);
  if (const auto* table = settings.AsTable()) {
    for (const auto& [key, value] : *table) TextsIn(value, texts);
  }
  if (const auto* array = settings.AsArray()) {
    for (const Settings& value : *array) TextsIn(value, texts);
  }
}

std::string Now() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  std::array<char, 32> text{};
  return {text.data(), std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%SZ", &utc)};
}

/// Collects a folder's files without taking any twice.
class Collector {
 public:
  Collector(std::string config, std::vector<std::string>& outside)
      : config_(std::move(config)), folder_(fs::path(config_).parent_path()), outside_(outside) {}

  Result<void> TakeConfig() {
    if (auto taken = TakeToml(config_, kConfigName); !taken) return taken;
    std::error_code failed;
    std::vector<std::string> drop_ins;
    for (const auto& entry : fs::directory_iterator(config_ + ".d", failed)) {
      if (entry.path().extension() == ".toml") drop_ins.push_back(entry.path().string());
    }
    std::ranges::sort(drop_ins);
    for (const std::string& path : drop_ins) {
      auto taken = TakeToml(path, std::string(kConfigName) + ".d/" + fs::path(path).filename().string());
      if (!taken) return taken;
    }
    return {};
  }

  Result<void> TakeState(const std::string& folder) {
    std::error_code failed;
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder, failed)) {
      const std::string name = entry.path().filename().string();
      if (IsStateFile(name) && !name.starts_with('.')) names.push_back(name);
    }
    if (failed && failed != std::errc::no_such_file_or_directory) {
      return Fail(Code::Io, folder + ": " + failed.message());
    }
    std::ranges::sort(names);
    const std::string inside = folder + "/";
    for (const std::string& name : names) {
      if (auto taken = Take(BackedUp::Folder::State, inside + name, name); !taken) return taken;
    }
    return {};
  }

  std::vector<BackedUp> files() && { return std::move(files_); }

 private:
  Result<void> Take(BackedUp::Folder folder, const std::string& from, const std::string& path) {
    if (!taken_.emplace(folder, path).second) return {};
    auto bytes = io::ReadWholeFile(from, kLargestFile);
    if (!bytes) return PassOn(bytes);
    files_.push_back({folder, path, *std::move(bytes)});
    return {};
  }

  /// A file of settings, and what it names: those files may name others again, as a scene its textures.
  Result<void> TakeToml(const std::string& from, const std::string& path) {
    if (taken_.contains({BackedUp::Folder::Config, path})) return {};
    if (auto taken = Take(BackedUp::Folder::Config, from, path); !taken) return taken;
    const auto settings = io::ReadTomlFile(from);
    if (!settings) return PassOn(settings);
    std::vector<std::string> texts;
    TextsIn(*settings, texts);
    for (const std::string& text : texts) {
      if (auto taken = TakeNamed(fs::path(from).parent_path(), text); !taken) return taken;
    }
    return {};
  }

  Result<void> TakeNamed(const fs::path& beside, const std::string& text) {
    std::error_code ignored;
    const fs::path named = (beside / text).lexically_normal();
    if (text.empty() || !fs::is_regular_file(named, ignored)) return {};
    const fs::path path = named.lexically_relative(folder_);
    if (path.empty() || *path.begin() == "..") {
      outside_.push_back(named.string());
      return {};
    }
    if (named.extension() == ".toml") return TakeToml(named.string(), path.string());
    return Take(BackedUp::Folder::Config, named.string(), path.string());
  }

  std::string config_;
  fs::path folder_;
  std::vector<std::string>& outside_;
  std::set<std::pair<BackedUp::Folder, std::string>> taken_;
  std::vector<BackedUp> files_;
};

/// A path that leads nowhere but below its folder.
bool StaysBelow(const std::string& path) {
  const fs::path normal = fs::path(path).lexically_normal();
  return !path.empty() && normal.is_relative() && normal == fs::path(path) && *normal.begin() != "..";
}

std::unexpected<Error> NoBackup(const std::string& name, const std::string& why) {
  return Fail(Code::BadData, name + ": " + why + "; nothing has been changed");
}

/// Where a file of the backup goes on this host.
std::string PlaceOnHost(const BackedUp& file, const DaemonFolders& folders) {
  if (file.folder == BackedUp::Folder::State) return folders.state + "/" + file.path;
  if (file.path.starts_with(kConfigName))
    return folders.config + file.path.substr(std::string_view(kConfigName).size());
  return (fs::path(folders.config).parent_path() / file.path).string();
}

/// What the backup does not have and would go on to count: drop-ins, and what is kept of other lenses.
std::vector<std::string> Others(const std::set<std::string>& places, const DaemonFolders& folders) {
  std::vector<std::string> others;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folders.config + ".d", ignored)) {
    if (entry.path().extension() == ".toml") others.push_back(entry.path().string());
  }
  for (const auto& entry : fs::directory_iterator(folders.state, ignored)) {
    const std::string name = entry.path().filename().string();
    if (IsStateFile(name) && !name.starts_with('.')) others.push_back(folders.state + "/" + name);
  }
  std::erase_if(others, [&](const std::string& path) { return places.contains(path); });
  return others;
}

/// Belongs to whom the folder belongs to: lensd does not run as root.
void GiveToOwnerOf(const fs::path& folder, const std::string& path) {
  struct stat owner{};
  if (geteuid() != 0 || stat(folder.c_str(), &owner) != 0) return;
  if (chown(path.c_str(), owner.st_uid, owner.st_gid) != 0) return;  // lensd says so when it cannot write it
}

/// Renames that can be taken back. Everything is taken back at the end, unless it was kept.
class Renames {
 public:
  ~Renames() {
    std::error_code ignored;
    for (auto step = done_.rbegin(); step != done_.rend(); ++step) fs::rename(step->second, step->first, ignored);
    for (const std::string& path : staged_) fs::remove(path, ignored);
  }
  Result<void> Stage(const std::string& path, const std::string& bytes) {
    std::error_code failed;
    const fs::path folder = fs::path(path).parent_path();
    fs::create_directories(folder, failed);
    if (failed) return Fail(Code::Io, folder.string() + ": " + failed.message());
    const std::string staged = path + std::string(kStaged);
    staged_.push_back(staged);
    if (auto written = io::WriteFileAtomically(staged, bytes); !written) return written;
    GiveToOwnerOf(folder, staged);
    return {};
  }
  Result<void> Do(const std::string& from, const std::string& to) {
    std::error_code failed;
    fs::rename(from, to, failed);
    if (failed) return Fail(Code::Io, to + ": " + failed.message());
    done_.emplace_back(from, to);
    return {};
  }
  void Keep() {
    done_.clear();
    staged_.clear();
  }

 private:
  std::vector<std::pair<std::string, std::string>> done_;
  std::vector<std::string> staged_;
};

}  // namespace

Result<Backup> CollectBackup(const DaemonFolders& folders, std::vector<std::string>& outside) {
  std::array<char, 256> host{};
  gethostname(host.data(), host.size() - 1);
  Backup backup{.made = Now(), .host = host.data(), .lensd = LENSD_VERSION, .files = {}};
  Collector collector(folders.config, outside);
  if (auto taken = collector.TakeConfig(); !taken) return PassOn(taken);
  if (auto taken = collector.TakeState(folders.state); !taken) return PassOn(taken);
  backup.files = std::move(collector).files();
  return backup;
}

std::string BackupText(const Backup& backup) {
  Json files = Json::array();
  for (const BackedUp& file : backup.files) {
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(file.bytes.data());
    files.push_back({{"in", file.folder == BackedUp::Folder::Config ? "config" : "state"},
                     {"path", file.path},
                     {"data", varlink::EncodeBase64({bytes, file.bytes.size()})}});
  }
  return io::SignedObject(varlink::WriteJson({{"format", kFormat},
                                              {"version", kBackupVersion},
                                              {"made", backup.made},
                                              {"host", backup.host},
                                              {"lensd", backup.lensd},
                                              {"files", std::move(files)}})) +
         "\n";
}

Result<Backup> BackupFromText(const std::string& text, const std::string& name) {
  std::string_view object = text;
  while (object.ends_with('\n')) object.remove_suffix(1);
  const auto integrity = io::IntegrityOfObject(object);
  const Json json = Json::parse(object, nullptr, false);
  const bool ours = json.is_object() && json.value("format", Json()) == kFormat;
  if (integrity == io::Integrity::Unsigned)
    return NoBackup(name, "this is no backup of lensd, or its beginning is lost");
  if (integrity == io::Integrity::Changed)
    return NoBackup(name, "this backup is damaged or was edited: its checksum is wrong");
  if (!ours) return NoBackup(name, "this is a file of lensd, but no backup");
  if (json.value("version", 0) != kBackupVersion) {
    return NoBackup(name, "this backup is of another version of lensd than this one reads");
  }
  Backup backup{
      .made = json.value("made", ""), .host = json.value("host", ""), .lensd = json.value("lensd", ""), .files = {}};
  for (const Json& each : json.value("files", Json::array())) {
    auto bytes = varlink::DecodeBase64(each.value("data", ""));
    const std::string folder = each.value("in", ""), path = each.value("path", "");
    if (!bytes || (folder != "config" && folder != "state") || !StaysBelow(path)) {
      return NoBackup(name, "the file \"" + path + "\" in this backup makes no sense");
    }
    backup.files.push_back({folder == "config" ? BackedUp::Folder::Config : BackedUp::Folder::State, path,
                            std::string(bytes->begin(), bytes->end())});
  }
  const auto config = std::ranges::find(backup.files, kConfigName, &BackedUp::path);
  if (config == backup.files.end()) return NoBackup(name, "there is no configuration in this backup");
  return backup;
}

Result<void> UnpackBackup(const Backup& backup, const std::string& folder) {
  const DaemonFolders folders{.config = folder + "/config/" + kConfigName, .state = folder + "/state"};
  for (const BackedUp& file : backup.files) {
    const std::string place = PlaceOnHost(file, folders);
    std::error_code failed;
    fs::create_directories(fs::path(place).parent_path(), failed);
    if (failed) return Fail(Code::Io, place + ": " + failed.message());
    if (auto written = io::WriteFileAtomically(place, file.bytes); !written) return written;
  }
  return {};
}

Result<std::vector<std::string>> InstallBackup(const Backup& backup, const DaemonFolders& folders) {
  Renames renames;
  std::set<std::string> places;
  for (const BackedUp& file : backup.files) {
    const std::string place = PlaceOnHost(file, folders);
    places.insert(place);
    if (auto staged = renames.Stage(place, file.bytes); !staged) return PassOn(staged);
  }
  std::vector<std::string> old = Others(places, folders), kept;
  std::error_code ignored;
  for (const std::string& place : places) {
    if (fs::exists(place, ignored)) old.push_back(place);
  }
  for (const std::string& path : old) {
    const std::string aside = path + std::string(kBefore);
    if (auto moved = renames.Do(path, aside); !moved) return PassOn(moved);
    kept.push_back(aside);
  }
  for (const std::string& place : places) {
    if (auto moved = renames.Do(place + std::string(kStaged), place); !moved) return PassOn(moved);
  }
  renames.Keep();
  return kept;
}

}  // namespace lensd::cli
