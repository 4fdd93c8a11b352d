// Reading settings into typed structs: range checks, and errors that name file, line and key. What a reader has not
// asked for is found when it ends, so an unknown key is never passed over.
#include "base/settings.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <sstream>
#include <vector>

#include "base/nearest_word.h"
#include "base/settings_problems.h"

namespace lensd {
namespace {

std::string NumberText(double number) {
  std::ostringstream out;
  out << number;
  return out.str();
}

std::string RangeText(Range range) {
  const bool has_low = std::isfinite(range.minimum);
  const bool has_high = std::isfinite(range.maximum) && range.maximum < std::numeric_limits<double>::max();
  if (range.minimum == kPositive.minimum) {
    return has_high ? "above 0 and at most " + NumberText(range.maximum) : "above 0";
  }
  if (has_low && has_high) return "from " + NumberText(range.minimum) + " to " + NumberText(range.maximum);
  if (has_low) return "at least " + NumberText(range.minimum);
  if (has_high) return "at most " + NumberText(range.maximum);
  return "finite";
}

}  // namespace

std::string Location::Text() const {
  return line > 0 ? file + ":" + std::to_string(line) : file;
}

std::optional<double> Settings::AsNumber() const {
  if (const auto* integer = std::get_if<std::int64_t>(&value_)) return static_cast<double>(*integer);
  if (const auto* number = std::get_if<double>(&value_)) return *number;
  return std::nullopt;
}

std::string_view Settings::KindName() const {
  static constexpr std::string_view kNames[] = {"a table",    "an array", "a boolean",
                                                "an integer", "a number", "a string"};
  return kNames[value_.index()];
}

SettingsReader::SettingsReader(const Settings& table, std::string what) : table_(table), what_(std::move(what)) {
  if (table_.AsTable() == nullptr) Reject("", "must be a table, not " + std::string(table_.KindName()));
}

bool SettingsReader::Has(std::string_view key) const {
  const auto* table = table_.AsTable();
  return table != nullptr && table->contains(key);
}

const Settings* SettingsReader::Find(std::string_view key) {
  known_.emplace(key);
  const auto* table = table_.AsTable();
  if (table == nullptr) return nullptr;
  const auto found = table->find(key);
  return found == table->end() ? nullptr : &found->second;
}

const Settings* SettingsReader::Require(std::string_view key) {
  const Settings* found = Find(key);
  if (found != nullptr) return found;
  const bool first = !error_;
  Reject(key, "is missing: write " + std::string(key) + " = ...");
  if (first) missing_ = true;
  return found;
}

void SettingsReader::Reject(std::string_view key, std::string_view why) {
  auto* problems = SettingsProblems::Current();
  if (error_ && problems == nullptr) return;
  const auto* table = table_.AsTable();
  const Settings* at = &table_;
  if (table != nullptr) {
    if (const auto found = table->find(key); found != table->end()) at = &found->second;
  }
  std::string message = at->where().Text() + ": ";
  message += (key.empty() ? what_ : what_ + " " + std::string(key)) + " " + std::string(why);
  if (problems != nullptr) problems->AddOfKey(table_, key, message);
  if (error_) return;
  error_ = Error{Code::BadData, std::move(message)};
  error_key_ = key;
}

std::optional<double> SettingsReader::NumberIn(std::string_view key, const Settings* found, Range range) {
  if (found == nullptr) return std::nullopt;
  const auto number = found->AsNumber();
  if (!number) {
    Reject(key, "must be a number, not " + std::string(found->KindName()));
    return std::nullopt;
  }
  if (!std::isfinite(*number) || *number < range.minimum || *number > range.maximum) {
    Reject(key, "must be " + RangeText(range) + ", not " + NumberText(*number));
    return std::nullopt;
  }
  return number;
}

double SettingsReader::Number(std::string_view key, double fallback, Range range) {
  return NumberIn(key, Find(key), range).value_or(fallback);
}

double SettingsReader::RequiredNumber(std::string_view key, Range range) {
  return NumberIn(key, Require(key), range).value_or(range.minimum);
}

std::optional<double> SettingsReader::OptionalNumber(std::string_view key, Range range) {
  return NumberIn(key, Find(key), range);
}

std::int64_t SettingsReader::Integer(std::string_view key, std::int64_t fallback, Range range) {
  const auto number = NumberIn(key, Find(key), range);
  if (!number) return fallback;
  if (*number != std::floor(*number) || std::abs(*number) > 9e15) {
    Reject(key, "must be a whole number, not " + NumberText(*number));
    return fallback;
  }
  return static_cast<std::int64_t>(*number);
}

bool SettingsReader::Boolean(std::string_view key, bool fallback) {
  const Settings* found = Find(key);
  if (found == nullptr) return fallback;
  if (const auto* flag = std::get_if<bool>(&found->value())) return *flag;
  Reject(key, "must be true or false, not " + std::string(found->KindName()));
  return fallback;
}

std::optional<std::string> SettingsReader::OptionalText(std::string_view key) {
  const Settings* found = Find(key);
  if (found == nullptr) return std::nullopt;
  if (const auto* text = std::get_if<std::string>(&found->value())) return *text;
  Reject(key, "must be a string, not " + std::string(found->KindName()));
  return std::nullopt;
}

std::string SettingsReader::Text(std::string_view key, std::string fallback) {
  return OptionalText(key).value_or(std::move(fallback));
}

std::string SettingsReader::RequiredText(std::string_view key) {
  return Require(key) == nullptr ? std::string() : OptionalText(key).value_or("");
}

std::size_t SettingsReader::Choice(std::string_view key, const std::vector<std::string_view>& choices,
                                   std::size_t fallback) {
  const auto text = OptionalText(key);
  if (!text) return fallback;
  const auto found = std::find(choices.begin(), choices.end(), *text);
  if (found != choices.end()) return static_cast<std::size_t>(found - choices.begin());
  std::string all;
  for (const auto choice : choices) all += (all.empty() ? "" : ", ") + std::string(choice);
  Reject(key, "must be one of " + all + ", not \"" + *text + "\"");
  return fallback;
}

std::optional<std::vector<double>> SettingsReader::OptionalNumbers(std::string_view key, std::size_t count,
                                                                   Range range) {
  const Settings* found = Find(key);
  if (found == nullptr) return std::nullopt;
  const auto* array = found->AsArray();
  if (array == nullptr || array->size() != count) {
    Reject(key, "must be an array of " + std::to_string(count) + " numbers");
    return std::nullopt;
  }
  std::vector<double> numbers;
  for (const Settings& element : *array) {
    const auto number = NumberIn(key, &element, range);
    if (!number) return std::nullopt;
    numbers.push_back(*number);
  }
  return numbers;
}

std::optional<std::string> SettingsReader::OptionalPath(std::string_view key) {
  const auto text = OptionalText(key);
  if (!text) return std::nullopt;
  if (text->empty()) {
    Reject(key, "must name a file");
    return std::nullopt;
  }
  const std::filesystem::path folder = std::filesystem::path(Find(key)->where().file).parent_path();
  return (folder / *text).lexically_normal().string();
}

const Settings* SettingsReader::Table(std::string_view key) {
  const Settings* found = Find(key);
  if (found != nullptr && found->AsTable() == nullptr) {
    Reject(key, "must be a table, not " + std::string(found->KindName()));
    return nullptr;
  }
  return found;
}

std::vector<const Settings*> SettingsReader::Tables(std::string_view key) {
  const Settings* found = Find(key);
  std::vector<const Settings*> tables;
  if (found == nullptr) return tables;
  if (found->AsTable() != nullptr) return {found};
  if (const auto* array = found->AsArray()) {
    for (const Settings& element : *array) {
      if (element.AsTable() != nullptr) tables.push_back(&element);
    }
    if (tables.size() == array->size()) return tables;
  }
  Reject(key, "must be tables, written [[" + std::string(key) + "]]");
  return {};
}

const Settings* SettingsReader::Any(std::string_view key) {
  return Find(key);
}

Result<void> SettingsReader::Finish() {
  // What is missing may be there, and mistyped.
  if (!error_ || missing_ || SettingsProblems::Current() != nullptr) RejectUnknown();
  if (error_) return PassOn(*error_);
  return {};
}

void SettingsReader::RejectUnknown() {
  const auto* table = table_.AsTable();
  if (table == nullptr) return;
  auto* problems = SettingsProblems::Current();
  std::vector<std::string> words(known_.begin(), known_.end());
  for (const std::string& key : problems != nullptr ? problems->BesideOf(table_) : std::vector<std::string>()) {
    words.push_back(key);
  }
  const bool may_tell = !error_ || missing_;
  const Settings* first = nullptr;
  for (const auto& [key, value] : *table) {
    if (known_.contains(key)) continue;
    const auto meant = NearestWord(key, words);
    std::string message = value.where().Text() + ": unknown key \"" + key + "\" in " + what_;
    if (meant) message += "; did you mean \"" + *meant + "\"?";
    if (problems != nullptr) problems->AddOfKey(table_, key, message);
    if (problems != nullptr && meant && !table->contains(*meant)) {
      problems->ForgetKey(table_, *meant);
      if (error_ && error_key_ == *meant) error_->message = message;  // it is there, and mistyped
    }
    const bool earlier = first == nullptr || value.where().line < first->where().line;
    if (!may_tell || !earlier || (missing_ && !meant)) continue;
    first = &value;
    error_ = Error{Code::BadData, std::move(message)};
  }
}

}  // namespace lensd
