// GObject ownership as RAII and GError as Error. GLib's fatal log levels are switched off, since they abort the
// process.
#include "gobject_handles.h"

#include <arv.h>

#include <mutex>

#include "division_guard.h"

namespace lensd::drivers::aravis {
namespace {

void Swallow(const gchar*, GLogLevelFlags, const gchar*, gpointer) {}

Code CodeOfDevice(int code) {
  switch (code) {
    case ARV_DEVICE_ERROR_NOT_CONNECTED:
    case ARV_DEVICE_ERROR_NOT_FOUND:
      return Code::Disconnected;
    case ARV_DEVICE_ERROR_TIMEOUT:
      return Code::Timeout;
    case ARV_DEVICE_ERROR_NOT_CONTROLLER:
    case ARV_DEVICE_ERROR_PROTOCOL_ERROR_ACCESS_DENIED:
    case ARV_DEVICE_ERROR_PROTOCOL_ERROR_BUSY:
      return Code::Busy;
    case ARV_DEVICE_ERROR_WRONG_FEATURE:
    case ARV_DEVICE_ERROR_FEATURE_NOT_FOUND:
    case ARV_DEVICE_ERROR_PROTOCOL_ERROR_NOT_IMPLEMENTED:
    case ARV_DEVICE_ERROR_PROTOCOL_ERROR_WRITE_PROTECT:
      return Code::Unsupported;
    default:
      return Code::Protocol;
  }
}

Code CodeOfGenicam(int code) {
  switch (code) {
    case ARV_GC_ERROR_OUT_OF_RANGE:
      return Code::OutOfRange;
    case ARV_GC_ERROR_READ_ONLY:
      return Code::Unsupported;
    case ARV_GC_ERROR_ENUM_ENTRY_NOT_FOUND:
      return Code::InvalidArgument;
    default:
      return Code::Protocol;
  }
}

}  // namespace

void Unref::operator()(void* object) const {
  if (object != nullptr) g_object_unref(object);
}

CallError::~CallError() {
  if (error_ != nullptr) g_error_free(error_);
}

std::unexpected<Error> CallError::Why(std::string_view doing) const {
  Code code = Code::Protocol;
  if (error_->domain == ARV_DEVICE_ERROR) code = CodeOfDevice(error_->code);
  if (error_->domain == ARV_GC_ERROR) code = CodeOfGenicam(error_->code);
  return Fail(code, std::string(doing) + ": " + error_->message);
}

Result<void> CallError::Check(std::string_view doing) const {
  if (error_ == nullptr) return {};
  return Why(doing);
}

void TameGlib() {
  static std::once_flag once;
  std::call_once(once, [] {
    GuardDivisions();
    g_log_set_always_fatal(static_cast<GLogLevelFlags>(0));
    g_log_set_default_handler(Swallow, nullptr);
    // Cameras are opened by several threads at once: what Aravis and libxml2 set up at the first description is set up
    // here.
    constexpr char kDescription[] = "<RegisterDescription/>";
    CallError ignored;
    const Handle<ArvDomDocument> first(
        arv_dom_document_new_from_memory(kDescription, sizeof kDescription - 1, ignored.out()));
  });
}

bool Has(ArvCamera* camera, std::string_view feature) {
  if (feature.empty()) return false;
  CallError error;
  return arv_camera_is_feature_available(camera, std::string(feature).c_str(), error.out()) != 0 && !error;
}

}  // namespace lensd::drivers::aravis
