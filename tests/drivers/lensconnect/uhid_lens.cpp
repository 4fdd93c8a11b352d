// A simulated LensConnect lens that a script plugs and unplugs: one command a line on stdin, "ok" or "error: ..." back.
//   plug | unplug | lose-power | position AXIS(0 zoom, 1 focus, 2 iris, 3 filter) | busy AXIS | quit
#include <iostream>
#include <sstream>
#include <string>

#include "sim/devices/lensconnect_uhid.h"

int main(int argc, char** argv) {
  lensd::sim::devices::LensConnectUhid lens({}, argc > 1 ? argv[1] : "A123");
  for (std::string line; std::getline(std::cin, line) && line != "quit";) {
    std::istringstream words(line);
    std::string command;
    std::size_t axis = 0;
    words >> command >> axis;
    std::string answer = "ok";
    if (command == "plug") {
      if (const auto plugged = lens.Plug(); !plugged) answer = "error: " + plugged.error().message;
    } else if (command == "unplug") {
      lens.Unplug();
    } else if (command == "lose-power") {
      lens.With([](auto& model) { model.LosePower(); });
    } else if (command == "position" || command == "busy") {
      const auto now = lensd::MonotonicClock().Now();
      lens.With([&](auto& model) {
        const auto& motor = model.motor(static_cast<lensd::sim::devices::LensConnectAxis>(axis & 3));
        answer = std::to_string(command == "busy" ? motor.Busy(now) : motor.Position(now));
      });
    } else {
      answer = "error: what is " + command + "?";
    }
    std::cout << answer << std::endl;
  }
}
