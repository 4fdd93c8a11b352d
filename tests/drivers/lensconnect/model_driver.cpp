// The driver on a simulated lens, as a process. The lens is plugged in while the file that its settings name is there.
#include <unistd.h>

#include "drivers/host/host.h"
#include "lensconnect_lens.h"
#include "model_transport.h"
#include "sleeping_clock.h"

namespace lensd::testing {
namespace {

class Plugged final : public drivers::lensconnect::Transport {
 public:
  explicit Plugged(std::string file) : file_(std::move(file)) {}

  Result<void> Write(std::span<const std::uint8_t> report) override { return Look().Write(report); }
  Result<std::size_t> Read(std::span<std::uint8_t> buffer, Duration patience) override {
    return Look().Read(buffer, patience > kQuiet ? kTimes * patience : patience);
  }
  Result<void> SetFeature(std::span<const std::uint8_t> report) override { return Look().SetFeature(report); }
  Result<std::size_t> GetFeature(std::span<std::uint8_t> buffer) override { return Look().GetFeature(buffer); }
  void Interrupt() override { wire_.Interrupt(); }
  void BeginCall() override { wire_.BeginCall(); }

 private:
  Transport& Look() {
    model_->plugged = access(file_.c_str(), F_OK) == 0;
    return wire_;
  }

  /// The time of the lens passes so many times more quickly: the test waits for it.
  static constexpr int kTimes = 20;
  /// The driver listens for so long for replies that are late by the time of the lens; for others it waits as long as a
  /// busy machine needs.
  static constexpr Duration kQuiet = std::chrono::milliseconds(20);

  const std::string file_;
  SleepingClock clock_{kTimes};
  std::shared_ptr<ModelLens> model_ = std::make_shared<ModelLens>(clock_);
  TransportOn<SleepingClock> wire_{model_, clock_};
};

Result<drivers::Device> OpenModel(const Settings& settings, const Clock& clock) {
  SettingsReader read(settings, "the model");
  const std::string file = read.RequiredText("plugged");
  if (auto done = read.Finish(); !done) return PassOn(done);
  drivers::Device device;
  auto lens =
      drivers::lensconnect::LensConnectLens::Open(std::make_unique<Plugged>(file), {}, "A123", device.findings, clock);
  if (!lens) return PassOn(lens);
  device.lens = *std::move(lens);
  return device;
}

}  // namespace
}  // namespace lensd::testing

int main() {
  lensd::drivers::host::RunHost({.name = "lensconnect", .open = lensd::testing::OpenModel});
}
