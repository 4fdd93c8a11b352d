// A number in JSON is finite, so a range is all that is left to check.
#include "fields.h"

#include <algorithm>

namespace lensd::drivers::wire {

using varlink::Json;

Fields::Fields(const Json& object, std::string what) : object_(object), what_(std::move(what)) {
  if (!object_.is_object()) error_ = Error{Code::Protocol, what_ + " must be an object"};
}

const Json* Fields::Find(std::string_view key) const {
  if (!object_.is_object()) return nullptr;
  const auto found = object_.find(key);
  return found == object_.end() || found->is_null() ? nullptr : &*found;
}

const Json* Fields::Require(std::string_view key) {
  const Json* found = Find(key);
  if (found == nullptr) Reject(key, "is missing");
  return found;
}

void Fields::Reject(std::string_view key, std::string_view why) {
  if (!error_) error_ = Error{Code::Protocol, what_ + "." + std::string(key) + " " + std::string(why)};
}

void Fields::Take(const Result<void>& of_a_member) {
  if (!of_a_member && !error_) error_ = of_a_member.error();
}

Result<void> Fields::Finish() const {
  if (error_) return PassOn(*error_);
  return {};
}

double Fields::Number(std::string_view key, double lowest, double highest) {
  return Require(key) == nullptr ? 0.0 : NumberOr(key, 0.0, lowest, highest);
}

double Fields::NumberOr(std::string_view key, double fallback, double lowest, double highest) {
  return MaybeNumber(key, lowest, highest).value_or(fallback);
}

std::optional<double> Fields::MaybeNumber(std::string_view key, double lowest, double highest) {
  const Json* found = Find(key);
  if (found == nullptr) return std::nullopt;
  if (!found->is_number()) return Reject(key, "must be a number"), std::nullopt;
  const double value = found->get<double>();
  if (value >= lowest && value <= highest) return value;
  return Reject(key, "is " + varlink::WriteJson(*found) + ", which is out of range"), std::nullopt;
}

std::int64_t Fields::Integer(std::string_view key, std::int64_t lowest, std::int64_t highest) {
  return Require(key) == nullptr ? 0 : IntegerOr(key, 0, lowest, highest);
}

std::int64_t Fields::IntegerOr(std::string_view key, std::int64_t fallback, std::int64_t lowest, std::int64_t highest) {
  const Json* found = Find(key);
  if (found == nullptr) return fallback;
  const bool whole = found->is_number_integer() &&
                     (!found->is_number_unsigned() || found->get<std::uint64_t>() <= std::uint64_t{INT64_MAX});
  if (!whole) return Reject(key, "must be a whole number"), fallback;
  const auto value = found->get<std::int64_t>();
  if (value >= lowest && value <= highest) return value;
  return Reject(key, "is " + std::to_string(value) + ", which is out of range"), fallback;
}

bool Fields::Flag(std::string_view key) {
  return Require(key) != nullptr && FlagOr(key, false);
}

bool Fields::FlagOr(std::string_view key, bool fallback) {
  const Json* found = Find(key);
  if (found == nullptr) return fallback;
  if (found->is_boolean()) return found->get<bool>();
  return Reject(key, "must be true or false"), fallback;
}

std::string Fields::Text(std::string_view key) {
  return Require(key) == nullptr ? "" : TextOr(key, "");
}

std::string Fields::TextOr(std::string_view key, std::string fallback) {
  const Json* found = Find(key);
  if (found == nullptr) return fallback;
  if (found->is_string()) return found->get_ref<const std::string&>().substr(0, kLongestText);
  return Reject(key, "must be a string"), fallback;
}

std::optional<std::size_t> Fields::MaybeWord(std::string_view key, const std::vector<std::string_view>& words) {
  if (!Has(key)) return std::nullopt;
  const auto found = std::ranges::find(words, TextOr(key, ""));
  if (found != words.end()) return static_cast<std::size_t>(found - words.begin());
  return Reject(key, "is none of the words that it may be"), std::nullopt;
}

std::size_t Fields::Word(std::string_view key, const std::vector<std::string_view>& words) {
  return Require(key) == nullptr ? 0 : MaybeWord(key, words).value_or(0);
}

const Json* Fields::Object(std::string_view key) {
  const Json* found = Find(key);
  if (found == nullptr || found->is_object()) return found;
  return Reject(key, "must be an object"), nullptr;
}

const Json::array_t& Fields::Elements(std::string_view key) {
  static const Json::array_t kNone;
  const Json* found = Find(key);
  if (found == nullptr) return kNone;
  if (found->is_array() && found->size() <= kMostElements) return found->get_ref<const Json::array_t&>();
  return Reject(key, "must be an array of at most " + std::to_string(kMostElements) + " elements"), kNone;
}

}  // namespace lensd::drivers::wire
