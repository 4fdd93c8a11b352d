// The clients' own interface is used, so that what works here works for them.
#include "cli/online/setup/add_proof.h"

#include <numeric>
#include <vector>

#include "cli/link/lens_info.h"
#include "cli/text/texts.h"
#include "varlink/base64.h"

namespace lensd::cli {
namespace {

using varlink::Json;

/// Once it is known whether its device is there.
std::expected<void, Failure> Opened(DaemonClient& link, const std::string& lens) {
  const auto status = StatusOnceOpened(link, lens, std::chrono::seconds(30));
  if (!status) return PassOn(status);
  if ((*status)["connection"] == "connected") return {};
  const std::string why = TextOf(*status, "error");
  return Refuse(Exit::Unavailable, why.empty() ? "lensd could not open it within 30 s" : why);
}

/// Mean of 0 to 255 and sharpness of one frame.
std::expected<Json, Failure> PictureNumbers(const Session& session, const std::string& lens) {
  Globals globals = session.globals();
  if (!globals.timeout) globals.timeout = std::chrono::seconds(15);
  auto link = DaemonClient::Open(Session(globals));
  if (!link) return PassOn(link);
  Json picture;
  std::optional<Error> wrong;
  std::vector<std::uint8_t> bytes;
  const auto take = [&](const Json& piece) {
    if (piece.contains("picture") && piece["picture"].is_object()) picture = piece["picture"];
    auto part = varlink::DecodeBase64(piece.value("data", ""));
    if (!part) wrong = part.error();
    if (part) bytes.insert(bytes.end(), part->begin(), part->end());
    return part && bytes.size() < piece.value("size", std::size_t{0});
  };
  Json view{{"lens", lens}, {"encoding", "gray8"}, {"scaleTo", {{"widthPx", 64}, {"heightPx", 64}}}};
  auto ended = link->Follow(MethodOfLens("View"), std::move(view), take);
  if (!ended) return PassOn(ended);
  if (wrong) return std::unexpected(Failure(*wrong));
  if (bytes.empty() || !picture.is_object()) return Refuse(Exit::Protocol, "lensd sent no picture");
  const double mean = std::accumulate(bytes.begin(), bytes.end(), 0.0) / static_cast<double>(bytes.size());
  return Json{{"mean", mean}, {"sharpness", picture.value("sharpness", Json())}};
}

}  // namespace

std::expected<void, Failure> StartAdded(DaemonClient& link, const Session& session, LensFile& file,
                                        const std::string& lens) {
  if (auto placed = file.Place(); !placed) return PassOn(placed);
  const auto reloaded = link.Ask(MethodOfLens("Reload"), Json::object(), std::chrono::seconds(30));
  const auto opened =
      reloaded ? Opened(link, lens)
               : std::expected<void, Failure>(Refuse(reloaded.error().status, RefusedReload(reloaded.error())));
  if (opened) return {};
  file.TakeAway();
  std::string message = "nothing was added: " + opened.error().message;
  // A call that was broken off may have been obeyed.
  const Exit status = opened.error().status;
  const bool read = reloaded || status == Exit::Interrupted || status == Exit::Timeout;
  if (!read) return Refuse(status, message);
  auto again = DaemonClient::Open(session);
  const auto removed = again ? again->Ask(MethodOfLens("Reload"), Json::object(), std::chrono::seconds(30))
                             : std::expected<Json, Failure>(PassOn(again));
  if (!removed) message += "; lensd has still read the file that is gone: lensctl reload";
  return Refuse(status, message);
}

Outcome ReportAdded(Session& session, const LensFile& file, const std::string& lens, DaemonClient& link) {
  auto info = FindInfo(link, lens);
  if (!info) return PassOn(info);
  const bool camera = info->contains("camera") && (*info)["camera"].is_object();
  auto numbers =
      camera ? PictureNumbers(session, lens) : std::expected<Json, Failure>(Refuse(Exit::Done, "it has no camera"));
  const bool optics = info->contains("optics") && (*info)["optics"].is_object();
  if (session.json()) {
    session.PrintJson({{"name", lens},
                       {"file", file.path()},
                       {"optics", optics},
                       {"picture", numbers ? *numbers : Json()},
                       {"reason", numbers ? Json() : Json(numbers.error().message)}});
    for (const LensRemark& remark : RemarksOn(*info)) session.Remark(remark.what + ": " + remark.remedy);
  } else {
    session.PrintText("added " + lens + ": " + file.path());
    session.PrintText(InfoText(*info));
    if (!optics) {
      session.PrintText(
          "its optics are not known: it moves in steps only; add [lens.optics] to this file "
          "(docs/lenses.md), then: lensctl reload");
    }
    for (const LensRemark& remark : RemarksOn(*info)) session.PrintText(remark.what + ": " + remark.remedy);
    if (camera && !(*info)["camera"]["pixelUm"].is_number()) {
      session.PrintText(
          "the size of its pixels is not known: limits in pixels are refused; say it as pixel_um of its camera in this "
          "file, then: lensctl reload");
    }
    session.PrintText(numbers ? "picture: mean " + NumberText(*numbers, "mean", 3, " of 255, sharpness ") +
                                    NumberText(*numbers, "sharpness", 3, "")
                              : "no picture: " + numbers.error().message);
  }
  return numbers || !camera ? Exit::Done : Exit::No;
}

}  // namespace lensd::cli
