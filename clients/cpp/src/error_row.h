// A row of the table of errors.
#pragma once

namespace lensd {
inline namespace v1 {

struct ErrorRow {
  const char* wire;  // with its interface
  const char* name;
  const char* code;
  int status;
};

}  // namespace v1
}  // namespace lensd
