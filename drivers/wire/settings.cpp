// Settings travel as plain JSON, which any language reads, with the places of their values beside them.
#include <cmath>
#include <utility>

#include "drivers/wire/wire.h"

namespace lensd::drivers::wire {
namespace {

constexpr int kDeepest = 32;

std::string Escaped(std::string_view key) {
  std::string text;
  for (const char c : key) {
    if (c == '~') {
      text += "~0";
    } else if (c == '/') {
      text += "~1";
    } else {
      text += c;
    }
  }
  return text;
}

Result<Json> Written(const Settings& settings, const std::string& pointer, Json& places) {
  places[pointer] = settings.where().Text();
  if (const auto* table = settings.AsTable()) {
    Json values = Json::object();
    for (const auto& [key, value] : *table) {
      auto written = Written(value, pointer + "/" + Escaped(key), places);
      if (!written) return written;
      values[key] = *std::move(written);
    }
    return values;
  }
  if (const auto* array = settings.AsArray()) {
    Json values = Json::array();
    for (const Settings& value : *array) {
      auto written = Written(value, pointer + "/" + std::to_string(values.size()), places);
      if (!written) return written;
      values.push_back(*std::move(written));
    }
    return values;
  }
  if (const auto* flag = std::get_if<bool>(&settings.value())) return Json(*flag);
  if (const auto* whole = std::get_if<std::int64_t>(&settings.value())) return Json(*whole);
  if (const auto* text = std::get_if<std::string>(&settings.value())) return Json(*text);
  const double number = std::get<double>(settings.value());
  if (!std::isfinite(number)) {
    return Fail(Code::BadData, settings.where().Text() + ": this number must be finite");
  }
  return Json(number);
}

Location PlaceOf(const std::string& pointer, const Json& places) {
  const auto found = places.find(pointer);
  if (found == places.end() || !found->is_string()) return {};
  const auto& text = found->get_ref<const std::string&>();
  const std::size_t colon = text.rfind(':');
  const bool numbered = colon != std::string::npos && colon + 1 < text.size() && text.size() - colon <= 9 &&
                        text.find_first_not_of("0123456789", colon + 1) == std::string::npos;
  if (!numbered) return {.file = text, .line = 0};
  return {.file = text.substr(0, colon), .line = std::stoi(text.substr(colon + 1))};
}

Result<Settings> Read(const Json& json, const std::string& pointer, const Json& places, int depth) {
  if (depth > kDeepest) return Fail(Code::Protocol, "settings nested deeper than " + std::to_string(kDeepest));
  Settings::Value value;
  if (json.is_object()) {
    Settings::Table table;
    for (const auto& [key, member] : json.items()) {
      auto read = Read(member, pointer + "/" + Escaped(key), places, depth + 1);
      if (!read) return read;
      table.emplace(key, *std::move(read));
    }
    value.emplace<Settings::Table>(std::move(table));
  } else if (json.is_array()) {
    Settings::Array array;
    for (const Json& element : json) {
      auto read = Read(element, pointer + "/" + std::to_string(array.size()), places, depth + 1);
      if (!read) return read;
      array.push_back(*std::move(read));
    }
    value.emplace<Settings::Array>(std::move(array));
  } else if (json.is_boolean()) {
    value.emplace<bool>(json.get<bool>());
  } else if (json.is_number_integer()) {
    value.emplace<std::int64_t>(json.get<std::int64_t>());
  } else if (json.is_number()) {
    value.emplace<double>(json.get<double>());
  } else if (json.is_string()) {
    value.emplace<std::string>(json.get<std::string>());
  } else {
    return Fail(Code::Protocol, "settings" + pointer + " must not be null");
  }
  return Settings(std::move(value), PlaceOf(pointer, places));
}

}  // namespace

Result<SentSettings> SettingsJson(const Settings& settings) {
  SentSettings sent{.values = Json(), .places = Json::object()};
  auto values = Written(settings, "", sent.places);
  if (!values) return PassOn(values);
  sent.values = *std::move(values);
  return sent;
}

Result<Settings> SettingsFrom(const Json& values, const Json& places) {
  if (!values.is_object()) return Fail(Code::Protocol, "settings must be an object");
  return Read(values, "", places.is_object() ? places : Json::object(), 0);
}

}  // namespace lensd::drivers::wire
