// The contract of lenses and cameras, over GigE Vision on loopback.
#include "gige_stand.h"
#include "test_level.h"

namespace lensd {
namespace {

class SfncStand final : public testing::GigeStand {};

class BaslerStand final : public testing::GigeStand {
 public:
  BaslerStand() : GigeStand({.names = "basler"}) {}
};

/// The same driver under other names: only where there is time.
std::vector<contract::MakeStand> BaslerStands() {
  if (testing::ByLevel(0, 0, 1) == 0) return {};
  return {[]() -> std::unique_ptr<contract::Stand> { return std::make_unique<BaslerStand>(); }};
}

}  // namespace

INSTANTIATE_TEST_SUITE_P(Gige, LensContract, contract::Stands<SfncStand>());
INSTANTIATE_TEST_SUITE_P(Gige, CameraContract, contract::Stands<SfncStand>());
INSTANTIATE_TEST_SUITE_P(GigeBasler, LensContract, ::testing::ValuesIn(BaslerStands()));

}  // namespace lensd
