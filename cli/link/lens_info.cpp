// Finding the lens that a command means in what the daemon lists.
#include "cli/link/lens_info.h"

#include <memory>
#include <utility>

#include "base/missing_optics.h"

namespace lensd::cli {

using varlink::Json;

std::expected<Json, Failure> FindInfo(DaemonClient& link, const std::string& lens) {
  auto reply = link.Ask(MethodOfLens("List"), Json::object());
  if (!reply) return PassOn(reply);
  const Json& lenses = (*reply)["lenses"];
  for (const Json& info : lenses) {
    if (lens.empty() ? lenses.size() == 1 : info.value("name", "") == lens) return info;
  }
  if (!lens.empty()) {
    Failure unknown(Exit::NotFound, "there is no lens \"" + lens + "\"; see lensctl list");
    unknown.details = std::make_shared<Json>(Json{{"lens", lens}});
    return std::unexpected(std::move(unknown));
  }
  if (lenses.empty())
    return Refuse(Exit::NotFound,
                  "no lens is configured; for a plan without one give "
                  "--focal-length");
  return Refuse(Exit::Usage, "say which lens; see lensctl list");
}

bool IsLens(const Session& session, const std::string& name) {
  auto link = DaemonClient::Open(session);
  return !name.empty() && link && FindInfo(*link, name);
}

std::optional<Failure> NothingToPlan(const Json& info) {
  const auto optics = info.find("optics");
  if (optics != info.end() && optics->is_object()) return std::nullopt;
  return Failure(Exit::Unsupported,
                 OpticsMissing("nothing can be planned: the optics of \"" + info.value("name", "") + "\" are"));
}

}  // namespace lensd::cli
