// The transport over libusb: a private context, a thread that handles its events, asynchronous transfers only.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "transport.h"

namespace lensd::drivers::uvc {

struct LinkOptions {
  std::string node;                      ///< "/dev/bus/usb/001/004"
  std::vector<std::uint8_t> interfaces;  ///< to claim, in this order; given back in the reverse one
  std::uint8_t status_endpoint = 0;      ///< 0: none
  std::uint16_t status_bytes = 0;
};

/// Opens and claims, taking the interfaces from the kernel's driver, which gets them back when the transport is
/// destroyed. Disconnected: no such node. Busy: claimed by another program. Io: not permitted.
Result<std::shared_ptr<Transport>> OpenLink(const LinkOptions& options);

}  // namespace lensd::drivers::uvc
