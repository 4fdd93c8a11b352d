// Which lenses there are, and how each of them stands.
#include <lensd/client.h>

#include <cstdio>

int main(int argc, char** argv) {
  lensd::Client client(argc > 1 ? argv[1] : "");
  for (const lensd::LensInfo& info : client.List()) {
    const lensd::LensStatus status = client.Status(info.name());
    std::printf("%s: %s, driver %s, %s\n", info.name().c_str(), info.model().value_or("not there").c_str(),
                info.driver().c_str(),
                status.connected() ? status.activity().c_str() : status.error().value_or(status.connection()).c_str());
    for (const lensd::AxisStatus& axis : status.axes())
      std::printf("  %s at %g\n", axis.axis().c_str(), axis.position());
  }
}
