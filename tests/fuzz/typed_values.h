// From a fuzzer's bytes to parameters of the right types, most of them on the edge of something.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>

#include "base/clock.h"
#include "checking_client.h"
#include "proto/interfaces.h"
#include "varlink/interface_definition.h"

namespace lensd::fuzz {

using varlink::TypeDefinition;

/// What a name stands for. A definition tells of methods alone, so each type is made the parameter of one.
inline varlink::TypePointer TypeNamed(const std::string& name) {
  static const InterfaceDefinition named = [] {
    std::string text, types, methods;
    std::istringstream lines{std::string(proto::LensInterfaceText())};
    for (std::string line; std::getline(lines, line);) {
      if (!line.starts_with("#") && line.find_first_not_of(' ') != line.npos &&
          line[line.find_first_not_of(' ')] != '#') {
        text += line + "\n";
      }
    }
    for (std::size_t at = text.find("\ntype "); at != text.npos; at = text.find("\ntype ", at + 1)) {
      const std::size_t begin = text.find('(', at);
      std::size_t end = begin;
      for (int depth = 0; depth > 0 || end == begin; ++end) depth += text[end] == '(' ? 1 : text[end] == ')' ? -1 : 0;
      const std::string type = text.substr(at + 6, text.find_first_of(" (", at + 6) - at - 6);
      types += text.substr(at + 1, end - at - 1) + "\n";
      methods += "method " + type + "(v: " + text.substr(begin, end - begin) + ") -> ()\n";
    }
    return *InterfaceDefinition::Parse("interface fuzz.types\n" + types + methods);
  }();
  return named.methods().find(name)->second.input->fields.front().type;
}

/// From the fuzzer's bytes to parameters of the right types.
class Values {
 public:
  explicit Values(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  bool empty() const { return bytes_.empty(); }
  unsigned Byte() {
    if (bytes_.empty()) return 0;
    const unsigned byte = bytes_[0];
    bytes_ = bytes_.subspan(1);
    return byte;
  }
  template <std::size_t N, class T>
  const T& OneOf(const std::array<T, N>& choices) {
    return choices[Byte() % N];
  }

  /// Of the parameters of the next call: few that may be left out make calls that are taken, many try the rest.
  void ChooseShareOfOptional() { share_of_optional_ = OneOf(std::array<unsigned, 4>{24, 48, 96, 192}); }

  Json Of(const TypeDefinition& type, std::string_view name, const Client& client, int depth = 0) {
    using Kind = TypeDefinition::Kind;
    switch (type.kind) {
      case Kind::Boolean:
        return Byte() % 2 == 0;
      case Kind::Integer:
        return Integer(name, client);
      case Kind::Float:
        return Float(name);
      case Kind::String:
        return Text(name, client);
      case Kind::Enumeration:
        return type.values[Byte() % type.values.size()];
      case Kind::Optional:
        return depth > 8 || Byte() >= ShareOf(name) ? Json(nullptr) : Of(*type.element, name, client, depth + 1);
      case Kind::Named:
        return Of(*TypeNamed(type.name), name, client, depth + 1);
      case Kind::Struct:
        return Struct(type, client, depth);
      case Kind::Array:
        return Array(type, name, client, depth);
      case Kind::Map:
      case Kind::Object:
        return Json::object();
    }
    return nullptr;
  }
  /// Of a curve: they mostly rise, or no curve would ever be taken, and are often as close together as two numbers can
  /// be.
  Json Points() {
    Json points = Json::array();
    const unsigned count = Byte() % 5 + 2;
    const bool close = Byte() % 2 == 0;
    for (unsigned i = 0; i < count; ++i) {
      const unsigned odd = Byte();
      const double apart = odd % 8 == 0 ? Float("position") : 100.0 * i;
      const double position = close && i == 1 ? std::numeric_limits<double>::denorm_min() : apart;
      const double mm = odd % 16 == 1 ? Float("extensionMm") : 0.3 * i;
      points.push_back({{"position", position}, {"extensionMm", mm}});
    }
    return points;
  }
  /// Deep, mostly.
  std::string Toml() {
    const auto part = OneOf(std::array<std::string, 4>{"a.", "[", "{a=", "\"a\"."});
    const unsigned times = 1U << (Byte() % 17);
    std::string text = OneOf(std::array<std::string, 3>{"version = 1\n", "a = ", "["});
    for (unsigned i = 0; i < times && text.size() < 500'000; ++i) text += part;
    return text + OneOf(std::array<std::string, 3>{"a = 1", "a]\nb = 1", ""});
  }
  Json Struct(const TypeDefinition& type, const Client& client, int depth) {
    Json json = Json::object();
    for (const auto& field : type.fields) {
      Json value = Of(*field.type, field.name, client, depth + 1);
      if (!value.is_null()) json[field.name] = std::move(value);
    }
    return json;
  }

 private:
  /// Of 256; of several lenses one has to be named.
  unsigned ShareOf(std::string_view name) const { return name == "lens" ? 240 : share_of_optional_; }
  std::int64_t Integer(std::string_view name, const Client& client) {
    constexpr auto kLowest = std::numeric_limits<std::int64_t>::min(),
                   kHighest = std::numeric_limits<std::int64_t>::max();
    if (name == "session" && client.session && Byte() % 8 != 0) return *client.session;
    const auto now = MonotonicClock().Now().time_since_epoch().count();
    return OneOf(std::array<std::int64_t, 16>{0, 1, 2, 3, 4, 16, 48, -1, kLowest, kHighest, kLowest + 1, now,
                                              now - 1'000'000, std::int64_t{1} << 32, -(std::int64_t{1} << 31),
                                              1'000'000});
  }
  double Float(std::string_view name) {
    const unsigned kind = Byte();
    if (kind % 4 == 0) {
      return OneOf(std::array<double, 12>{0.0, -0.0, 4.9e-324, -4.9e-324, 2.3e-308, 1e-300, 1.7e308, -1.7e308, 1e300,
                                          -1.0, 1e9, 1e-9});
    }
    const double part = Byte() / 255.0;
    if (name == "position") return std::round(part * 400.0);
    if (name == "extensionMm") return part * 1.6;
    if (name.ends_with("Ms")) return part * 50.0;
    return kind % 4 == 1 ? part : part * 20.0 - 5.0;
  }
  std::string Text(std::string_view name, const Client& client) {
    if (name == "lens") return OneOf(std::array<std::string, 8>{"a", "a", "a", "b", "b", "b", "c", ""});
    if (name == "lease" && client.lease && Byte() % 4 != 0) return *client.lease;
    if (name == "toml") return Toml();
    if (name == "data") return std::string(std::size_t{4} * (Byte() * Byte() / 8U), 'A');
    if (name == "method") return OneOf(std::array<std::string, 5>{"auto", "contrast", "sweep", "defocus", "magic"});
    return OneOf(std::array<std::string, 6>{"x", "y", "", "\xC3\xA9", "a b", std::string(300, 'l')});
  }
  Json Array(const TypeDefinition& type, std::string_view name, const Client& client, int depth) {
    Json array = Json::array();
    const unsigned count = depth > 8 ? 0 : Byte() % 5;
    for (unsigned i = 0; i < count; ++i) array.push_back(Of(*type.element, name, client, depth + 1));
    return array;
  }

  std::span<const std::uint8_t> bytes_;
  unsigned share_of_optional_ = 0;  // of 256
};

}  // namespace lensd::fuzz
