// The files lie in share/lensd/lenses, beside the folder of the program: of an installation and of a build alike.
#include "daemon/config/lens_models.h"

#include <algorithm>
#include <filesystem>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "base/nearest_word.h"
#include "io/toml.h"

namespace lensd::daemon {
namespace {

std::filesystem::path FolderOfModels() {
  std::error_code ignored;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", ignored);
  return (program.parent_path() / "../share/lensd/lenses").lexically_normal();
}

std::vector<std::string> NamesOfModels() {
  std::vector<std::string> names;
  std::error_code none;
  for (std::filesystem::directory_iterator next(FolderOfModels(), none), end; !none && next != end;
       next.increment(none)) {
    if (next->path().extension() == ".toml") names.push_back(next->path().stem().string());
  }
  std::ranges::sort(names);
  return names;
}

std::string WhyNoModel(const std::string& name) {
  const std::vector<std::string> names = NamesOfModels();
  const auto meant = NearestWord(name, names);
  std::string text = "there is no lens model \"" + name + "\"";
  if (meant) return text + "; did you mean \"" + *meant + "\"?";
  text += names.empty() ? "; there is none in " + FolderOfModels().string() : "; there is ";
  for (const std::string& one : names) text += (&one == names.data() ? "" : ", ") + one;
  return text + ", and any file whose name ends in .toml (docs/lenses.md)";
}

/// The file of a model, checked as far as only a model can be wrong; the reader of [lens.optics] checks the rest.
Result<Settings::Table> ReadModel(const Settings& named, const std::string& name) {
  const bool own = name.ends_with(".toml");
  const bool plain = own || name.find('/') == std::string::npos;
  const auto path =
      own ? std::filesystem::path(named.where().file).parent_path() / name : FolderOfModels() / (name + ".toml");
  std::error_code none;
  if (!plain || !std::filesystem::exists(path, none)) {
    const std::string why = own ? "there is no file " + path.lexically_normal().string() : WhyNoModel(name);
    return Fail(Code::BadData, named.where().Text() + ": " + why);
  }
  auto file = io::ReadTomlFile(path.lexically_normal().string());
  if (!file) return PassOn(file);
  SettingsReader read(*file, "a lens model");
  if (read.Integer("version", 1) != 1) read.Reject("version", "must be 1: this lensd reads version 1 alone");
  if (read.RequiredText("document").empty()) read.Reject("document", "must name the document of these figures");
  Settings::Table optics = *file->AsTable();
  for (const auto& [key, unused] : optics) read.Any(key);
  if (auto done = read.Finish(); !done) return PassOn(done);
  optics.erase("version");
  optics.erase("document");
  return optics;
}

/// `optics` as a table, from the model and from what is written beside its name.
Result<Settings> OpticsOf(const Settings& named, const std::string& name, const Settings::Table& beside,
                          const Location& where) {
  auto table = ReadModel(named, name);
  if (!table) return PassOn(table);
  // How far the lens extends is one statement, whichever key makes it. Where a closest distance alone is given, it
  // starts where the model's own one starts.
  const bool extends = beside.contains("extension_mm") || beside.contains("power_d");
  if (extends || beside.contains("closest_m")) {
    for (const char* const key : {"closest_m", "extension_mm", "power_d"}) table->erase(key);
  }
  if (extends) table->erase("closest_from");
  for (const auto& [key, value] : beside) {
    if (key != "model") table->insert_or_assign(key, value);
  }
  return Settings(Settings::Value(std::in_place_type<Settings::Table>, *std::move(table)), where);
}

}  // namespace

Result<Settings> WithLensModel(const Settings& lens) {
  const Settings::Table* keys = lens.AsTable();
  if (keys == nullptr) return lens;
  const auto found = keys->find("optics");
  if (found == keys->end()) return lens;
  const Settings& optics = found->second;
  const Settings* named = std::holds_alternative<std::string>(optics.value()) ? &optics : nullptr;
  const Settings::Table* beside = optics.AsTable();
  if (beside != nullptr) {
    SettingsReader read(optics, "[lens.optics]");  // of this key alone
    named = read.Any("model");
  }
  if (named == nullptr) return lens;
  const auto* name = std::get_if<std::string>(&named->value());
  if (name == nullptr) return Fail(Code::BadData, named->where().Text() + ": [lens.optics] model must be a string");
  auto table = OpticsOf(*named, *name, beside == nullptr ? Settings::Table{} : *beside, optics.where());
  if (!table) return PassOn(table);
  Settings::Table with = *keys;
  with.insert_or_assign("optics", *std::move(table));
  return Settings(Settings::Value(std::in_place_type<Settings::Table>, std::move(with)), lens.where());
}

}  // namespace lensd::daemon
