// Reads /sys and /proc alone; what may not be read is passed over, since doctor need not be root.
#include "cli/online/setup/doctor_machine.h"

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <fstream>
#include <system_error>

namespace lensd::cli {
namespace {

namespace fs = std::filesystem;

constexpr long kJumbo = 8000;                      ///< bytes; packets of 8192 and more need it
constexpr long kReceiveBuffer = 4L * 1024 * 1024;  ///< bytes: some frames of a megapixel camera

/// The first line of a small file; empty where it cannot be read.
std::string LineOf(const fs::path& file) {
  std::ifstream stream(file);
  std::string line;
  std::getline(stream, line);
  return line;
}

long NumberOf(const fs::path& file) {
  return std::strtol(LineOf(file).c_str(), nullptr, 10);
}

/// What is in a folder, as far as it can be read: processes come and go while it is.
std::vector<fs::path> EntriesOf(const fs::path& folder) {
  std::vector<fs::path> entries;
  std::error_code failed;
  for (fs::directory_iterator next(folder, failed), end; !failed && next != end; next.increment(failed)) {
    entries.push_back(next->path());
  }
  return entries;
}

void CheckModules(const std::set<std::string>& drivers, const fs::path& root, Findings& findings) {
  struct Needed {
    const char* driver;
    const char* folder;  ///< that the module makes
    const char* module;
  };
  for (const Needed& needed :
       {Needed{"v4l2", "sys/class/video4linux", "videodev"}, Needed{"uvc", "sys/bus/usb/devices", "usbcore"},
        Needed{"lensconnect", "sys/class/hidraw", "hid_generic"}}) {
    std::error_code failed;
    if (!drivers.contains(needed.driver) || fs::exists(root / needed.folder, failed)) continue;
    findings.Problem("kernel", std::string("the driver ") + needed.driver + " finds no /" + needed.folder,
                     std::string("sudo modprobe ") + needed.module +
                         "; a line with that name in /etc/modules-load.d/lensd.conf does it at every start");
  }
}

/// Of network cameras.
void CheckNetwork(const fs::path& root, Findings& findings) {
  const long most = NumberOf(root / "proc/sys/net/core/rmem_max");
  if (most > 0 && most < kReceiveBuffer) {
    findings.Warn("network",
                  "receive buffers are " + std::to_string(most) + " bytes at most: frames of GigE cameras get lost",
                  "sudo sysctl -w net.core.rmem_max=33554432; the line net.core.rmem_max=33554432 in /etc/sysctl.d/ "
                  "makes it permanent");
  }
  for (const fs::path& card : EntriesOf(root / "sys/class/net")) {
    constexpr long kEthernet = 1;  // ARPHRD_ETHER
    const std::string name = card.filename();
    if (NumberOf(card / "type") != kEthernet || LineOf(card / "operstate") != "up") continue;
    const long mtu = NumberOf(card / "mtu");
    if (mtu >= kJumbo) {
      findings.Ok("network", name + " carries packets of " + std::to_string(mtu) + " bytes");
    } else {
      findings.Warn("network",
                    name + " carries packets of " + std::to_string(mtu) +
                        " bytes; GigE cameras lose fewer frames with large ones",
                    "if a camera is behind it: sudo ip link set " + name + " mtu 9000, and packet_size = 8192");
    }
  }
}

/// Frames and moves are put together by CLOCK_MONOTONIC.
void CheckClock(const fs::path& root, Findings& findings) {
  const std::string source = LineOf(root / "sys/devices/system/clocksource/clocksource0/current_clocksource");
  if (source == "hpet" || source == "acpi_pm" || source == "jiffies" || source == "refined-jiffies") {
    findings.Warn("clock", "the kernel keeps its time by " + source + ", which is slow to read or coarse",
                  "dmesg | grep -i tsc shows why it does not use the processor's own counter");
  } else if (!source.empty()) {
    findings.Ok("clock", "the kernel keeps its time by " + source);
  }
}

/// "NAME (process 12)".
std::string ProcessText(std::string name, const std::string& number) {
  return name.append(" (process ").append(number).append(")");
}

/// Programs other than lensd that have the node open, as far as this user may see.
std::vector<std::string> HoldersOf(const std::string& node, const fs::path& root) {
  std::vector<std::string> holders;
  for (const fs::path& process : EntriesOf(root / "proc")) {
    const std::string number = process.filename();
    if (!std::ranges::all_of(number, [](unsigned char digit) { return std::isdigit(digit) != 0; })) continue;
    const std::string name = LineOf(process / "comm");
    if (name.starts_with("lensd")) continue;
    const auto opens = [&](const fs::path& open) {
      std::error_code gone;
      return fs::read_symlink(open, gone) == node && !gone;
    };
    if (std::ranges::any_of(EntriesOf(process / "fd"), opens)) holders.push_back(ProcessText(name, number));
  }
  return holders;
}

}  // namespace

void CheckMachine(const std::set<std::string>& drivers, const std::vector<std::string>& nodes, const fs::path& root,
                  Findings& findings) {
  CheckModules(drivers, root, findings);
  if (drivers.contains("aravis")) CheckNetwork(root, findings);
  CheckClock(root, findings);
  for (const std::string& node : nodes) {
    if (!node.starts_with("/dev/")) continue;
    for (std::string& holder : HoldersOf(node, root)) {
      findings.Warn("devices", node + " is open in " + std::move(holder) + " too",
                    "end that program: two programs on one device disturb each other's answers");
    }
  }
}

}  // namespace lensd::cli
