// What of the machine itself keeps lenses from working: for `lensctl doctor`.
#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "varlink/json.h"

namespace lensd::cli {

/// What was found, for people and programs.
class Findings {
 public:
  void Ok(std::string check, std::string message) { Add(std::move(check), "ok", std::move(message), ""); }
  void Warn(std::string check, std::string message, std::string remedy) {
    Add(std::move(check), "warning", std::move(message), std::move(remedy));
  }
  void Problem(std::string check, std::string message, std::string remedy) {
    ++problems_;
    Add(std::move(check), "problem", std::move(message), std::move(remedy));
  }
  int problems() const { return problems_; }
  const varlink::Json& json() const { return json_; }

 private:
  void Add(std::string check, const char* status, std::string message, std::string remedy) {
    json_.push_back({{"check", std::move(check)},
                     {"status", status},
                     {"message", std::move(message)},
                     {"remedy", remedy.empty() ? varlink::Json(nullptr) : varlink::Json(std::move(remedy))}});
  }

  varlink::Json json_ = varlink::Json::array();
  int problems_ = 0;
};

/// Kernel modules, network and clock as far as these drivers need them, and other programs that hold one of the nodes.
/// `root` is where /sys and /proc are.
void CheckMachine(const std::set<std::string>& drivers, const std::vector<std::string>& nodes,
                  const std::filesystem::path& root, Findings& findings);

}  // namespace lensd::cli
