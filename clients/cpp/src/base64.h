// Base64, for pixels inside JSON.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace lensd {
inline namespace v1 {

std::string Base64(const std::uint8_t* bytes, std::size_t size);
/// Appends what `text` stands for; false where it is no base64.
bool AppendBase64(std::string_view text, std::vector<std::uint8_t>& bytes);

}  // namespace v1
}  // namespace lensd
