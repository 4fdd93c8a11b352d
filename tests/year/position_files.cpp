// The checksum is worked out bit by bit, and not by zlib.
#include "position_files.h"

#include <cstdint>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <string_view>

#include "machine.h"

namespace lensd::year {
namespace {

std::uint32_t Crc32(std::string_view text) {
  std::uint32_t crc = ~std::uint32_t{0};
  for (const char c : text) {
    crc ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1U) != 0 ? (crc >> 1U) ^ 0xedb88320U : crc >> 1U;
  }
  return ~crc;
}

}  // namespace

std::optional<varlink::Json> ReadPositionFile(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return std::nullopt;
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  const varlink::Json json = varlink::Json::parse(text, nullptr, false);
  if (!json.is_object() || !json.contains("crc32") || !json.contains("axes")) {
    machine::Found(path + " is not whole: \"" + text + "\"");
  }
  const std::string sum = json["crc32"];
  const std::string begin = "{\"crc32\":\"" + sum + "\",";
  char right[9];
  std::snprintf(right, sizeof right, "%08x", Crc32("{" + text.substr(begin.size())));
  if (!text.starts_with(begin) || sum != right) machine::Found(path + " is not as it was written: \"" + text + "\"");
  return json["axes"];
}

}  // namespace lensd::year
