// libusb's errors and ends of transfers, translated.
#pragma once

#include <string>

#include "base/result.h"
#include "transport.h"

namespace lensd::drivers::uvc {

/// This driver's errors out of libusb's.
Error ErrorFromUsb(int code, const std::string& what);
/// `status` is a libusb_transfer_status.
Reply::Outcome OutcomeOf(int status);

}  // namespace lensd::drivers::uvc
