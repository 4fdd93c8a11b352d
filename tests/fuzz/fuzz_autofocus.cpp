// A search for focus by scores that may be anything: it asks for places within the travel only, comes to an end, and
// what it then claims lies within the travel.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <variant>

#include "autofocus/session.h"

namespace {

using namespace lensd::autofocus;

class Bytes {
 public:
  explicit Bytes(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  unsigned Next() {
    if (bytes_.empty()) return 0;
    const unsigned byte = bytes_[0];
    bytes_ = bytes_.subspan(1);
    return byte;
  }
  bool empty() const { return bytes_.empty(); }

 private:
  std::span<const std::uint8_t> bytes_;
};

/// From 1e-12 to 1e12, evenly in its logarithm.
double Positive(Bytes& bytes) {
  return std::pow(10.0, bytes.Next() / 255.0 * 24.0 - 12.0);
}

Setup SetupOf(Bytes& bytes) {
  const unsigned kind = bytes.Next();
  Setup setup;
  setup.pictures = false;
  setup.lowest = (bytes.Next() - 128.0) * ((kind & 1U) != 0 ? 1e-5 : 10.0);
  const double travel = (bytes.Next() + 1.0) * ((kind & 1U) != 0 ? 1e-5 : 40.0);
  setup.highest = setup.lowest + travel;
  setup.resolution = travel / (1 << (bytes.Next() % 16));
  if ((kind & 2U) != 0) setup.blur_px = travel / (1 << (bytes.Next() % 12));
  if ((kind & 4U) != 0) setup.stride = travel / (1 << (bytes.Next() % 10));
  if ((kind & 8U) != 0) setup.backlash = travel / (2 << (bytes.Next() % 12));
  if ((kind & 16U) != 0) setup.step = std::max(setup.resolution, travel / (1 << (bytes.Next() % 10)));
  if ((kind & 32U) != 0) setup.ends = Setup::Ends::Chosen;
  setup.ascending = (kind & 64U) != 0;
  setup.near_is_high = (kind & 128U) != 0;
  return setup;
}

void Check(const Verdict& verdict, const Setup& setup) {
  if (verdict.reason.empty()) __builtin_trap();
  if (!(verdict.confidence >= 0.0 && verdict.confidence <= 1.0)) __builtin_trap();
  if (!verdict.focused) return;
  const double slack = setup.resolution;
  if (!(verdict.position >= setup.lowest - slack && verdict.position <= setup.highest + slack)) __builtin_trap();
  if (!std::isfinite(verdict.sigma) || verdict.sigma < 0.0) __builtin_trap();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr int kMostFrames = 3000;
  Bytes bytes({data, size});
  const auto names = MethodNames();
  const auto method = names[bytes.Next() % names.size()];
  const Setup setup = SetupOf(bytes);
  auto session = Session::Create(method, setup);
  if (!session) return 0;
  double position = setup.lowest + (setup.highest - setup.lowest) * bytes.Next() / 255.0;
  const double scale = Positive(bytes), noise = Positive(bytes);
  for (int frame = 0; frame < kMostFrames; ++frame) {
    const Sharpness seen{scale * (1.0 + bytes.Next()), noise * (1.0 + bytes.Next() % 4)};
    const Advice advice = session->NextScore(position, seen);
    if (const auto* verdict = std::get_if<Verdict>(&advice)) {
      Check(*verdict, setup);
      return 0;
    }
    const auto& go = std::get<GoAndLook>(advice);
    const double slack = setup.resolution;
    if (!(go.position >= setup.lowest - slack && go.position <= setup.highest + slack)) __builtin_trap();
    if (!(go.stride >= 0.0)) __builtin_trap();
    position = go.position;
  }
  __builtin_trap();  // it never ends
}
