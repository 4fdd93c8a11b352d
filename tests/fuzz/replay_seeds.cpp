// Runs a fuzzer's entry point on its seeds, and without --whole on every beginning of them, where there is no
// libFuzzer: builds without clang then compile every fuzzer too, and what once crashed a parser stays mended.
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string_view>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

int main(int count, char** arguments) {
  constexpr std::size_t kBeginnings = 512;
  const bool whole = count > 1 && std::string_view(arguments[1]) == "--whole";
  std::size_t seeds = 0;
  for (int i = whole ? 2 : 1; i < count; ++i) {
    for (const auto& entry : std::filesystem::directory_iterator(arguments[i])) {
      std::ifstream file(entry.path(), std::ios::binary);
      const std::vector<char> read((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
      const std::vector<std::uint8_t> bytes(read.begin(), read.end());
      const std::size_t step = bytes.size() / kBeginnings + 1;
      for (std::size_t size = 0; !whole && size < bytes.size(); size += step) {
        const std::vector<std::uint8_t> beginning(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
        LLVMFuzzerTestOneInput(beginning.data(), beginning.size());
      }
      LLVMFuzzerTestOneInput(bytes.data(), bytes.size());
      ++seeds;
    }
  }
  std::printf("%zu seeds\n", seeds);
  return seeds == 0 ? 1 : 0;
}
