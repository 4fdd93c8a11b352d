// What libusb says, in this driver's words.
#include "usb_errors.h"

#include <libusb-1.0/libusb.h>

namespace lensd::drivers::uvc {

Error ErrorFromUsb(int code, const std::string& what) {
  const std::string why = what + ": " + libusb_strerror(code);
  switch (code) {
    case LIBUSB_ERROR_NO_DEVICE:
    case LIBUSB_ERROR_NOT_FOUND:
      return {Code::Disconnected, why};
    case LIBUSB_ERROR_BUSY:
      return {Code::Busy, why + ": another program holds it"};
    case LIBUSB_ERROR_ACCESS:
      return {Code::Io, why + ": see the udev rules in docs/drivers/uvc.md"};
    case LIBUSB_ERROR_TIMEOUT:
      return {Code::Timeout, why};
    case LIBUSB_ERROR_NOT_SUPPORTED:
      return {Code::Unsupported, why};
    default:
      return {Code::Protocol, why};
  }
}

Reply::Outcome OutcomeOf(int status) {
  switch (status) {
    case LIBUSB_TRANSFER_COMPLETED:
      return Reply::Outcome::Done;
    case LIBUSB_TRANSFER_STALL:
      return Reply::Outcome::Stalled;
    case LIBUSB_TRANSFER_TIMED_OUT:
      return Reply::Outcome::TimedOut;
    case LIBUSB_TRANSFER_CANCELLED:
      return Reply::Outcome::Cancelled;
    case LIBUSB_TRANSFER_NO_DEVICE:
      return Reply::Outcome::Gone;
    default:
      return Reply::Outcome::Failed;
  }
}

}  // namespace lensd::drivers::uvc
