// Only what stands in a table of one axis is saved, line by line: the file keeps its comments and its order.
#include "cli/online/setup/setup_save.h"

#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <sstream>
#include <vector>

#include "cli/link/lens_info.h"
#include "cli/online/setup/lens_file.h"
#include "cli/text/texts.h"
#include "io/atomic_file.h"

namespace lensd::cli {
namespace {

using varlink::Json;

std::string Trimmed(const std::string& line) {
  const std::size_t begin = line.find_first_not_of(" \t\r");
  if (begin == std::string::npos) return "";
  return line.substr(begin, line.find_last_not_of(" \t\r") - begin + 1);
}

/// Whether the line is this head of a table, whatever stands behind it.
bool IsHead(const std::string& line, const std::string& head) {
  const std::string text = Trimmed(line);
  return text.starts_with(head) && (text.size() == head.size() || Trimmed(text.substr(head.size())).starts_with('#'));
}

bool IsKey(const std::string& line, const std::string& key) {
  const std::string text = Trimmed(line);
  return text.starts_with(key) && Trimmed(text.substr(key.size())).starts_with('=');
}

std::vector<std::string> LinesOf(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

std::optional<std::string> ReadText(const std::string& path) {
  std::ifstream stream(path);
  std::ostringstream text;
  text << stream.rdbuf();
  if (!stream) return std::nullopt;
  return text.str();
}

}  // namespace

std::string WithAxisKey(const std::string& text, const std::string& axis, const std::string& key,
                        const std::string& value) {
  std::vector<std::string> lines = LinesOf(text);
  const std::string line = key + " = " + value, head = "[lens." + axis + "]";
  std::size_t at = 0;
  while (at < lines.size() && !IsHead(lines[at], head)) ++at;
  if (at == lines.size()) {
    lines.push_back(head);
    lines.push_back(line);
  } else {
    std::size_t own = at + 1;
    while (own < lines.size() && !Trimmed(lines[own]).starts_with('[') && !IsKey(lines[own], key)) ++own;
    if (own < lines.size() && IsKey(lines[own], key)) {
      lines[own] = line;
    } else {
      lines.insert(lines.begin() + static_cast<std::ptrdiff_t>(at) + 1, line);
    }
  }
  std::string with;
  for (const std::string& one : lines) with += one + "\n";
  return with;
}

std::expected<std::string, Failure> OwnFileOf(DaemonClient& link, const std::string& lens) {
  auto found = link.Ask(MethodOfLens("Devices"), Json::object(), kDeviceSearch);
  if (!found) return PassOn(found);
  const std::string configuration = TextOf(*found, "configuration");
  if (configuration.empty())
    return Refuse(Exit::Config, "this lensd reads no configuration, so that nothing can be saved");
  std::string path = DropInFolder(configuration) + "/" + lens + ".toml";
  const auto text = ReadText(path);
  const bool forbidden = !text && errno == EACCES;
  int lenses = 0;
  bool named = false;
  for (const std::string& line : LinesOf(text.value_or(""))) {
    if (IsHead(line, "[[lens]]")) ++lenses;
    if (IsKey(line, "name") && line.contains("\"" + lens + "\"")) named = true;
  }
  if (forbidden || (text && access(path.c_str(), W_OK) != 0)) {
    return Refuse(Exit::NotPermitted, path + ": " + std::strerror(errno) + ": run sudo lensctl setup --save");
  }
  if (lenses != 1 || !named) {
    return Refuse(Exit::NotFound, "--save writes only into a file of this lens alone, as lensctl add makes it, and " +
                                      path + " is none: without --save, setup prints the lines to add");
  }
  return path;
}

std::expected<std::string, Failure> SaveSetup(DaemonClient& link, const std::string& file, const SetupFindings& found) {
  const auto before = ReadText(file);
  if (!before) return Refuse(Exit::NoInput, file + ": " + std::strerror(errno));
  std::string text = *before, saved;  // what is new, as in "speed and backlash"
  const auto save = [&](const std::string& axis, const std::string& key, const std::string& value) {
    const std::string with = WithAxisKey(text, axis, key, value);
    if (with == text) return;
    text = with;
    if (!saved.contains(key)) saved += (saved.empty() ? "" : " and ") + key;
  };
  for (const Json& axis : found.axes) {
    const std::string name = TextOf(axis, "axis");
    if (axis.contains("speed") && axis["speed"].is_object()) {
      save(name, "speed", NumberText(axis["speed"], "value", 4, ""));
    }
    if (name == "focus" && found.backlash.is_object() && found.backlash.value("known", false)) {
      const auto backlash = std::lround(std::ceil(found.backlash["sizeHigh"].get<double>()));
      save(name, "backlash", std::to_string(backlash));
    }
  }
  if (text == *before) return "nothing new to save: " + file + " stays as it is";
  if (auto written = io::WriteFileAtomically(file, text); !written) return RefuseOutput(written);
  const auto reloaded = ReloadAndOpen(link);
  if (reloaded) {
    std::string line = "saved " + saved + " in " + file + ", and lensd has read it";
    for (const std::string& absent : reloaded->absent) line += "; " + absent;
    return line;
  }
  const auto back = io::WriteFileAtomically(file, *before);
  return Refuse(reloaded.error().status, "nothing was saved: " + RefusedReload(reloaded.error()) +
                                             (back ? "" : "; and " + back.error().message));
}

}  // namespace lensd::cli
