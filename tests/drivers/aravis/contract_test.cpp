// The contract of lenses and cameras, over GigE Vision on loopback.
#include "gige_stand.h"

namespace lensd {
namespace {

class SfncStand final : public testing::GigeStand {};

class BaslerStand final : public testing::GigeStand {
 public:
  BaslerStand() : GigeStand({.names = "basler"}) {}
};

}  // namespace

INSTANTIATE_TEST_SUITE_P(Gige, LensContract, contract::Stands<SfncStand>());
INSTANTIATE_TEST_SUITE_P(Gige, CameraContract, contract::Stands<SfncStand>());
INSTANTIATE_TEST_SUITE_P(GigeBasler, LensContract, contract::Stands<BaslerStand>());

}  // namespace lensd
