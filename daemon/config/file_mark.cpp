// Any text in a configuration that is the path of a file counts as naming it: drivers know their own keys alone.
#include "daemon/config/file_mark.h"

#include <sys/stat.h>

#include <algorithm>
#include <filesystem>
#include <string_view>
#include <system_error>
#include <variant>

#include "io/atomic_file.h"
#include "io/toml.h"

namespace lensd::daemon {
namespace {

constexpr std::size_t kLargestToml = std::size_t{1} << 20;

enum class Within { Look, Ignore };

void AddMarks(const Settings& settings, Within files, std::vector<FileMark>& marks);

void AddMarkOf(const std::string& path, Within files, std::vector<FileMark>& marks) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return;
  marks.push_back(MarkOf(path));
  if (files == Within::Ignore || !path.ends_with(".toml")) return;
  const auto text = io::ReadWholeFile(path, kLargestToml);
  const auto named = text ? io::ParseToml(*text, path) : PassOn(text);
  if (named) AddMarks(*named, Within::Ignore, marks);
}

void AddMarks(const Settings& settings, Within files, std::vector<FileMark>& marks) {
  if (const auto* table = settings.AsTable()) {
    for (const auto& [key, value] : *table) AddMarks(value, files, marks);
  } else if (const auto* array = settings.AsArray()) {
    for (const Settings& value : *array) AddMarks(value, files, marks);
  } else if (const auto* text = std::get_if<std::string>(&settings.value()); text != nullptr && !text->empty()) {
    const auto path = std::filesystem::path(settings.where().file).parent_path() / *text;
    AddMarkOf(path.lexically_normal().string(), files, marks);
  }
}

}  // namespace

FileMark MarkOf(const std::string& path) {
  struct stat now{};
  if (stat(path.c_str(), &now) != 0) return {.path = path};
  constexpr std::int64_t kNsPerSecond = 1'000'000'000;
  return {.path = path,
          .size = static_cast<std::uint64_t>(now.st_size),
          .inode = now.st_ino,
          .changed_ns = now.st_mtim.tv_sec * kNsPerSecond + now.st_mtim.tv_nsec};
}

std::vector<FileMark> MarksOfFilesIn(const Settings& settings) {
  std::vector<FileMark> marks;
  AddMarks(settings, Within::Look, marks);
  return marks;
}

}  // namespace lensd::daemon
