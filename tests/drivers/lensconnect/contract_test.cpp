// The contract suite over the driver on the simulated lens.
#include "lensconnect_lens.h"
#include "model_in_process.h"
#include "model_transport.h"
#include "stand.h"
#include "test_level.h"

namespace lensd {
namespace {

class LensConnectStand final : public contract::SteppedStand {
 public:
  Result<drivers::Device> Open() override {
    auto transport = std::make_unique<testing::ModelTransport>(model_, clock_);
    auto lens = drivers::lensconnect::LensConnectLens::Open(std::move(transport), {}, "A123", findings_, clock_);
    if (!lens) return PassOn(lens);
    return drivers::Device{.lens = *std::move(lens), .camera = nullptr, .optics = std::nullopt};
  }
  bool Unplug() override {
    model_->plugged = false;
    return true;
  }
  void Plug() override { model_->plugged = true; }

 private:
  std::shared_ptr<testing::ModelLens> model_ = std::make_shared<testing::ModelLens>(clock_);
  drivers::Findings findings_;
};

struct LensConnectInProcess final : contract::ModelInProcess {
  LensConnectInProcess() : ModelInProcess("lensconnect-model-driver", "lensconnect") {}
};

/// Opening one takes seconds of waiting, so CI runs the driver in a process in the virtual machine alone.
std::vector<contract::MakeStand> InProcess() {
  if (testing::ByLevel(0, 0, 1) == 0) return {};
  return {[]() -> std::unique_ptr<contract::Stand> { return std::make_unique<LensConnectInProcess>(); }};
}

INSTANTIATE_TEST_SUITE_P(LensConnectInProcess, LensContract, ::testing::ValuesIn(InProcess()));
INSTANTIATE_TEST_SUITE_P(LensConnect, LensContract, contract::Stands<LensConnectStand>());

}  // namespace
}  // namespace lensd
