// Encoding, through TurboJPEG.
#include "drivers/pixels/jpeg.h"

#include <turbojpeg.h>

#include <memory>
#include <string>

namespace lensd::drivers::pixels {
namespace {

struct EndEncoder {
  void operator()(void* handle) const { tjDestroy(handle); }
};
struct FreeBytes {
  void operator()(unsigned char* bytes) const { tjFree(bytes); }
};

constexpr int kLongestSide = 65535;

}  // namespace

Result<std::vector<std::uint8_t>> EncodeJpeg(std::span<const std::uint8_t> samples, int width, int height, int channels,
                                             int quality) {
  const bool possible = width >= 1 && height >= 1 && width <= kLongestSide && height <= kLongestSide &&
                        (channels == 1 || channels == 3) && quality >= 1 && quality <= 100;
  if (!possible || samples.size() != static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
                                         static_cast<std::size_t>(channels)) {
    return Fail(Code::InvalidArgument, "no JPEG can be made of such a picture");
  }
  const std::unique_ptr<void, EndEncoder> encoder(tjInitCompress());
  if (!encoder) return Fail(Code::Internal, "no JPEG encoder could be made");
  unsigned char* made = nullptr;
  unsigned long size = 0;
  const bool grey = channels == 1;
  const int failed = tjCompress2(encoder.get(), samples.data(), width, 0, height, grey ? TJPF_GRAY : TJPF_RGB, &made,
                                 &size, grey ? TJSAMP_GRAY : TJSAMP_420, quality, TJFLAG_FASTDCT);
  const std::unique_ptr<unsigned char, FreeBytes> bytes(made);
  if (failed != 0) return Fail(Code::Internal, std::string("JPEG: ") + tjGetErrorStr2(encoder.get()));
  return std::vector<std::uint8_t>(made, made + size);
}

}  // namespace lensd::drivers::pixels
