// GObject lifetimes and errors in our terms.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "base/result.h"

// GLib and Aravis name them so.
using ArvCamera = struct _ArvCamera;  // NOLINT(bugprone-reserved-identifier)
using ArvDevice = struct _ArvDevice;  // NOLINT(bugprone-reserved-identifier)
using GError = struct _GError;        // NOLINT(bugprone-reserved-identifier)

namespace lensd::drivers::aravis {

struct Unref {
  void operator()(void* object) const;
};
/// Owns one reference.
template <class T>
using Handle = std::unique_ptr<T, Unref>;

/// A text of Aravis', which is null where it knows none.
inline std::string Text(const char* text) {
  return text == nullptr ? "" : text;
}

/// Receives the error of one call, and frees it.
class CallError {
 public:
  CallError() = default;
  CallError(const CallError&) = delete;
  CallError& operator=(const CallError&) = delete;
  ~CallError();

  GError** out() { return &error_; }
  explicit operator bool() const { return error_ != nullptr; }
  /// Of what was being done ("setting FocusStepper"). Call only where there is an error.
  std::unexpected<Error> Why(std::string_view doing) const;
  /// Nothing, or Why().
  Result<void> Check(std::string_view doing) const;

 private:
  GError* error_ = nullptr;
};

/// Whether the camera has the feature and can use it now; a camera that does not answer has none.
bool Has(ArvCamera* camera, std::string_view feature);

/// Once a process: no message of GLib or Aravis ends it or reaches the terminal, and neither does a division (see
/// division_guard.h).
void TameGlib();

}  // namespace lensd::drivers::aravis
