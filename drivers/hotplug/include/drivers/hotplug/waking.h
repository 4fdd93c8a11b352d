// Opening nodes of USB devices, one after the other.
#pragma once

#include <functional>

namespace lensd::drivers::hotplug {

/// Runs `open`, which opens a device node and returns what open() does, while no other thread of this process opens one
/// in this way. Opening a node wakes its USB device, and of two that sleep on one bus and are woken at once the kernel
/// may lose one: its open() fails with EBUSY, the device is disconnected and comes back under another number (seen with
/// Linux 6.1 and vhci_hcd, each time). An opening that hangs keeps each of the others waiting for 3 s at most. errno is
/// left as `open` left it. From any thread.
int OpenInTurn(const std::function<int()>& open);

}  // namespace lensd::drivers::hotplug
