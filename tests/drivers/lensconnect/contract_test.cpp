// The contract suite over the driver on the simulated lens.
#include "lensconnect_lens.h"
#include "model_transport.h"
#include "stand.h"

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

INSTANTIATE_TEST_SUITE_P(LensConnect, LensContract, contract::Stands<LensConnectStand>());

}  // namespace
}  // namespace lensd
