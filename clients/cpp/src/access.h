// The inside of the classes that are installed: JSON behind Values, what a Picture shares. Nothing of this leaves the
// library.
#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "lensd/client.h"

namespace lensd {
inline namespace v1 {

using Json = nlohmann::json;

template <class T>
inline constexpr bool kIsOptional = false;
template <class T>
inline constexpr bool kIsOptional<std::optional<T>> = true;
template <class T>
inline constexpr bool kIsVector = false;
template <class T>
inline constexpr bool kIsVector<std::vector<T>> = true;

/// A friend of every class that is installed.
struct Access {
  using PictureImpl = Picture::Impl;
  using FrameImpl = Frame::Impl;
  using StreamImpl = Stream::Impl;
  using Place = std::shared_ptr<const void>;  // of a Json, which something larger may own

  static const Json& At(const Place& place) { return *static_cast<const Json*>(place.get()); }
  static const Json& Of(const Value& value) { return At(value.at_); }
  static Place Own(Json json) { return std::make_shared<const Json>(std::move(json)); }
  static void Put(Value& value, Place place) { value.at_ = std::move(place); }

  /// Throws "BrokenReply" where the field is not what the interface says.
  template <class T>
  static T Get(const Value& value, const char* name) {
    const Json& object = Of(value);
    const auto found = object.find(name);
    return Read<T>(found == object.end() ? Place(value.at_, Null()) : Place(value.at_, &*found), name);
  }
  template <class T>
  static void Set(Value& value, const char* name, const T& field) {
    Json changed = Of(value);
    changed[name] = Written(field);
    Put(value, Own(std::move(changed)));
  }

  static std::shared_ptr<PictureImpl> NewPicture();
  static Picture Wrap(std::shared_ptr<const PictureImpl> picture);
  static const FrameImpl& Of(const Frame& frame);
  static Stream Wrap(std::unique_ptr<StreamImpl> stream);
  static StreamImpl& Of(Stream& stream);

 private:
  static const Json* Null();
  [[noreturn]] static void Mismatch(const char* name, const Json& value);

  template <class T>
  static T Read(const Place& place, const char* name) {
    const Json& json = At(place);
    if constexpr (kIsOptional<T>) {
      if (json.is_null()) return std::nullopt;
      return Read<typename T::value_type>(place, name);
    } else if constexpr (kIsVector<T>) {
      if (!json.is_array()) Mismatch(name, json);
      T list;
      list.reserve(json.size());
      for (const Json& element : json) list.push_back(Read<typename T::value_type>(Place(place, &element), name));
      return list;
    } else if constexpr (std::is_base_of_v<Value, T>) {
      if (!json.is_object()) Mismatch(name, json);
      T value;
      Put(value, place);
      return value;
    } else {
      if (!Fits<T>(json)) Mismatch(name, json);
      return json.get<T>();
    }
  }
  template <class T>
  static bool Fits(const Json& json) {
    if constexpr (std::is_same_v<T, bool>) return json.is_boolean();
    if constexpr (std::is_same_v<T, std::string>) return json.is_string();
    return std::is_same_v<T, double> ? json.is_number() : json.is_number_integer();
  }
  template <class T>
  static Json Written(const T& field) {
    if constexpr (kIsVector<T>) {
      Json list = Json::array();
      for (const auto& element : field) list.push_back(Written(element));
      return list;
    } else if constexpr (std::is_base_of_v<Value, T>) {
      return Of(field);
    } else {
      return field;
    }
  }
};

}  // namespace v1
}  // namespace lensd
