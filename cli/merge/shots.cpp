// Frames say themselves how the lens stood when they were taken; where they do not, the names of the files have to do.
#include "cli/merge/shots.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>

#include "base/quantity_text.h"
#include "io/picture_notes.h"

namespace lensd::cli {
namespace {

namespace fs = std::filesystem;

std::optional<double> NumberInNotes(const std::string& text) {
  double value = 0.0;
  const auto [end, wrong] = std::from_chars(text.data(), text.data() + text.size(), value);
  return wrong == std::errc{} && end == text.data() + text.size() && std::isfinite(value) ? std::optional(value)
                                                                                          : std::nullopt;
}

/// "shot-" and 12 of "shot-12"; no number: none.
struct Numbered {
  std::string name;
  std::optional<unsigned long> number;
};
Numbered NumberedName(const std::string& file) {
  const std::string stem = fs::path(file).stem().string();
  const std::size_t digits = stem.find_last_not_of("0123456789") + 1;  // npos + 1 is 0
  Numbered numbered{stem.substr(0, digits), std::nullopt};
  unsigned long number = 0;
  if (std::from_chars(stem.data() + digits, stem.data() + stem.size(), number).ec == std::errc{})
    numbered.number = number;
  return numbered;
}

bool ByNumber(const std::string& a, const std::string& b) {
  const Numbered left = NumberedName(a), right = NumberedName(b);
  if (left.name != right.name || !left.number || !right.number) return a < b;
  return *left.number < *right.number;
}

std::expected<std::vector<std::string>, Failure> FilesIn(const std::string& folder) {
  std::vector<std::string> files;
  std::error_code failed;
  for (fs::directory_iterator entry(folder, failed), end; !failed && entry != end; entry.increment(failed)) {
    if (entry->path().extension() == ".png") files.push_back(entry->path().string());
  }
  if (failed) return Refuse(Exit::NoInput, folder + ": " + failed.message());
  std::ranges::sort(files, ByNumber);
  return files;
}

/// A number left out in a row of files of one name.
std::optional<Failure> Gap(const std::vector<Shot>& shots) {
  for (std::size_t i = 1; i < shots.size(); ++i) {
    const Numbered before = NumberedName(shots[i - 1].file), here = NumberedName(shots[i].file);
    if (before.name != here.name || !before.number || !here.number || *here.number <= *before.number + 1) continue;
    const std::string missing = before.name + std::to_string(*before.number + 1) + ".png";
    return Failure(Exit::NoInput, fs::path(shots[i].file).parent_path().string() + ": " + missing +
                                      " is missing; take it again, or name the files that are to be merged without it");
  }
  return std::nullopt;
}

std::expected<std::vector<Shot>, Failure> ShotsOf(const std::string& path) {
  std::vector<Shot> shots;
  if (!fs::is_directory(path)) {
    auto shot = ReadShot(path);
    if (!shot) return PassOn(shot);
    shots.push_back(*std::move(shot));
    return shots;
  }
  const auto files = FilesIn(path);
  if (!files) return PassOn(files);
  for (const std::string& file : *files) {
    auto shot = ReadShot(file);
    if (!shot) return PassOn(shot);
    if (!shot->merged) shots.push_back(*std::move(shot));
  }
  if (auto gap = Gap(shots)) return PassOn(*std::move(gap));
  return shots;
}

/// Sorts by one coordinate, if all have it. BadData: some have, or two share it.
std::expected<bool, Failure> SortBy(std::vector<Shot>& shots, std::optional<double> Shot::* place, const char* what) {
  const auto knows = [place](const Shot& shot) { return (shot.*place).has_value(); };
  if (std::ranges::none_of(shots, knows)) return false;
  const auto lacking = std::ranges::find_if_not(shots, knows);
  if (lacking != shots.end()) {
    return Refuse(Exit::BadData, lacking->file + " does not say " + what + ", as the others do; leave it out");
  }
  std::ranges::stable_sort(shots, {}, [place](const Shot& shot) { return *(shot.*place); });
  for (std::size_t i = 1; i < shots.size(); ++i) {
    if (*(shots[i].*place) > *(shots[i - 1].*place)) continue;
    return Refuse(Exit::BadData,
                  shots[i - 1].file + " and " + shots[i].file + " were taken in the same focus; leave one of them out");
  }
  return true;
}

/// Sharpness tells depth only where the opening is the same, of one lens.
std::optional<Failure> Mixed(const std::vector<Shot>& shots) {
  const Shot& first = shots.front();
  for (const Shot& shot : shots) {
    if (shot.lens != first.lens) {
      return Failure(Exit::BadData, first.file + " and " + shot.file + " are of different lenses ('" + first.lens +
                                        "' and '" + shot.lens + "'); merge those of one lens");
    }
    if (!shot.f_number || !first.f_number) continue;
    if (std::abs(*shot.f_number / *first.f_number - 1.0) > 0.05) {
      return Failure(Exit::BadData, first.file + " and " + shot.file + " were taken at different f-numbers (" +
                                        Short(*first.f_number) + " and " + Short(*shot.f_number) +
                                        "): what is sharper cannot be compared");
    }
  }
  return std::nullopt;
}

}  // namespace

std::expected<Shot, Failure> ReadShot(const std::string& file) {
  const auto notes = io::ReadOwnNotes(file);
  if (!notes) return RefuseInput(notes);
  Shot shot;
  shot.file = file;
  for (const auto& [name, value] : *notes) {
    if (name == "Lens") shot.lens = value;
    if (name == "VergenceD") shot.vergence_d = NumberInNotes(value);
    if (name == "ExtensionMm") shot.extension_mm = NumberInNotes(value);
    if (name == "FocalLengthMm") shot.focal_length_mm = NumberInNotes(value);
    if (name == "FNumber") shot.f_number = NumberInNotes(value);
    if (name == "FocusPosition") shot.position = NumberInNotes(value);
    if (name == "MergedFrames") shot.merged = true;
  }
  return shot;
}

double ShotStack::PlaceOf(std::size_t shot) const {
  if (order == ShotOrder::Vergence) return shots[shot].vergence_d.value();
  return order == ShotOrder::Position ? shots[shot].position.value() : static_cast<double>(shot);
}

std::expected<ShotStack, Failure> ReadShots(const std::vector<std::string>& paths) {
  ShotStack stack;
  for (const std::string& path : paths) {
    auto shots = ShotsOf(path);
    if (!shots) return PassOn(shots);
    std::ranges::move(*shots, std::back_inserter(stack.shots));
  }
  if (stack.shots.size() < 2) {
    return Refuse(Exit::BadData, paths.front() + ": a stack to merge has at least two PNG pictures, here " +
                                     (stack.shots.empty() ? "is none" : "is one"));
  }
  if (auto mixed = Mixed(stack.shots)) return PassOn(*std::move(mixed));
  stack.order = ShotOrder::Vergence;
  auto sorted = SortBy(stack.shots, &Shot::vergence_d, "at what distance it was focused");
  if (sorted && !*sorted) {
    stack.order = ShotOrder::Position;
    sorted = SortBy(stack.shots, &Shot::position, "where its lens was focused");
  }
  if (!sorted) return PassOn(sorted);
  if (!*sorted) stack.order = ShotOrder::Names;
  return stack;
}

}  // namespace lensd::cli
