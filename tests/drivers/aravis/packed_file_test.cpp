// Zip files of cameras, with Aravis itself as the judge: what is accepted must do it no harm.
#include "packed_file.h"

#include <arv.h>
#include <gio/gio.h>
#include <gtest/gtest.h>

#include <array>
#include <iostream>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "gobject_handles.h"
#include "test_level.h"
#include "watched_process.h"

namespace lensd {
namespace {

using drivers::aravis::CheckPackedFile;

std::string Number(std::uint64_t number, int size) {
  std::string bytes;
  for (int i = 0; i < size; ++i, number >>= 8) bytes += static_cast<char>(number);
  return bytes;
}

std::string Deflated(const std::string& text) {
  const drivers::aravis::Handle<GZlibCompressor> packer(g_zlib_compressor_new(G_ZLIB_COMPRESSOR_FORMAT_RAW, 9));
  std::vector<char> packed(text.size() + 1000);
  gsize read = 0, written = 0;
  g_converter_convert(G_CONVERTER(packer.get()), text.data(), text.size(), packed.data(), packed.size(),
                      G_CONVERTER_INPUT_AT_END, &read, &written, nullptr);
  return {packed.data(), written};
}

/// A zip file of those texts, each packed or stored, after `before`.
std::string Zip(const std::vector<std::string>& texts, bool packed, const std::string& before = "") {
  std::string files, directory;
  for (const std::string& text : texts) {
    const std::string data = packed ? Deflated(text) : text, name = "camera.xml";
    const std::string facts = Number(packed ? 8 : 0, 2) + Number(0, 8) + Number(data.size(), 4) +
                              Number(text.size(), 4) + Number(name.size(), 2) + Number(3, 2);
    directory += "PK\x01\x02" + Number(20, 2) + Number(20, 2) + Number(0, 2) + facts + Number(4, 2) + Number(0, 8) +
                 Number(files.size(), 4) + name + "xyz" + "note";
    files += "PK\x03\x04" + Number(20, 2) + Number(0, 2) + facts + name + "xyz" + data;
  }
  return before + files + directory + "PK\x05\x06" + Number(0, 4) + Number(texts.size(), 2) + Number(texts.size(), 2) +
         Number(directory.size(), 4) + Number(files.size(), 4) + Number(0, 2);
}

std::string Description() {
  std::string text = "<RegisterDescription>";
  for (int i = 0; i < 100; ++i) text += "<Integer Name=\"N" + std::to_string(i) + "\"><Value>1</Value></Integer>\n";
  return text + "</RegisterDescription>";
}

/// What Aravis makes of it: the text of the first file, as when it opens a camera.
std::string UnpackedByAravis(const std::string& bytes) {
  ArvZip* zip = arv_zip_new(bytes.data(), bytes.size());
  std::string text;
  if (const GSList* files = arv_zip_get_file_list(zip)) {
    std::size_t size = 0;
    auto* unpacked =
        static_cast<char*>(arv_zip_get_file(zip, arv_zip_file_get_name(static_cast<ArvZipFile*>(files->data)), &size));
    if (unpacked != nullptr) text.assign(unpacked, size);
    g_free(unpacked);
  }
  arv_zip_free(zip);
  return text;
}

TEST(PackedFile, ZipFilesThatAreWellAreAccepted) {
  for (const bool packed : {false, true}) {
    for (const std::string& before : {std::string(), std::string("#!stub\n")}) {
      for (const std::size_t count : {1U, 3U}) {
        const std::string zip = Zip(std::vector<std::string>(count, Description()), packed, before);
        const auto checked = CheckPackedFile(zip);
        EXPECT_TRUE(checked) << checked.error().message;
        EXPECT_EQ(UnpackedByAravis(zip), Description()) << "this test's own zip files";
      }
    }
  }
}

TEST(PackedFile, WhatIsNoneIsRefused) {
  const std::string zip = Zip({Description()}, true);
  for (const std::string& bad : {std::string(), std::string("PK\x05\x06"), Description(), zip.substr(0, zip.size() - 4),
                                 zip.substr(1), Zip({}, true)}) {
    const auto checked = CheckPackedFile(bad);
    ASSERT_FALSE(checked) << bad.size();
    EXPECT_EQ(checked.error().code, Code::BadData);
  }
  std::string large = zip;
  large.replace(zip.find("PK\x01\x02") + 24, 4, Number(17 << 20, 4));
  EXPECT_NE(CheckPackedFile(large).error().message.find("unpacks to 17825792 bytes"), std::string::npos);
}

/// Bytes and lengths that are wrong, most of them where a zip file has its numbers.
std::string Spoilt(const std::vector<std::string>& good, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto below = [&](std::size_t count) {
    return std::uniform_int_distribution<std::size_t>(0, count - 1)(random);
  };
  std::string zip = good[seed % good.size()];
  if (below(8) == 0) return zip;
  if (below(8) == 0) zip.resize(below(zip.size()) + 1);
  for (std::size_t i = 0, count = 1 + below(4); i < count; ++i) {
    const std::array<std::size_t, 3> places = {zip.rfind("PK\x05\x06"), zip.rfind("PK\x01\x02"),
                                               zip.rfind("PK\x03\x04")};
    const std::size_t place = below(4) == 0 ? std::string::npos : places[below(places.size())];
    const std::size_t at = place == std::string::npos ? below(zip.size()) : place + below(46);
    if (at >= zip.size()) continue;
    const std::array<std::size_t, 4> values = {0, 0xff, static_cast<unsigned char>(zip[at]) + 1U, below(256)};
    zip[at] = static_cast<char>(values[below(values.size())]);
  }
  return zip;
}

TEST(PackedFile, WhatIsAcceptedDoesNoHarmAndMuchIs) {
  drivers::aravis::TameGlib();
  std::vector<std::string> good;
  for (const bool packed : {false, true}) {
    for (const std::size_t count : {1U, 3U})
      good.push_back(Zip(std::vector<std::string>(count, Description()), packed));
  }
  const auto count = static_cast<std::uint64_t>(testing::ByLevel(2000, 5000, 1'000'000));
  const auto watched = testing::WatchWork(
      0, count, 2.0, 10, [&](std::uint64_t seed) { return Spoilt(good, seed); },
      [](const std::string& bytes) {
        // Of its own, without anything behind it: what reads beyond its end is seen, at least by AddressSanitizer.
        const std::string exact(bytes.data(), bytes.size());
        if (!CheckPackedFile(exact)) return false;
        UnpackedByAravis(exact);
        return true;
      });
  std::cout << watched.done << " zip files, " << watched.counted << " accepted\n";
  for (const auto& [seed, what] : watched.bad) ADD_FAILURE() << "seed " << seed << ": " << what;
  EXPECT_GT(watched.counted * 10, count * 2);
  EXPECT_LT(watched.counted * 10, count * 9);
}

}  // namespace
}  // namespace lensd
