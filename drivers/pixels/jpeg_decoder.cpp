// Webcams send JPEG pictures that are not quite as the standard has them, and every viewer shows them. Whether a part
// of the picture is lost is told by the codes of libjpeg's warnings; TurboJPEG has only their words.
#include <cstddef>
#include <cstdio>
// clang-format off: jpeglib.h needs the two above, and jerror.h needs jpeglib.h.
#include <jpeglib.h>
#include <jerror.h>
// clang-format on

#include <array>
#include <csetjmp>
#include <string>

#include "drivers/pixels/jpeg.h"

namespace lensd::drivers::pixels {
namespace {

/// What libjpeg had to say of one picture. libjpeg knows it by its first member.
struct Remarks {
  jpeg_error_mgr manager{};
  std::jmp_buf stop{};  ///< where a picture that cannot be decoded ends
  bool at_end = false;  ///< the bytes ended before the end marker
  bool flawed = false;
  bool lost = false;                            ///< a part of the picture is, or all of it
  std::array<char, JMSG_LENGTH_MAX> of_end{};   ///< the words of `at_end`
  std::array<char, JMSG_LENGTH_MAX> of_loss{};  ///< those of the first loss
};

Remarks& RemarksOf(j_common_ptr info) {
  return *reinterpret_cast<Remarks*>(info->err);
}

void NoteLoss(j_common_ptr info) {
  Remarks& remarks = RemarksOf(info);
  if (!remarks.lost) info->err->format_message(info, remarks.of_loss.data());
  remarks.lost = true;
}

[[noreturn]] void OnError(j_common_ptr info) {
  NoteLoss(info);
  std::longjmp(RemarksOf(info).stop, 1);  // no object lives between here and there
}

/// Level below 0: a warning. What else there is to say is for people who trace a decoder.
void OnMessage(j_common_ptr info, int level) {
  if (level >= 0) return;
  Remarks& remarks = RemarksOf(info);
  switch (info->err->msg_code) {
    case JWRN_JPEG_EOF:
      remarks.at_end = true;
      info->err->format_message(info, remarks.of_end.data());
      break;
    case JWRN_EXTRANEOUS_DATA:
    case JWRN_ADOBE_XFORM:
    case JWRN_JFIF_MAJOR:
    case JWRN_NOT_SEQUENTIAL:
      remarks.flawed = true;
      break;
    default:
      NoteLoss(info);
  }
}

void OnOutput(j_common_ptr) {}

struct Wanted {
  std::span<const std::uint8_t> bytes;
  int width;
  int height;
  int channels;
};

enum class Ending { Decoded, OtherSize, Stopped };

/// Everything that may stop at an error, and so without an object that would have to be destroyed.
Ending Run(jpeg_decompress_struct& info, Remarks& remarks, const Wanted& wanted, std::uint8_t* into) {
  if (setjmp(remarks.stop) != 0) return Ending::Stopped;
  jpeg_create_decompress(&info);
  jpeg_mem_src(&info, wanted.bytes.data(), static_cast<unsigned long>(wanted.bytes.size()));
  jpeg_read_header(&info, TRUE);
  if (info.image_width != static_cast<JDIMENSION>(wanted.width) ||
      info.image_height != static_cast<JDIMENSION>(wanted.height)) {
    return Ending::OtherSize;
  }
  info.out_color_space = wanted.channels == 1 ? JCS_GRAYSCALE : JCS_RGB;
  const bool in_one_scan = jpeg_has_multiple_scans(&info) == FALSE;
  jpeg_start_decompress(&info);
  const auto row_bytes = static_cast<std::size_t>(wanted.width) * static_cast<std::size_t>(wanted.channels);
  while (info.output_scanline < info.output_height) {
    JSAMPROW row = into + info.output_scanline * row_bytes;
    jpeg_read_scanlines(&info, &row, 1);
  }
  jpeg_finish_decompress(&info);
  // One scan whose bits sufficed for the last row lacks nothing but its end marker; of several the last may be missing.
  remarks.flawed |= remarks.at_end;
  remarks.lost |= remarks.at_end && !in_one_scan;
  return Ending::Decoded;
}

/// libjpeg's own memory is given back, whichever way the picture ended.
struct Decompressor {
  jpeg_decompress_struct info{};
  Decompressor() = default;
  Decompressor(const Decompressor&) = delete;
  Decompressor& operator=(const Decompressor&) = delete;
  ~Decompressor() { jpeg_destroy_decompress(&info); }
};

}  // namespace

Result<DecodedJpeg> DecodeJpeg(std::span<const std::uint8_t> bytes, int width, int height, int channels) {
  Remarks remarks;
  Decompressor decompressor;
  decompressor.info.err = jpeg_std_error(&remarks.manager);
  remarks.manager.error_exit = OnError;
  remarks.manager.emit_message = OnMessage;
  remarks.manager.output_message = OnOutput;
  DecodedJpeg picture;
  picture.samples.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
                         static_cast<std::size_t>(channels));
  const Ending ending = Run(decompressor.info, remarks, {bytes, width, height, channels}, picture.samples.data());
  if (ending == Ending::OtherSize) {
    return Fail(Code::Protocol, "a JPEG frame is " + std::to_string(decompressor.info.image_width) + " x " +
                                    std::to_string(decompressor.info.image_height) + " where " + std::to_string(width) +
                                    " x " + std::to_string(height) + " was agreed");
  }
  if (remarks.lost) {
    // What the loss looks like depends on where the bytes ended; that they ended is the reason.
    return Fail(Code::Protocol,
                std::string("damaged: ") + (remarks.at_end ? remarks.of_end.data() : remarks.of_loss.data()));
  }
  picture.flawed = remarks.flawed;
  return picture;
}

}  // namespace lensd::drivers::pixels
