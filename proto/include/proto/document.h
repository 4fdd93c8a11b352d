// JSON that was received, as it was parsed: a view costs nothing, where a Json costs an allocation for every value.
#pragma once

#include <rapidjson/document.h>

#include <cstddef>
#include <memory>
#include <optional>
#include <string_view>

#include "base/result.h"
#include "proto/json.h"

namespace lensd::proto {

/// One value of a Document, which must outlive it. Cheap to copy.
class JsonView {
 public:
  explicit JsonView(const rapidjson::Value& value) : value_(&value) {}

  bool is_null() const { return value_->IsNull(); }
  bool is_boolean() const { return value_->IsBool(); }
  bool is_number() const { return value_->IsNumber(); }
  /// Written without fraction and exponent, and within 64 bits.
  bool is_integer() const { return value_->IsInt64() || value_->IsUint64(); }
  bool is_string() const { return value_->IsString(); }
  bool is_array() const { return value_->IsArray(); }
  bool is_object() const { return value_->IsObject(); }

  bool boolean() const { return value_->GetBool(); }     ///< is_boolean() must hold
  double number() const { return value_->GetDouble(); }  ///< is_number() must hold
  /// is_string() must hold.
  std::string_view text() const { return {value_->GetString(), value_->GetStringLength()}; }

  /// Elements of an array.
  std::size_t size() const { return value_->Size(); }
  JsonView operator[](std::size_t index) const { return JsonView((*value_)[static_cast<rapidjson::SizeType>(index)]); }
  /// Members of an object, in the order they were written.
  std::size_t member_count() const { return value_->MemberCount(); }
  std::string_view member_name(std::size_t index) const { return JsonView(Member(index).name).text(); }
  JsonView member(std::size_t index) const { return JsonView(Member(index).value); }
  /// A member of an object, of several of one name the last; null or absent, which mean the same: nothing.
  std::optional<JsonView> Given(std::string_view name) const;
  /// The same, but null is a value.
  std::optional<JsonView> Find(std::string_view name) const;

  Json ToJson() const;

 private:
  const rapidjson::Value::Member& Member(std::size_t index) const {
    return value_->MemberBegin()[static_cast<std::ptrdiff_t>(index)];
  }

  const rapidjson::Value* value_;
};

/// One JSON text, parsed. Movable; views stay valid when it moves.
class Document {
 public:
  /// Code::Protocol: not JSON, not UTF-8, a number beyond double, or deeper than kMaxDepth.
  static Result<Document> Parse(std::string_view text);
  Document(Document&&) noexcept;
  Document& operator=(Document&&) noexcept;
  ~Document();

  JsonView root() const;

 private:
  struct Tree;
  Document();
  std::unique_ptr<Tree> tree_;
};

/// {}.
JsonView EmptyObject();

}  // namespace lensd::proto
