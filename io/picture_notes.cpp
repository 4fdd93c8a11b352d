// EXIF is a TIFF file without a picture: a directory of numbered fields, and what does not fit into four bytes behind
// it. XMP is a piece of RDF. A PNG has chunks for both, a JPEG segments.
#include "io/picture_notes.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <span>
#include <string_view>

#include "io/svg.h"

namespace lensd::io {
namespace {

using Bytes = std::vector<std::uint8_t>;

void PutLittle(Bytes& out, std::uint32_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) out.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

void PutBig(Bytes& out, std::uint32_t value, int bytes) {
  for (int i = bytes - 1; i >= 0; --i) out.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

void PutText(Bytes& out, std::string_view text) {
  out.insert(out.end(), text.begin(), text.end());
}

/// One field of a directory.
struct Field {
  enum Type : std::uint16_t { Ascii = 2, Long = 4, Rational = 5, Undefined = 7 };
  std::uint16_t tag;
  Type type;
  std::uint32_t count;  ///< of values, not of bytes
  Bytes value;
};

Field TextField(std::uint16_t tag, std::string_view text) {
  Field field{tag, Field::Ascii, static_cast<std::uint32_t>(text.size() + 1), {}};
  PutText(field.value, text);
  field.value.push_back(0);
  return field;
}

/// A fraction with as many decimals as fit; EXIF writes infinity as the largest numerator.
Field FractionField(std::uint16_t tag, double value) {
  constexpr auto kLargest = std::numeric_limits<std::uint32_t>::max();
  std::uint32_t above = kLargest, below = 1;
  if (value < kLargest) {
    below = 1'000'000;
    while (below > 1 && value * below >= kLargest) below /= 10;
    above = static_cast<std::uint32_t>(std::llround(value * below));
  }
  Field field{tag, Field::Rational, 1, {}};
  PutLittle(field.value, above, 4);
  PutLittle(field.value, below, 4);
  return field;
}

/// A directory that begins at `offset` of its TIFF file, and after it what its fields point to.
Bytes Directory(std::vector<Field> fields, std::uint32_t offset) {
  std::ranges::sort(fields, {}, &Field::tag);
  Bytes entries, behind;
  PutLittle(entries, static_cast<std::uint32_t>(fields.size()), 2);
  const auto after = offset + 2 + 12 * static_cast<std::uint32_t>(fields.size()) + 4;
  for (Field& field : fields) {
    PutLittle(entries, field.tag, 2);
    PutLittle(entries, field.type, 2);
    PutLittle(entries, field.count, 4);
    if (field.value.size() <= 4) {
      field.value.resize(4);
      entries.insert(entries.end(), field.value.begin(), field.value.end());
      continue;
    }
    PutLittle(entries, after + static_cast<std::uint32_t>(behind.size()), 4);
    behind.insert(behind.end(), field.value.begin(), field.value.end());
    if (behind.size() % 2 != 0) behind.push_back(0);
  }
  PutLittle(entries, 0, 4);  // no directory follows
  entries.insert(entries.end(), behind.begin(), behind.end());
  return entries;
}

Bytes Exif(const PictureNotes& notes) {
  constexpr std::uint32_t kHeader = 8;
  std::vector<Field> exif{{0x9000, Field::Undefined, 4, {'0', '2', '3', '2'}}};
  if (notes.exposure_s) exif.push_back(FractionField(0x829A, *notes.exposure_s));
  if (notes.f_number) exif.push_back(FractionField(0x829D, *notes.f_number));
  if (!notes.taken.empty()) exif.push_back(TextField(0x9003, notes.taken));
  if (notes.distance_m) exif.push_back(FractionField(0x9206, *notes.distance_m));
  if (notes.focal_length_mm) exif.push_back(FractionField(0x920A, *notes.focal_length_mm));
  if (!notes.lens.empty()) exif.push_back(TextField(0xA434, notes.lens));
  std::vector<Field> image;
  if (!notes.software.empty()) image.push_back(TextField(0x0131, notes.software));
  Field pointer{0x8769, Field::Long, 1, Bytes(4)};
  image.push_back(pointer);
  const auto inner = kHeader + static_cast<std::uint32_t>(Directory(image, kHeader).size());
  image.back().value.clear();
  PutLittle(image.back().value, inner, 4);
  Bytes tiff;
  PutText(tiff, "II");
  PutLittle(tiff, 42, 2);
  PutLittle(tiff, kHeader, 4);
  for (const Bytes& part : {Directory(image, kHeader), Directory(exif, inner)}) {
    tiff.insert(tiff.end(), part.begin(), part.end());
  }
  return tiff;
}

std::string Xmp(const PictureNotes& notes) {
  std::string text =
      "<?xpacket begin=\"\xEF\xBB\xBF\" id=\"W5M0MpCehiHzreSzNTczkc9d\"?>\n"
      "<x:xmpmeta xmlns:x=\"adobe:ns:meta/\">\n"
      "<rdf:RDF xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\">\n"
      "<rdf:Description rdf:about=\"\" xmlns:lensd=\"" +
      std::string(kNotesNamespace) + "\"";
  for (const auto& [name, value] : notes.own) text += "\n lensd:" + name + "=\"" + Escaped(value) + "\"";
  return text + "/>\n</rdf:RDF>\n</x:xmpmeta>\n<?xpacket end=\"r\"?>";
}

void PutChunk(Bytes& out, std::string_view type, const Bytes& data) {
  PutBig(out, static_cast<std::uint32_t>(data.size()), 4);
  Bytes checked;
  PutText(checked, type);
  checked.insert(checked.end(), data.begin(), data.end());
  out.insert(out.end(), checked.begin(), checked.end());
  PutBig(out, static_cast<std::uint32_t>(crc32(0, checked.data(), static_cast<uInt>(checked.size()))), 4);
}

/// Right behind the header, the first chunk.
void AddToPng(Bytes& file, const PictureNotes& notes) {
  constexpr std::ptrdiff_t kBehindHeader = 8 + 4 + 4 + 13 + 4;
  Bytes chunks, text;
  PutChunk(chunks, "eXIf", Exif(notes));
  PutText(text, "XML:com.adobe.xmp");
  text.resize(text.size() + 5);  // the keyword's end, not compressed, no language, no translation
  PutText(text, Xmp(notes));
  PutChunk(chunks, "iTXt", text);
  file.insert(file.begin() + kBehindHeader, chunks.begin(), chunks.end());
}

void PutSegment(Bytes& out, std::string_view name, std::span<const std::uint8_t> data) {
  constexpr std::uint8_t kApp1 = 0xE1;
  out.insert(out.end(), {0xFF, kApp1});
  PutBig(out, static_cast<std::uint32_t>(2 + name.size() + data.size()), 2);
  PutText(out, name);
  out.insert(out.end(), data.begin(), data.end());
}

/// Behind the JFIF header where there is one, which has to be first.
void AddToJpeg(Bytes& file, const PictureNotes& notes) {
  std::size_t at = 2;
  if (file.size() > 6 && file[2] == 0xFF && file[3] == 0xE0) at += 2 + (std::size_t{file[4]} << 8U | file[5]);
  const std::string xmp = Xmp(notes);
  const Bytes xmp_bytes(xmp.begin(), xmp.end());
  Bytes segments;
  PutSegment(segments, std::string_view("Exif\0\0", 6), Exif(notes));
  PutSegment(segments, std::string_view("http://ns.adobe.com/xap/1.0/\0", 29), xmp_bytes);
  file.insert(file.begin() + static_cast<std::ptrdiff_t>(std::min(at, file.size())), segments.begin(), segments.end());
}

template <std::size_t size>
bool BeginsWith(const Bytes& file, const std::array<std::uint8_t, size>& magic, std::size_t at_least) {
  return file.size() >= at_least && std::equal(magic.begin(), magic.end(), file.begin());
}

std::string Unescaped(std::string_view text) {
  std::string plain;
  for (std::size_t at = 0; at < text.size();) {
    bool found = false;
    for (const auto& [escape, letter] :
         {std::pair<std::string_view, char>{"&amp;", '&'}, {"&lt;", '<'}, {"&quot;", '"'}}) {
      if (!text.substr(at).starts_with(escape)) continue;
      plain += letter;
      at += escape.size();
      found = true;
    }
    if (!found) plain += text[at++];
  }
  return plain;
}

/// The properties that Xmp() writes: lensd:NAME="VALUE".
std::vector<std::pair<std::string, std::string>> OwnOf(std::string_view xmp) {
  constexpr std::string_view kPrefix = " lensd:";
  std::vector<std::pair<std::string, std::string>> own;
  if (xmp.find(kNotesNamespace) == xmp.npos) return own;
  for (std::size_t at = xmp.find(kPrefix); at != xmp.npos; at = xmp.find(kPrefix, at)) {
    at += kPrefix.size();
    const std::size_t equals = xmp.find("=\"", at);
    const std::size_t end = equals == xmp.npos ? xmp.npos : xmp.find('"', equals + 2);
    if (end == xmp.npos) break;
    own.emplace_back(xmp.substr(at, equals - at), Unescaped(xmp.substr(equals + 2, end - equals - 2)));
    at = end;
  }
  return own;
}

std::uint32_t BigAt(const char* bytes) {
  std::uint32_t value = 0;
  for (int i = 0; i < 4; ++i) value = value << 8U | static_cast<std::uint8_t>(bytes[i]);
  return value;
}

}  // namespace

Result<std::vector<std::pair<std::string, std::string>>> ReadOwnNotes(const std::string& path) {
  constexpr std::string_view kSignature = "\x89PNG\r\n\x1A\n", kXmp("XML:com.adobe.xmp\0\0\0\0\0", 22);
  constexpr std::uint32_t kLongest = 1U << 20U;
  std::ifstream file(path, std::ios::binary);
  if (!file) return Fail(Code::Io, path + ": " + std::strerror(errno));
  std::array<char, 8> head{};
  if (!file.read(head.data(), head.size()) || std::string_view(head.data(), head.size()) != kSignature) {
    return Fail(Code::BadData, path + ": not a PNG file");
  }
  while (file.read(head.data(), head.size())) {
    const std::uint32_t length = BigAt(head.data());
    const std::string_view kind(head.data() + 4, 4);
    if (kind == "IDAT" || kind == "IEND") return std::vector<std::pair<std::string, std::string>>{};
    if (kind != "iTXt" || length > kLongest) {
      file.seekg(std::streamoff{length} + 4, std::ios::cur);
      continue;
    }
    std::string text(std::size_t{length} + 4, 0);
    if (!file.read(text.data(), static_cast<std::streamsize>(text.size()))) break;
    text.resize(length);
    if (text.starts_with(kXmp)) return OwnOf(std::string_view(text).substr(kXmp.size()));
  }
  return Fail(Code::BadData, path + ": the file ends before its picture begins");
}

Result<void> AddNotes(std::vector<std::uint8_t>& file, const PictureNotes& notes) {
  constexpr std::array<std::uint8_t, 8> kPng = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
  constexpr std::array<std::uint8_t, 3> kJpeg = {0xFF, 0xD8, 0xFF};
  if (BeginsWith(file, kPng, 33)) {
    AddToPng(file, notes);
  } else if (BeginsWith(file, kJpeg, 4)) {
    AddToJpeg(file, notes);
  } else {
    return Fail(Code::BadData, "this is no PNG and no JPEG: it has no place for EXIF and XMP");
  }
  return {};
}

}  // namespace lensd::io
