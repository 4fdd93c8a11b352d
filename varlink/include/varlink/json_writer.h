// JSON written straight into text, for answers of many numbers: a tree of them costs ten times as much.
#pragma once

#include <string>
#include <string_view>
#include <utility>

namespace lensd::varlink {

/// Writes one object, field after field. The caller keeps Begin and End in balance; text must be UTF-8. One thread.
class JsonWriter {
 public:
  void Begin();  ///< of an object: the whole, or an element of an array
  void End();
  void BeginArray(std::string_view key);
  void EndArray();
  void Element(std::string_view text);  ///< a string in an array
  void Text(std::string_view key, std::string_view text);
  void Flag(std::string_view key, bool flag);
  /// Reads back to the same value; null where it is not finite, since JSON has neither NaN nor infinity.
  void Number(std::string_view key, double value);
  /// Text that is JSON already.
  void Value(std::string_view key, std::string_view json);
  /// Begins the object that is the value of `key`.
  void BeginObject(std::string_view key);
  std::string Take() { return std::move(text_); }

 private:
  void Separate();
  void Key(std::string_view key);
  void Quote(std::string_view text);

  std::string text_;
};

}  // namespace lensd::varlink
