// The promises of docs/interface.md and docs/moves.md, held against the truth of the simulated lenses.
#include "judge.h"

#include <array>
#include <cmath>
#include <filesystem>
#include <sstream>
#include <utility>

#include "position_files.h"

namespace lensd::year {
namespace {

using machine::Found;
using machine::kSecond;

constexpr std::int64_t kMs = 1'000'000;
/// A stop that its worker does not carry out in 3 s is answered Timeout, four times a second.
constexpr std::int64_t kStopAtMost = 4 * kSecond;
constexpr std::int64_t kOthersAtMost = 300 * kSecond;
/// A motor comes to rest in this time.
constexpr std::int64_t kRestAfter = 600 * kMs;
constexpr double kRounding = 1e-6;

template <class... Parts>
[[noreturn]] void FoundThat(const Parts&... parts) {
  std::ostringstream text;
  (text << ... << parts);
  Found(text.str());
}

const std::set<std::string>& Driving() {
  static const std::set<std::string> methods = {"Move", "Home", "PresetRecall", "Autofocus", "Undo", "MeasureBacklash"};
  return methods;
}

/// Methods that another client's lease stands against.
bool NeedsLease(const std::string& method) {
  static const std::set<std::string> kMore = {"PresetSave", "PresetRemove", "SetExposure", "ResetFaults", "Calibrate"};
  return Driving().contains(method) || kMore.contains(method);
}

bool IsError(const Json& reply, std::string_view name) {
  return reply.contains("error") && reply["error"] == "io.lensd.Lens." + std::string(name);
}

bool OfPresets(const Call& call) {
  return call.method == "PresetSave" || call.method == "PresetRemove";
}
bool OfLeases(const Call& call) {
  return call.method == "TakeLease" || call.method == "DropLease";
}

std::string Told(const Call& call) {
  return call.method + " " + call.parameters.dump();
}

}  // namespace

bool Judge::Drives(const Call& call) const {
  return Driving().contains(call.method);
}

void Judge::Asked(const Client& client, Call& call) {
  call.at = machine::Now();
  call.behind = !client.waiting().empty();
  ++looked_.calls;
  if (call.lens().empty()) return;
  Known& known = known_[call.lens()];
  call.lease_settled = known.lease.under_way == 0 && known.lease.state != Lease::State::Unknown;
  if (Drives(call)) ++known.drives, ++known.driving;
  if (Drives(call)) known.stopped.reset();
  if (call.method == "Home") homed_since_.insert(call.lens());
  if (OfLeases(call)) ++known.lease.under_way;
  if (OfPresets(call)) known.presets[call.parameters["label"]] = Saved::Unknown;
  call.drives = known.drives;
  call.alone = known.driving == 1;
}

void Judge::Answered(const Client& client, const Call& call, const Json& reply, bool last) {
  const bool failed = reply.contains("error");
  if (failed) ++looked_.errors;
  if (IsError(reply, "Internal")) Found(Told(call) + " ends with Internal: " + reply.dump());
  if (!last) return;
  const std::int64_t took = machine::Now() - call.at;
  if (call.method == "Stop") OfStop(call, reply);
  if (call.method == "Stop" && !call.behind) {
    looked_.longest_stop = std::max(looked_.longest_stop, took);
    if (took > kStopAtMost) Found("a stop took " + std::to_string(took / kMs) + " ms");
  }
  if (call.lens().empty()) return;
  if (Drives(call)) --known_[call.lens()].driving;
  if (Drives(call) && !failed) Moves(call, reply["parameters"]);
  if (OfPresets(call)) OfPreset(call, failed);
  OfLease(client, call, reply);
}

void Judge::Lost(const Client&, const Call& call) {
  ++looked_.lost;
  if (call.lens().empty()) return;
  Known& known = known_[call.lens()];
  if (Drives(call)) --known.driving;
  if (!OfLeases(call)) return;
  --known.lease.under_way;
  known.lease.state = Lease::State::Unknown;
}

void Judge::Gone(const Client& client) {
  for (auto& [name, known] : known_) {
    Lease& lease = known.lease;
    if (lease.state != Lease::State::Held || lease.connection != client.connection()) continue;
    lease.connection = 0;
    lease.changed = machine::Now();
    if (lease.ends_by == 0) lease.state = Lease::State::None;
  }
}

void Judge::LookForLate(const Client& client) const {
  if (client.waiting().empty()) return;
  const Call& first = client.waiting().front();
  if (first.more && (first.method == "Monitor" || first.method == "Status")) return;
  const std::int64_t waits = machine::Now() - first.at;
  if (waits > kOthersAtMost) Found(Told(first) + " has had no answer for " + std::to_string(waits / kSecond) + " s");
}

// ---- moves ---------------------------------------------------------------------------------------------------------

/// Every MoveResult within it.
void Judge::Moves(const Call& call, const Json& value) {
  if (value.is_object() && value.contains("reached") && value.contains("settled") && value.contains("axis")) {
    return Move(call, value);
  }
  if (!value.is_structured()) return;
  for (const Json& part : value) Moves(call, part);
}

void Judge::Move(const Call& call, const Json& move) {
  ++looked_.moves;
  const std::string axis_name = move["axis"];
  const auto axis = *drivers::AxisFromName(axis_name);
  TrueLens& lens = lenses_[call.lens()];
  const bool kept = move.contains("kept") && move["kept"] == true;
  if (kept) {
    known_[call.lens()].kept[axis_name] = {move["position"], known_[call.lens()].drives, machine::Now()};
    ++looked_.kept;
  }
  if (move["reached"] != true || move["settled"] != true || !move.contains("positionBound") ||
      move["positionBound"].is_null()) {
    return;
  }
  ++looked_.reached;
  const bool verified = move["verified"] == true;
  if (verified) ++looked_.verified;
  // Of several moves of a call we do not know when each ended: another caller's may have followed.
  if (call.method != "Move" && (!call.alone || known_[call.lens()].drives != call.drives)) return;
  // The next command may have begun between its end and our reading of it.
  static constexpr std::array<std::int64_t, 6> kAgo = {0, 1, 2, 5, 10, 20};
  const double bound = move["positionBound"], position = move["position"];
  std::string places;
  for (const std::int64_t ago : kAgo) {
    const auto place = lens.PlaceAt(axis, machine::Now() - ago * kMs);
    if (!place || std::abs(*place - position) <= bound + kRounding) return;
    places += " " + std::to_string(*place);
  }
  // Known, and not mended: docs/testing.md, "A year in a night".
  if (call.method == "Home" && lens.frozen_until[axis] > call.at) {
    ++looked_.frozen;
    return;
  }
  if (!verified && lens.doubtful_until[axis] > machine::Now()) {
    ++looked_.doubtful;
    return;
  }
  Found("false arrival: " + move.dump() + " and truly at" + places);
}

void Judge::OfStop(const Call& call, const Json& reply) {
  ++looked_.stops;
  if (reply.contains("error") || call.parameters.contains("axis")) return;
  for (auto& [name, known] : known_) {
    const bool meant = call.lens().empty() || call.lens() == name;
    if (!meant || known.driving > 0 || (!call.lens().empty() && known.drives != call.drives)) continue;
    if (lenses_[name].troubled_until + kSecond > machine::Now()) continue;
    known.stopped = Stopped{machine::Now(), known.drives};
  }
}

void Judge::LookAtRest() {
  for (auto& [name, known] : known_) {
    if (!known.stopped || machine::Now() < known.stopped->at + kRestAfter) continue;
    const Stopped stopped = *std::exchange(known.stopped, std::nullopt);
    if (stopped.drives != known.drives || lenses_[name].troubled_until > stopped.at) continue;
    ++looked_.rests;
    for (const auto axis : drivers::kAxes) {
      if (lenses_[name].MovesNow(axis)) Found(name + " was stopped and moves on");
    }
  }
}

// ---- leases --------------------------------------------------------------------------------------------------------

void Judge::OfLease(const Client& client, const Call& call, const Json& reply) {
  Lease& lease = known_[call.lens()].lease;
  const bool failed = reply.contains("error");
  const bool held = lease.state == Lease::State::Held;
  const bool holds =
      held && (lease.connection == client.connection() || call.parameters.value("lease", "") == lease.key);
  const bool settled = call.lease_settled && (OfLeases(call) ? lease.under_way == 1 : lease.under_way == 0) &&
                       lease.state != Lease::State::Unknown && lease.changed < call.at;
  const bool timed = held && lease.ends_by != 0;
  const bool surely_on = held && (!timed || machine::Now() < lease.ends_from);
  const bool surely_over = !held || (timed && call.at > lease.ends_by + 5 * kMs);
  if (settled && IsError(reply, "Leased")) {
    ++looked_.leased;
    if (holds && surely_on) Found("the lease keeps its own holder out: " + Told(call) + " " + reply.dump());
    if (surely_over) Found("a lease holds that is over: " + Told(call) + " " + reply.dump());
  }
  if (settled && NeedsLease(call.method) && !failed && surely_on && !holds) {
    Found("another client's lease does not hold: " + Told(call) + " " + reply.dump());
  }
  if (!OfLeases(call)) return;
  --lease.under_way;
  if (failed) return;
  lease.changed = machine::Now();
  lease.state = call.method == "TakeLease" ? Lease::State::Held : Lease::State::None;
  if (call.method != "TakeLease") return;
  lease.connection = client.connected() ? client.connection() : 0;
  lease.key = reply["parameters"]["lease"];
  const auto ns = static_cast<std::int64_t>(1e6 * call.parameters.value("forMs", 0.0));
  lease.ends_from = ns == 0 ? 0 : call.at + ns;
  lease.ends_by = ns == 0 ? 0 : machine::Now() + ns;
}

// ---- what is kept --------------------------------------------------------------------------------------------------

void Judge::OfPreset(const Call& call, bool failed) {
  // What could not be written may yet be there, or not be there any more, after the next start.
  const Saved now = call.method == "PresetSave" ? Saved::Yes : Saved::No;
  known_[call.lens()].presets[call.parameters["label"]] = failed ? Saved::Unknown : now;
}

void Judge::Presets(const std::string& lens, const Json& presets) {
  std::set<std::string> there;
  for (const Json& preset : presets) there.insert(preset["label"].get<std::string>());
  for (const auto& [label, saved] : known_[lens].presets) {
    ++looked_.presets;
    const bool is_there = there.contains(label);
    if ((saved != Saved::Yes || is_there) && (saved != Saved::No || !is_there)) continue;
    FoundThat("preset ", label, " of ", lens, is_there ? " was removed and is there" : " was saved and is lost");
  }
}

void Judge::Left(const std::string& folder, Ended how) {
  homed_since_.clear();
  for (const auto& [name, lens] : lenses_.all()) {
    const auto axes = ReadPositionFile(std::filesystem::path(folder) / (name + ".position.json"));
    if (axes) File(name, *axes, how);
    if (how == Ended::Regularly) known_[name].kept.clear();  // it may be parked by now
    Known& known = known_[name];
    for (const auto axis : drivers::kAxes) {
      const std::string axis_name(drivers::AxisName(axis));
      const bool in_motion = axes && axes->contains(axis_name) && (*axes)[axis_name]["inMotion"] == true;
      if (!in_motion && lens->MovesNow(axis) && lens->troubled_until < machine::Now()) {
        FoundThat(name, " ", axis_name, " moves, and its file does not say so");
      }
    }
    known.killed = machine::Now();
  }
}

void Judge::File(const std::string& lens, const Json& axes, Ended how) {
  ++looked_.files;
  Known& known = known_[lens];
  known.at_start.clear();
  for (const auto& [name, axis] : axes.items()) {
    const bool in_motion = axis["inMotion"];
    if (in_motion) ++looked_.unknown;
    known.at_start[name] = axis["known"] == true && !in_motion;
    if (how == Ended::Regularly) continue;
    const auto kept = known.kept.find(name);
    if (kept == known.kept.end() || kept->second.drives != known.drives || known.driving > 0) continue;
    if (lenses_[lens].troubled_until > kept->second.at) continue;
    if (in_motion || axis["position"] != kept->second.position) {
      FoundThat(lens, " ", name, " was told to be kept at ", kept->second.position, ", and its file says ",
                axis.dump());
    }
  }
}

void Judge::Begun() {
  for (auto& [name, known] : known_) {
    const int under_way = known.lease.under_way;
    known.lease = {};
    known.lease.changed = machine::Now();
    known.lease.under_way = under_way;
    known.stopped.reset();
  }
}

// ---- what is told --------------------------------------------------------------------------------------------------

void Judge::Status(const Json& lenses) {
  for (const Json& lens : lenses) {
    const std::string name = lens["name"];
    if (lens["connected"] != true) continue;
    AtStart(known_[name], lens);
    for (const Json& axis : lens["axes"]) Axis(name, axis, lens["readAtNs"]);
  }
}

/// The first time that a new lensd tells of a lens: a position is known exactly if its file said so.
void Judge::AtStart(Known& known, const Json& lens) {
  const auto said = std::exchange(known.at_start, {});
  const std::string name = lens["name"];
  if (homed_since_.contains(name) || lenses_[name].troubled_until > known.killed) return;
  for (const Json& axis : lens["axes"]) {
    const auto file = said.find(axis["axis"].get<std::string>());
    if (file == said.end()) continue;
    const bool restored = axis["homed"] == true;
    // restore = "conditional" takes the device's own word where the motion may have swept it.
    const bool conditional = name == "l05" || name == "l13";
    if (restored && !file->second && !conditional)
      Found(name + ": its position was not known, and is now: " + axis.dump());
    // A file that could not be read is told of.
    const bool said_why = lens.contains("warnings") && !lens["warnings"].empty();
    if (!restored && file->second && !said_why && lenses_[name].troubled_until == 0) {
      Found(name + ": its position was known, and is not now: " + axis.dump());
    }
  }
}

void Judge::Axis(const std::string& lens, const Json& axis, std::int64_t read_at) {
  const bool stands = axis["homed"] == true && axis["moving"] == false && axis.value("lastKnown", false) == false;
  if (!stands || !axis.contains("positionBound") || axis["positionBound"].is_null()) return;
  const auto which = *drivers::AxisFromName(axis["axis"].get<std::string>());
  TrueLens& truth = lenses_[lens];
  // A fault that began after it was read, or is in force, may have changed what was true.
  if (truth.doubtful_until[which] > read_at || truth.troubled_until > read_at - kSecond) return;
  const auto place = truth.PlaceAt(which, read_at);
  if (!place) return;
  ++looked_.positions;
  const double position = axis["position"], bound = axis["positionBound"];
  if (std::abs(*place - position) <= bound + kRounding) return;
  Found(lens + " stands at " + std::to_string(*place) + " and tells " + axis.dump());
}

void Judge::Metrics(const Json& parameters) {
  // docs: daemon/lens/worker.h and daemon/threads/task_thread.h
  constexpr int kMostCommands = 128, kMostTasks = 64;
  const Json& own = parameters["daemon"];
  if (own["filesWaiting"] > kMostTasks || own["plansWaiting"] > kMostTasks) Found("a queue has no end: " + own.dump());
  for (const Json& lens : parameters["lenses"]) {
    if (lens["commandsWaiting"] > kMostCommands + 1) Found("a queue has no end: " + lens.dump());
  }
}

}  // namespace lensd::year
