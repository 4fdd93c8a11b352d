#include "cli/online/plan.h"

#include <utility>

#include "cli/online/arguments.h"
#include "cli/online/link.h"

namespace lensd::cli {

using proto::Json;

std::expected<Json, Failure> PlanOnline(Session& session, const std::string& lens, Json request, bool apply) {
  auto link = Link::Open(session);
  if (!link) return std::unexpected(link.error());
  Json parameters{{"lens", LensOf(lens)}, {"request", std::move(request)}, {"apply", apply}};
  if (!apply) return link->Ask(MethodOfLens("Plan"), std::move(parameters));
  return link->Follow(
      MethodOfLens("Plan"), std::move(parameters), [](const Json&) { return true; },
      [&] { StopNow(session, LensOf(lens), nullptr); });
}

std::expected<Json, Failure> LensInfoOnline(Session& session, const std::string& lens) {
  auto link = Link::Open(session);
  if (!link) return std::unexpected(link.error());
  auto reply = link->Ask(MethodOfLens("List"), Json::object());
  if (!reply) return std::unexpected(reply.error());
  const Json& lenses = (*reply)["lenses"];
  for (const Json& info : lenses) {
    if (lens.empty() ? lenses.size() == 1 : info.value("name", "") == lens) return info;
  }
  if (!lens.empty()) return Refuse(Exit::Unavailable, "there is no lens \"" + lens + "\"");
  if (lenses.empty()) return Refuse(Exit::Unavailable, "no lens is configured");
  return Refuse(Exit::Usage, "say which lens: several are configured");
}

}  // namespace lensd::cli
