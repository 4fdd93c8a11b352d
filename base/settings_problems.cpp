// The collector hangs on its thread, so that no driver has to know of it: drivers read their settings through readers.
#include "base/settings_problems.h"

#include <algorithm>
#include <charconv>
#include <utility>

namespace lensd {
namespace {

thread_local SettingsProblems* current_problems = nullptr;

/// "file:line: ..." as a place.
Location PlaceOf(std::string_view message) {
  const std::size_t end = message.find(": ");
  const std::string_view place = message.substr(0, end == std::string_view::npos ? 0 : end);
  const std::size_t colon = place.rfind(':');
  Location where{std::string(place), 0};
  if (colon == std::string_view::npos) return where;
  int line = 0;
  const auto [stopped, error] = std::from_chars(place.data() + colon + 1, place.data() + place.size(), line);
  if (error == std::errc() && stopped == place.data() + place.size()) {
    where = {std::string(place.substr(0, colon)), line};
  }
  return where;
}

}  // namespace

SettingsProblems::SettingsProblems() : outer_(std::exchange(current_problems, this)) {}

SettingsProblems::~SettingsProblems() {
  current_problems = outer_;
}

SettingsProblems* SettingsProblems::Current() {
  return current_problems;
}

void SettingsProblems::KeysBeside(const Settings& table, std::vector<std::string> keys) {
  table_ = table.where().Text();
  beside_ = std::move(keys);
}

std::vector<std::string> SettingsProblems::BesideOf(const Settings& table) const {
  return table.where().Text() == table_ ? beside_ : std::vector<std::string>();
}

void SettingsProblems::Add(std::string_view message, const Location& otherwise) {
  SettingsProblem problem{.where = PlaceOf(message), .message = std::string(message)};
  if (problem.where.line == 0 && !otherwise.file.empty()) {
    problem = {.where = otherwise, .message = otherwise.Text() + ": " + problem.message};
  }
  if (std::ranges::find(all_, problem.message, &SettingsProblem::message) != all_.end()) return;
  all_.push_back(std::move(problem));
}

void SettingsProblems::AddOfKey(const Settings& table, std::string_view key, std::string_view message) {
  const std::string place = table.where().Text();
  const auto same = [&](const SettingsProblem& known) { return known.table == place && known.key == key; };
  if (std::ranges::any_of(all_, same)) return;
  const std::size_t before = all_.size();
  Add(message);
  if (all_.size() == before) return;
  all_.back().table = place;
  all_.back().key = key;
}

void SettingsProblems::ForgetKey(const Settings& table, std::string_view key) {
  const std::string place = table.where().Text();
  std::erase_if(all_, [&](const SettingsProblem& known) { return known.table == place && known.key == key; });
}

}  // namespace lensd
