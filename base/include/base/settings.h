// Settings: a tree of values that remember the file and line they came from, and a reader that turns a table into a
// typed struct while refusing what it does not know.
#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "base/result.h"

namespace lensd {

/// Where a value was written.
struct Location {
  std::string file;  ///< as the user named it; relative paths inside settings are relative to its folder
  int line = 0;      ///< from 1; 0: no line

  /// "file:line", or "file" without a line.
  std::string Text() const;
};

/// One value: a table, an array, or a scalar. Immutable once built.
class Settings {
 public:
  using Table = std::map<std::string, Settings, std::less<>>;
  using Array = std::vector<Settings>;
  using Value = std::variant<Table, Array, bool, std::int64_t, double, std::string>;

  Settings() = default;
  Settings(Value value, Location where) : value_(std::move(value)), where_(std::move(where)) {}

  const Value& value() const { return value_; }
  const Location& where() const { return where_; }
  const Table* AsTable() const { return std::get_if<Table>(&value_); }
  const Array* AsArray() const { return std::get_if<Array>(&value_); }
  /// The number, where the value is an integer or a float.
  std::optional<double> AsNumber() const;
  /// "a table", "a string", ...: for messages.
  std::string_view KindName() const;

 private:
  Value value_;
  Location where_;
};

/// An inclusive range a number must lie in.
struct Range {
  double minimum = -std::numeric_limits<double>::infinity();
  double maximum = std::numeric_limits<double>::infinity();
};
inline constexpr Range kPositive{std::numeric_limits<double>::min(), std::numeric_limits<double>::max()};
inline constexpr Range kNonNegative{0.0, std::numeric_limits<double>::max()};

/// Reads one table into a typed struct. Every call names a key and what it must be; the first thing wrong is kept and
/// reported by Finish(), together with any key left unread. Until then wrong values read as the fallback.
///
///   SettingsReader read(table, "lens");
///   config.steps = read.Integer("steps", 8192, {2, 1e9});
///   if (auto done = read.Finish(); !done) return PassOn(done);
class SettingsReader {
 public:
  /// `what` names the table in messages, for instance "[lens]".
  SettingsReader(const Settings& table, std::string what);

  bool Has(std::string_view key) const;
  double Number(std::string_view key, double fallback, Range range = {});
  double RequiredNumber(std::string_view key, Range range = {});
  std::optional<double> OptionalNumber(std::string_view key, Range range = {});
  std::int64_t Integer(std::string_view key, std::int64_t fallback, Range range = {});
  bool Boolean(std::string_view key, bool fallback);
  std::string Text(std::string_view key, std::string fallback);
  std::string RequiredText(std::string_view key);
  std::optional<std::string> OptionalText(std::string_view key);
  /// One of `choices`; returns its index.
  std::size_t Choice(std::string_view key, const std::vector<std::string_view>& choices, std::size_t fallback);
  /// An array of exactly `count` numbers.
  std::optional<std::vector<double>> OptionalNumbers(std::string_view key, std::size_t count, Range range = {});
  /// A file's path, made absolute against the folder of the file it was written in.
  std::optional<std::string> OptionalPath(std::string_view key);
  /// A sub-table, or nullptr where there is none.
  const Settings* Table(std::string_view key);
  /// The tables of an array of tables; empty where there is none. One plain table counts as an array of one.
  std::vector<const Settings*> Tables(std::string_view key);
  /// The raw value, or nullptr: for keys of several forms.
  const Settings* Any(std::string_view key);

  /// Records an error at `key` (or at the table where the key is absent) unless one is recorded already.
  void Reject(std::string_view key, std::string_view why);
  /// The first error, or success. Reports unknown keys. Code::BadData, "file:line: message".
  Result<void> Finish();

 private:
  const Settings* Find(std::string_view key);
  const Settings* Require(std::string_view key);
  void RejectUnknown();
  std::optional<double> NumberIn(std::string_view key, const Settings* found, Range range);

  const Settings& table_;
  std::string what_;
  std::set<std::string, std::less<>> known_;
  std::optional<Error> error_;
  std::string error_key_;  ///< what error_ complains of
  bool missing_ = false;   ///< and that it is not there
};

}  // namespace lensd
