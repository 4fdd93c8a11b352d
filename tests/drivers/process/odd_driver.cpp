// The odd driver as a process.
#include "odd_driver.h"

#include "drivers/host/host.h"

int main() {
  lensd::drivers::host::RunHost(lensd::testing::odd::kDriver);
}
