// libpng behind Result: its long jumps end here. Rows are read into 8 or 16 bits as the file has them; sizes are
// checked before memory is taken.
#include "io/png.h"

#include <png.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>

namespace lensd::io {
namespace {

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

constexpr std::size_t kMostSamples = std::size_t{1} << 28;

// libpng reports errors by a call that must not return; the message travels in an exception of our own.
struct PngError {
  std::string message;
};
[[noreturn]] void OnError(png_structp, png_const_charp message) {
  throw PngError{message};
}
void OnWarning(png_structp, png_const_charp) {}

struct Reader {
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, OnError, OnWarning);
  png_infop info = png_create_info_struct(png);
  Reader() = default;
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;
  ~Reader() { png_destroy_read_struct(&png, &info, nullptr); }
};

struct Writer {
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, OnError, OnWarning);
  png_infop info = png_create_info_struct(png);
  Writer() = default;
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;
  ~Writer() { png_destroy_write_struct(&png, &info); }
};

void ReadRows(Reader& reader, Image& image) {
  const std::size_t row_samples = static_cast<std::size_t>(image.width) * image.channels;
  const std::size_t sample_bytes = image.bits == 16 ? 2 : 1;
  std::vector<std::uint8_t> bytes(row_samples * sample_bytes * image.height);
  std::vector<png_bytep> rows(image.height);
  for (int y = 0; y < image.height; ++y) rows[y] = bytes.data() + row_samples * sample_bytes * y;
  png_read_image(reader.png, rows.data());
  image.samples.resize(row_samples * image.height);
  for (std::size_t i = 0; i < image.samples.size(); ++i) {
    image.samples[i] = sample_bytes == 2 ? static_cast<std::uint16_t>(bytes[2 * i] << 8 | bytes[2 * i + 1]) : bytes[i];
  }
}

}  // namespace

Result<Image> ReadPng(const std::string& path) {
  const File file(std::fopen(path.c_str(), "rb"));
  if (!file) return Fail(Code::Io, path + ": " + std::strerror(errno));
  std::uint8_t signature[8] = {};
  if (std::fread(signature, 1, sizeof signature, file.get()) != sizeof signature ||
      png_sig_cmp(signature, 0, sizeof signature) != 0) {
    return Fail(Code::BadData, path + ": not a PNG file");
  }
  Reader reader;
  try {
    png_init_io(reader.png, file.get());
    png_set_sig_bytes(reader.png, sizeof signature);
    png_read_info(reader.png, reader.info);
    png_set_expand(reader.png);
    png_set_strip_alpha(reader.png);
    png_set_interlace_handling(reader.png);
    png_read_update_info(reader.png, reader.info);
    Image image;
    image.width = static_cast<int>(png_get_image_width(reader.png, reader.info));
    image.height = static_cast<int>(png_get_image_height(reader.png, reader.info));
    image.channels = png_get_channels(reader.png, reader.info);
    image.bits = png_get_bit_depth(reader.png, reader.info);
    const std::size_t samples = static_cast<std::size_t>(image.width) * image.height * image.channels;
    if (samples > kMostSamples) return Fail(Code::BadData, path + ": larger than 2^28 samples");
    ReadRows(reader, image);
    return image;
  } catch (const PngError& error) {
    return Fail(Code::BadData, path + ": " + error.message);
  }
}

Result<std::vector<std::uint8_t>> EncodePng(const Image& image) {
  const std::size_t row_samples = static_cast<std::size_t>(image.width) * image.channels;
  if (image.width < 1 || image.height < 1 || (image.channels != 1 && image.channels != 3) ||
      (image.bits != 8 && image.bits != 16) || image.samples.size() != row_samples * image.height) {
    return Fail(Code::InvalidArgument, "an image to encode needs 1 or 3 channels, 8 or 16 bits and all its samples");
  }
  std::vector<std::uint8_t> encoded;
  Writer writer;
  try {
    png_set_write_fn(
        writer.png, &encoded,
        [](png_structp png, png_bytep data, png_size_t size) {
          auto* out = static_cast<std::vector<std::uint8_t>*>(png_get_io_ptr(png));
          out->insert(out->end(), data, data + size);
        },
        nullptr);
    png_set_IHDR(writer.png, writer.info, image.width, image.height, image.bits,
                 image.channels == 3 ? PNG_COLOR_TYPE_RGB : PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_compression_level(writer.png, 3);
    png_write_info(writer.png, writer.info);
    std::vector<std::uint8_t> row(row_samples * (image.bits / 8));
    for (int y = 0; y < image.height; ++y) {
      const std::uint16_t* samples = image.samples.data() + row_samples * y;
      for (std::size_t i = 0; i < row_samples; ++i) {
        if (image.bits == 16) {
          row[2 * i] = static_cast<std::uint8_t>(samples[i] >> 8);
          row[2 * i + 1] = static_cast<std::uint8_t>(samples[i] & 0xff);
        } else {
          row[i] = static_cast<std::uint8_t>(samples[i]);
        }
      }
      png_write_row(writer.png, row.data());
    }
    png_write_end(writer.png, nullptr);
  } catch (const PngError& error) {
    return Fail(Code::Internal, "PNG: " + error.message);
  }
  return encoded;
}

Result<void> WriteFileAtomically(const std::string& path, const void* data, std::size_t size) {
  const std::string temporary = path + "." + std::to_string(::getpid()) + ".tmp";
  File file(std::fopen(temporary.c_str(), "wb"));
  if (!file) return Fail(Code::Io, path + ": " + std::strerror(errno));
  const bool written = std::fwrite(data, 1, size, file.get()) == size;
  const bool flushed = std::fclose(file.release()) == 0;
  if (!written || !flushed || std::rename(temporary.c_str(), path.c_str()) != 0) {
    const std::string why = std::strerror(errno);
    std::remove(temporary.c_str());
    return Fail(Code::Io, path + ": " + why);
  }
  return {};
}

Result<void> WritePng(const std::string& path, const Image& image) {
  const auto encoded = EncodePng(image);
  if (!encoded) return PassOn(encoded);
  return WriteFileAtomically(path, encoded->data(), encoded->size());
}

}  // namespace lensd::io
