// A stand whose device is simulated within its driver's process, and plugged in while a file is there.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "drivers/process/process.h"
#include "stand.h"

namespace lensd::contract {

class ModelInProcess : public RealStand {
 public:
  /// `program` of the folder tests/ of the build.
  ModelInProcess(std::string program, std::string driver) : program_(std::move(program)), driver_(std::move(driver)) {
    std::string name = (std::filesystem::temp_directory_path() / "lensd-model-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) ADD_FAILURE() << "no temporary folder";
    folder_ = name;
    Plug();
  }
  ~ModelInProcess() override { std::filesystem::remove_all(folder_); }

  Result<drivers::Device> Open() override {
    const Settings file(folder_ + "/plugged", {"bench.toml", 1});
    const Settings settings(Settings::Table{{"plugged", file}}, {"bench.toml", 1});
    return drivers::process::OpenInProcess({.command = {LENSD_BINARY_DIR "/tests/" + program_}, .driver = driver_},
                                           settings, clock());
  }
  bool Unplug() override { return std::filesystem::remove(folder_ + "/plugged"); }
  void Plug() override { std::ofstream(folder_ + "/plugged") << "yes\n"; }

 private:
  const std::string program_, driver_;
  std::string folder_;
};

}  // namespace lensd::contract
