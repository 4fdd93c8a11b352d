// Every mistake of a configuration at once, where a reader alone stops at its first.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "base/settings.h"

namespace lensd {

/// One mistake.
struct SettingsProblem {
  Location where;          ///< line 0: the file as a whole
  std::string message;     ///< "file:line: what, why"
  std::string table = {};  ///< where the table of the key that it is about begins; empty: it is about none
  std::string key = {};
};

/// While one lives, every SettingsReader on its thread tells it all that is wrong with its table, at most one thing a
/// key; the readers' own results stay as they are. One within another takes its place until it ends.
class SettingsProblems {
 public:
  SettingsProblems();
  ~SettingsProblems();
  SettingsProblems(const SettingsProblems&) = delete;
  SettingsProblems& operator=(const SettingsProblems&) = delete;

  /// Of this table another reader takes these keys: a mistyped one may stand for them.
  void KeysBeside(const Settings& table, std::vector<std::string> keys);
  /// The keys that were named for this table.
  std::vector<std::string> BesideOf(const Settings& table) const;

  /// Adds a mistake unless the same was told already. Its place is what its message begins with, "file:line: "; where
  /// it names none, `otherwise`, which is put before it.
  void Add(std::string_view message, const Location& otherwise = {});
  /// The same for readers: adds nothing where one of that key is known.
  void AddOfKey(const Settings& table, std::string_view key, std::string_view message);
  /// Takes back what was told of a key that turns out to be there and mistyped.
  void ForgetKey(const Settings& table, std::string_view key);

  const std::vector<SettingsProblem>& all() const { return all_; }

  /// That of this thread; nullptr: there is none.
  static SettingsProblems* Current();

 private:
  SettingsProblems* outer_;
  std::string table_;
  std::vector<std::string> beside_;
  std::vector<SettingsProblem> all_;
};

}  // namespace lensd
