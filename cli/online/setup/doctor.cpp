// doctor: everything that commonly keeps a lens from working, looked at one by one, each finding with what to do.
#include <grp.h>
#include <sys/stat.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>
#include <set>
#include <sstream>
#include <vector>

#include "base/missing_optics.h"
#include "cli/link/daemon_client.h"
#include "cli/link/daemon_program.h"
#include "cli/link/lens_info.h"
#include "cli/online/commands.h"
#include "cli/online/setup/doctor_machine.h"
#include "cli/text/texts.h"
#include "proto/interfaces.h"

namespace lensd::cli {
namespace {

using varlink::Json;

constexpr const char* kConfiguration = "/etc/lensd/lensd.toml";

std::string GroupName(gid_t group) {
  const struct group* found = getgrgid(group);
  return found != nullptr ? found->gr_name : std::to_string(group);
}

bool InGroup(gid_t wanted) {
  if (getegid() == wanted) return true;
  std::vector<gid_t> groups(static_cast<std::size_t>(std::max(getgroups(0, nullptr), 0)));
  const int count = getgroups(static_cast<int>(groups.size()), groups.data());
  groups.resize(static_cast<std::size_t>(std::max(count, 0)));
  return std::ranges::find(groups, wanted) != groups.end();
}

/// Whether the socket is there and this user may use it.
bool CheckSocket(const std::string& path, Findings& findings) {
  struct stat about{};
  if (stat(path.c_str(), &about) != 0) {
    if (errno == EACCES) {
      findings.Problem("socket", "you may not look at " + path, "ask for permission to enter its folder");
    } else {
      findings.Problem("socket", "there is no socket " + path,
                       "start the daemon (systemctl enable --now lensd.socket), or name its socket with --socket or "
                       "LENSD_SOCKET");
    }
    return false;
  }
  if (access(path.c_str(), R_OK | W_OK) != 0) {
    const std::string group = GroupName(about.st_gid);
    findings.Problem("socket", "you may not use " + path + ", which is for the group " + group,
                     InGroup(about.st_gid) ? "ask its owner for permission"
                                           : "sudo usermod -aG " + group + " $USER, then log in again");
    return false;
  }
  findings.Ok("socket", path + " is there" + (geteuid() == 0 ? "" : ", and you may use it"));
  return true;
}

std::optional<DaemonClient> CheckDaemon(Session& session, Findings& findings) {
  auto link = DaemonClient::Open(session);
  if (!link) {
    findings.Problem("daemon", link.error().message, "systemctl restart lensd; journalctl -u lensd shows why it ended");
    return std::nullopt;
  }
  auto info = link->Ask("org.varlink.service.GetInfo", Json::object());
  if (!info) {
    findings.Problem("daemon", info.error().message, "systemctl restart lensd");
    return std::nullopt;
  }
  const std::string version = info->value("version", "?");
  if (version == LENSD_VERSION) {
    findings.Ok("daemon", "lensd " + version + " answers");
  } else {
    findings.Warn("daemon", "lensd is version " + version + ", lensctl is " LENSD_VERSION,
                  "systemctl restart lensd, so that the installed version runs");
  }
  return *std::move(link);
}

/// What a running daemon has read. Opening the devices beside it would disturb them.
void CheckLensCount(std::size_t lenses, const std::expected<Json, Failure>& found, Findings& findings) {
  if (lenses > 0)
    return findings.Ok("configuration",
                       "lensd has read " + std::to_string(lenses) + (lenses == 1 ? " lens" : " lenses"));
  const bool some =
      found && std::ranges::any_of((*found)["devices"], [](const Json& device) { return device.value("lens", false); });
  findings.Warn("configuration", "no lens is configured",
                some ? "sudo lensctl add"
                     : "plug the lens in, then: sudo lensctl add; where no search finds it: sudo lensctl add --driver "
                       "NAME --set KEY=VALUE (docs/drivers)");
}

void CheckConfiguration(const std::string& file, Findings& findings) {
  if (access(file.c_str(), R_OK) != 0) {
    return findings.Warn("configuration", file + ": " + std::strerror(errno),
                         "name the daemon's file with --config, or run this as a user who may read it");
  }
  const auto [status, said] = RunDaemonProgram({"--check-config", "--config", file}, STDERR_FILENO);
  if (status == 0 && said.empty()) return findings.Ok("configuration", file + " is valid");
  if (status == 127) return findings.Warn("configuration", "lensd is not installed here", "install lensd");
  std::istringstream lines(said.empty() ? "lensd could not look at " + file : said);  // one a mistake
  for (std::string line; std::getline(lines, line);) {
    if (status == 0) {
      findings.Warn("configuration", line,
                    line.contains(" is left out: ") ? "the other parts of the lens work without it"
                                                    : "plug the lens in; lensd finds it then");
    } else {
      findings.Problem("configuration", line,
                       "correct it; `lensd --check-config --config " + file + "` checks it again");
    }
  }
}

void CheckRules(Findings& findings) {
  for (const char* folder : {"/etc/udev/rules.d", "/run/udev/rules.d", "/usr/local/lib/udev/rules.d",
                             "/usr/lib/udev/rules.d", "/lib/udev/rules.d"}) {
    const std::string path = std::string(folder) + "/60-lensd.rules";
    if (access(path.c_str(), F_OK) == 0) return findings.Ok("udev", path + " is installed");
  }
  findings.Warn(
      "udev", "60-lensd.rules is not installed: USB lenses are for root only",
      "copy systemd/udev/60-lensd.rules to /etc/udev/rules.d, run udevadm control --reload, plug the lens in again");
}

/// The nodes of what is plugged in.
std::vector<std::string> CheckDevices(const std::expected<Json, Failure>& found, Findings& findings) {
  if (!found) {
    findings.Problem("devices", found.error().message, "restart lensd");
    return {};
  }
  std::vector<std::string> nodes;
  for (const Json& failed : (*found)["failed"]) {
    findings.Warn("devices",
                  "driver " + failed.value("driver", "") + " could not search: " + failed.value("message", ""),
                  "journalctl -u lensd may show more");
  }
  std::size_t fine = 0;
  for (const Json& device : (*found)["devices"]) {
    nodes.push_back(TextOf(device, "node"));
    const bool used = device["usedBy"].is_string();
    if (used || device["problem"].is_null()) {
      ++fine;
      continue;
    }
    findings.Problem("devices", TextOf(device, "driver") + " " + TextOf(device, "model") + ": lensd cannot open it",
                     TextOf(device, "problem"));
  }
  findings.Ok("devices",
              std::to_string(fine) + (fine == 1 ? " device is" : " devices are") + " plugged in that lensd may open");
  return nodes;
}

/// The lenses that are configured, as LensInfo.
Json InfosOf(DaemonClient& link) {
  const auto reply = link.Ask(MethodOfLens("List"), Json::object());
  return reply ? reply->value("lenses", Json::array()) : Json::array();
}

/// Of these lenses and of their cameras.
std::set<std::string> DriversOf(const Json& infos) {
  std::set<std::string> drivers;
  for (const Json& lens : infos) {
    drivers.insert(TextOf(lens, "driver"));
    if (lens["camera"].is_object()) drivers.insert(TextOf(lens["camera"], "driver"));
  }
  return drivers;
}

/// Every device answers wrongly or loses a frame now and then: that is no warning, only told.
bool CheckCounters(const Json& lens, Findings& findings) {
  constexpr std::int64_t kMany = 10;
  const auto counters = lens.find("counters");
  if (counters == lens.end() || !counters->is_object()) return true;
  const auto count = [&](const char* key) { return counters->value(key, std::int64_t{0}); };
  const std::string check = "lens " + lens.value("name", "");
  const std::int64_t frames = count("framesLost") + count("framesLate");
  if (frames >= kMany) {
    findings.Warn(
        check,
        std::to_string(count("framesLost")) + " frames lost, " + std::to_string(count("framesDamaged")) +
            " of them damaged, " + std::to_string(count("framesLate")) + " late, " +
            std::to_string(count("packetsLost")) + " packets lost",
        "give the camera a port of its own; on a network larger packets (packet_size and the interface's MTU) "
        "or packet_delay_us, on USB a lower frame_rate_hz");
  }
  if (count("busErrors") >= kMany) {
    findings.Warn(check, std::to_string(count("busErrors")) + " questions to its devices were not answered properly",
                  "look at cable, plug, termination and power; on a serial line at baud and parity");
  }
  return frames < kMany && count("busErrors") < kMany;
}

/// What is wrong with the files that lensd keeps of it.
bool CheckFiles(const Json& lens, Findings& findings) {
  const std::string name = lens.value("name", "");
  const auto list = [&](const char* key) {
    const auto found = lens.find(key);
    return found != lens.end() && found->is_array() ? *found : Json::array();
  };
  for (const Json& warning : list("warnings")) {
    findings.Warn("lens " + name, warning.get<std::string>(),
                  "correct what it names, then: lensctl reload; or let lensd write it again (lensctl home, calibrate)");
  }
  for (const Json& file : list("unwritten")) {
    findings.Problem("lens " + name, "its " + TextOf(file, "file") + " cannot be written: " + TextOf(file, "reason"),
                     "make room on this disk, or repair it; lensd keeps trying by itself");
  }
  return list("warnings").empty() && list("unwritten").empty();
}

/// What its devices have and lensd goes without.
bool CheckParts(const Json& lens, Findings& findings) {
  const std::string name = lens.value("name", "");
  const Json parts = lens.value("leftOut", Json::array());
  for (const Json& one : parts) {
    findings.Warn("lens " + name, TextOf(one, "part") + " is left out: " + TextOf(one, "reason"),
                  "mend the device, or end what holds it, then: lensctl reload; its other parts work");
  }
  return parts.empty();
}

/// What most people miss first: without optics no distance, plan or f-number is possible, and without the direction of
/// focus no distance.
bool CheckOptics(const std::string& name, const Json& infos, Findings& findings) {
  const auto info = std::ranges::find_if(infos, [&](const Json& one) { return TextOf(one, "name") == name; });
  if (info == infos.end() || !info->contains("optics")) return true;
  const auto remarks = RemarksOn(*info);
  for (const LensRemark& remark : remarks) findings.Warn("lens " + name, remark.what, remark.remedy);
  if (!(*info)["optics"].is_null()) return remarks.empty();
  const Json axes = info->value("axes", Json::array());
  if (std::ranges::none_of(axes, [](const Json& axis) { return axis["axis"] == "focus"; })) return true;
  findings.Warn("lens " + name, "its optics are not known: it moves in steps, without distances, plans and f-numbers",
                std::string(kConfigureOptics) + ", then: lensctl reload");
  return false;
}

void CheckLens(const Json& lens, const Json& infos, Findings& findings) {
  const std::string check = "lens " + lens.value("name", "");
  const bool optics_known = CheckOptics(lens.value("name", ""), infos, findings);
  if (!lens.value("connected", false)) {
    const bool says = lens.contains("error") && lens["error"].is_string();
    return findings.Problem(check, says ? lens["error"].get<std::string>() : "it does not answer",
                            "plug it in and power it; lensd finds it by itself. `lensctl devices` lists what is there");
  }
  const bool files_fine = CheckFiles(lens, findings);
  const bool parts_fine = CheckParts(lens, findings);
  bool fine = CheckCounters(lens, findings) && files_fine && parts_fine && optics_known;
  for (const Json& axis : lens["axes"]) {
    const std::string name = axis.value("axis", "");
    if (const std::string fault = TextOf(axis, "fault"); !fault.empty()) {
      findings.Problem(check, std::string(name).append(" says: ").append(fault),
                       "look what holds it, then: lensctl home " + lens.value("name", "") + " " + name);
      fine = false;
    } else if (!axis.value("homed", true)) {
      const bool counts = axis.contains("positionUnknown") && axis["positionUnknown"] == true;
      const std::string after = lens.value("name", "") + " " + name;
      findings.Warn(check, "where " + name + " is is not known",
                    counts ? "it has no reference: say at which position N it stands, lensctl here " + after + " @N"
                           : "lensctl home " + after);
      fine = false;
    }
  }
  if (const std::string fault = TextOf(lens, "temperatureFault"); !fault.empty()) {
    findings.Warn(
        check, "its thermometer is not believed: " + fault,
        "look at the sensor and its cable; what is possible is in range_c and max_c_per_min of [lens.temperature]");
    fine = false;
  }
  if (fine) findings.Ok(check, "it answers");
}

Json LensesOf(DaemonClient& link, Findings& findings) {
  auto reply = link.Ask(MethodOfLens("Status"), Json::object());
  if (reply) return (*reply)["lenses"];
  findings.Problem("lenses", reply.error().message, "restart lensd");
  return Json::array();
}

Outcome Doctor(Session& session, const std::string& file) {
  Findings findings;
  const std::string socket = session.globals().socket.value_or(std::string(proto::kDefaultSocket));
  std::optional<DaemonClient> link;
  if (CheckSocket(socket, findings)) link = CheckDaemon(session, findings);
  const Json lenses = link ? LensesOf(*link, findings) : Json::array();
  std::optional<std::expected<Json, Failure>> found;  // nothing: the daemon does not answer
  if (link) found = link->Ask(MethodOfLens("Devices"), Json::object(), kDeviceSearch);
  if (found) CheckLensCount(lenses.size(), *found, findings);
  if (!found) CheckConfiguration(file, findings);
  CheckRules(findings);
  const std::vector<std::string> nodes = found ? CheckDevices(*found, findings) : std::vector<std::string>();
  const Json infos = link ? InfosOf(*link) : Json::array();
  if (link) CheckMachine(DriversOf(infos), nodes, "/", findings);
  for (const Json& lens : lenses) CheckLens(lens, infos, findings);
  const Exit exit = findings.problems() == 0 ? Exit::Done : Exit::No;
  if (session.json()) {
    session.PrintJson(findings.json());
    return exit;
  }
  for (const Json& finding : findings.json()) {
    session.PrintText(finding["status"].get<std::string>() + ": " + finding["check"].get<std::string>() + ": " +
                      finding["message"].get<std::string>());
    if (finding["remedy"].is_string()) session.PrintText("    what to do: " + finding["remedy"].get<std::string>());
  }
  return exit;
}

}  // namespace

void AddDoctor(CLI::App& root, Run& run) {
  auto file = std::make_shared<std::string>(kConfiguration);
  auto* command = root.add_subcommand("doctor", "look for what keeps lenses from working, and say what to do");
  command->group(kOnline);
  command->add_option("--config", *file, "the daemon's configuration, read if the daemon does not answer")
      ->type_name("FILE")
      ->capture_default_str();
  command->callback([&run, file] { run = [file](Session& session) { return Doctor(session, *file); }; });
}

}  // namespace lensd::cli
