// JSON that was received, as it was parsed: a view costs nothing, where a Json costs an allocation for every value.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>

#include "base/result.h"
#include "varlink/json.h"

namespace lensd::varlink {

/// One value of a Document, which must outlive it. Cheap to copy.
class JsonView {
 public:
  /// Where a value lies in the parser's memory.
  struct Place {
    const void* document = nullptr;
    std::size_t index = 0;
    bool operator==(const Place&) const = default;
  };

  explicit JsonView(Place place) : place_(place) {}

  bool is_null() const;
  bool is_boolean() const;
  bool is_number() const;
  /// Written without fraction and exponent, and within 64 bits.
  bool is_integer() const;
  bool is_string() const;
  bool is_array() const;
  bool is_object() const;

  bool boolean() const;           ///< is_boolean() must hold
  double number() const;          ///< is_number() must hold
  std::string_view text() const;  ///< is_string() must hold; valid as long as the Document

  /// The elements of an array, in order; is_array() must hold.
  class Elements;
  Elements elements() const;
  /// The members of an object as pairs of name and value, in the order they were written; is_object() must hold.
  class Members;
  Members members() const;

  /// A member of an object, of several of one name the last; null or absent, which mean the same: nothing.
  std::optional<JsonView> Given(std::string_view name) const;
  /// The same, but null is a value.
  std::optional<JsonView> Find(std::string_view name) const;

  Json ToJson() const;

 private:
  Place place_;
};

/// What a range-based for needs.
class JsonView::Elements {
 public:
  class Iterator {
   public:
    explicit Iterator(Place place) : place_(place) {}
    JsonView operator*() const { return JsonView(place_); }
    Iterator& operator++();
    bool operator==(const Iterator&) const = default;

   private:
    Place place_;
  };
  Elements(Place begin, Place end) : begin_(begin), end_(end) {}
  Iterator begin() const { return Iterator(begin_); }
  Iterator end() const { return Iterator(end_); }

 private:
  Place begin_, end_;
};

/// What a range-based for needs.
class JsonView::Members {
 public:
  class Iterator {
   public:
    explicit Iterator(Place place) : place_(place) {}
    std::pair<std::string_view, JsonView> operator*() const;
    Iterator& operator++();
    bool operator==(const Iterator&) const = default;

   private:
    Place place_;
  };
  Members(Place begin, Place end) : begin_(begin), end_(end) {}
  Iterator begin() const { return Iterator(begin_); }
  Iterator end() const { return Iterator(end_); }

 private:
  Place begin_, end_;
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

}  // namespace lensd::varlink
