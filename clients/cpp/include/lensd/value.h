// What the types of lensd/types.h are: values as lensd tells them, read field by field.
#ifndef LENSD_VALUE_H_
#define LENSD_VALUE_H_

#include <memory>
#include <string>

#define LENSD_API __attribute__((visibility("default")))

namespace lensd {
/// Part of every symbol: a program may have other things in a namespace `lensd`.
inline namespace v1 {

/// A value of the interface. Cheap to copy: copies share what lensd said. What is asked for and missing, though the
/// interface promises it, is an Error of the name "BrokenReply". Fields may be added in later versions without harm to
/// programs that were compiled before: a Value is a handle, and its fields are functions. Different copies may be used
/// by different threads.
class LENSD_API Value {
 public:
  Value();
  /// All of it as JSON, also what this version of the library has no function for.
  std::string json() const;

 private:
  friend struct Access;
  std::shared_ptr<const void> at_;
};

}  // namespace v1
}  // namespace lensd

#endif
