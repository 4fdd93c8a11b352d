// Remembered positions: what is believed can be written and is then read the same, and nothing without its checksum is
// believed. An even first byte puts the right checksum on the rest.
#include <stdlib.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

#include "daemon/state/position_store.h"
#include "io/checked_file.h"

namespace {

using namespace lensd;

/// A folder in memory, for as long as the fuzzer runs.
class Folder {
 public:
  Folder() { path_ = mkdtemp(name_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  ~Folder() { std::filesystem::remove_all(path_); }
  const std::string& path() const { return path_; }

 private:
  char name_[32] = "/dev/shm/lensd-fuzz-XXXXXX";
  std::string path_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Folder folder;
  if (size < 2) return 0;
  std::string text(reinterpret_cast<const char*>(data) + 1, size - 1);
  const bool as_written = data[0] % 2 == 0;
  if (as_written) text = io::SignedObject("{" + text);
  daemon::PositionStore store(folder.path(), "a", "", std::make_shared<daemon::StopSignal>());
  std::ofstream(store.path(), std::ios::binary | std::ios::trunc) << text;
  const auto loaded = store.Load();
  if (!loaded) {
    if (loaded.error().message.find(store.path()) == std::string::npos) __builtin_trap();
    return 0;
  }
  if (!as_written && io::IntegrityOfObject(text) != io::Integrity::Whole) __builtin_trap();
  if (!store.Save(*loaded)) __builtin_trap();
  const auto again = store.Load();
  if (!again) __builtin_trap();
  for (const drivers::Axis axis : drivers::kAxes) {
    const auto &before = (*loaded)[axis], &after = (*again)[axis];
    if (before.has_value() != after.has_value()) __builtin_trap();
    if (before && (before->position.value != after->position.value || before->in_motion != after->in_motion ||
                   before->known != after->known)) {
      __builtin_trap();
    }
  }
  return 0;
}
