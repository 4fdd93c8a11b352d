// The answer to `plan --stack`, as JSON and as lines for people.
#include "cli/plan/stack_answer.h"

#include <vector>

#include "cli/text/text.h"

namespace lensd::cli {

varlink::Json StackJson(const optics::StackAnswer& answer) {
  if (!answer.feasible) {
    return {{"feasible", false},
            {"shots", varlink::Json::array()},
            {"cause", optics::StackCauseName(answer.cause)},
            {"reason", answer.reason}};
  }
  varlink::Json shots = varlink::Json::array();
  for (const optics::StackShot& shot : answer.shots) {
    shots.push_back({{"fNumber", shot.f_number.value},
                     {"extensionMm", shot.extension.value * 1e3},
                     {"nearD", shot.near.value},
                     {"farD", shot.far.value},
                     {"magnification", shot.magnification}});
  }
  return {{"feasible", true}, {"shots", std::move(shots)}};
}

std::string StackText(const varlink::Json& stack) {
  if (!stack.value("feasible", false)) {
    return "No stack keeps every sharp limit: " + stack.value("reason", "") + "\n";
  }
  std::vector<std::vector<std::string>> rows{
      {"shot", "f-number", "extension [mm]", "sharp from", "to", "magnification"}};
  for (const varlink::Json& shot : stack["shots"]) {
    const auto number = [&](const char* key) { return shot[key].get<double>(); };
    rows.push_back({std::to_string(rows.size()), Short(number("fNumber")), Short(number("extensionMm"), 6),
                    DepthText(Dioptres{number("nearD")}), DepthText(Dioptres{number("farD")}),
                    Short(number("magnification"))});
  }
  return TableText(rows);
}

}  // namespace lensd::cli
