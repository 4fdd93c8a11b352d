#include "cli/plan/stack_answer.h"

#include <vector>

#include "cli/text.h"

namespace lensd::cli {

proto::Json StackJson(const optics::StackAnswer& answer) {
  if (!answer.feasible) return {{"feasible", false}, {"shots", proto::Json::array()}, {"reason", answer.reason}};
  proto::Json shots = proto::Json::array();
  for (const optics::StackShot& shot : answer.shots) {
    shots.push_back({{"fNumber", shot.f_number.value},
                     {"extensionMm", shot.extension.value * 1e3},
                     {"nearD", shot.near.value},
                     {"farD", shot.far.value},
                     {"magnification", shot.magnification}});
  }
  return {{"feasible", true}, {"shots", std::move(shots)}};
}

std::string StackText(const optics::StackAnswer& answer) {
  if (!answer.feasible) return "No stack keeps every sharp limit: " + answer.reason + "\n";
  std::vector<std::vector<std::string>> rows{
      {"shot", "f-number", "extension [mm]", "sharp from", "to", "magnification"}};
  for (const optics::StackShot& shot : answer.shots) {
    rows.push_back({std::to_string(rows.size()), Short(shot.f_number.value), Short(shot.extension.value * 1e3, 6),
                    DepthText(shot.near), DepthText(shot.far), Short(shot.magnification)});
  }
  return TableText(rows);
}

}  // namespace lensd::cli
