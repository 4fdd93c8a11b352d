// Everything that happens in a year has its time, drawn from the seed; in between the clock stands at the next thing
// that anybody waits for. A kill leaves what a kill leaves: the disk, the lenses, and clients whose connection is gone.
#include "year.h"

#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <utility>

#include "disk.h"

namespace lensd::year {
namespace {

constexpr std::size_t kPeople = 8;
constexpr std::size_t kAuditor = kPeople, kWatcher = kPeople + 1;
/// Minutes between, on average, at pace 1.
constexpr double kVisit = 30.0, kFault = 20.0, kDisk = 120.0, kEnd = 360.0, kJump = 180.0, kAudit = 10.0,
                 kWatch = 120.0;
/// Seconds to think between two calls.
constexpr double kThink = 4.0;

std::int64_t Nanoseconds(double seconds) {
  return static_cast<std::int64_t>(seconds * 1e9);
}

}  // namespace

Year::Year(const Wish& wish)
    : wish_(wish),
      lenses_(clock_, wish.planted),
      judge_(lenses_),
      chance_{Chance(wish.seed * 3), Chance(wish.seed * 3 + 1), Chance(wish.seed * 3 + 2)},
      state_("state.0") {
  static constexpr std::array<Role, kPeople + 2> kRoles = {
      Role::Mover,         Role::Mover,         Role::Mover,    Role::Mover,         Role::Mover,
      Role::Administrator, Role::Administrator, Role::Observer, Role::Administrator, Role::Observer};
  const auto answered = [this](Client& client, const Call& call, const Json& reply, bool last) {
    Hear(client, call, reply, last);
  };
  for (const Role role : kRoles) {
    auto client = std::make_unique<Client>(visitors_.size(), role, answered);
    visitors_.push_back({std::move(client), {}, 0});
  }
  std::filesystem::create_directory(state_);
  if (wish.planted.disk_lies) disk::Lie();
  Listen();
}

void Year::Listen() {
  sockets_.epoll = epoll_create1(EPOLL_CLOEXEC);
  sockets_.listening = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  sockets_.address = "lensd-year-" + std::to_string(getpid());
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  sockets_.address.copy(address.sun_path + 1, sizeof address.sun_path - 1);
  const bool bound = bind(sockets_.listening, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  if (!bound || listen(sockets_.listening, 64) != 0) machine::Found("no socket");
}

Figures Year::figures() const {
  const Looked& looked = judge_.looked();
  const disk::Counts& disk = disk::counts();
  return {{"visits", happened_.visits},
          {"calls", looked.calls},
          {"errors", looked.errors},
          {"calls cut off", looked.lost},
          {"moves ended", looked.moves},
          {"reached", looked.reached},
          {"verified", looked.verified},
          {"reached beside the truth after a knock that no readback shows", looked.doubtful},
          {"homings believed of a readback that is frozen (known)", looked.frozen},
          {"stops", looked.stops},
          {"rests after a stop looked at", looked.rests},
          {"longest stop ms", static_cast<std::uint64_t>(looked.longest_stop / 1'000'000)},
          {"refused by a lease", looked.leased},
          {"kept positions told", looked.kept},
          {"positions looked at", looked.positions},
          {"presets looked for", looked.presets},
          {"files read after an end", looked.files},
          {"of axes in motion", looked.unknown},
          {"faults of lenses", happened_.faults},
          {"times of a bad disk", happened_.disks},
          {"calls to the disk", disk.calls},
          {"of them failed", disk.failed},
          {"kills", happened_.kills},
          {"power cuts", happened_.power_cuts},
          {"regular ends", happened_.ends},
          {"jumps of the time of day", happened_.jumps},
          {"steps", machine::Steps()}};
}

// ---- time ----------------------------------------------------------------------------------------------------------

void Year::At(double seconds, std::function<void()> what) {
  due_.emplace(machine::Now() + Nanoseconds(seconds), std::move(what));
}

void Year::Often(double minutes, Chance& chance, std::function<void()> what) {
  At(chance.Pause(60.0 * minutes / wish_.pace), [this, minutes, &chance, what = std::move(what)] {
    what();
    Often(minutes, chance, what);
  });
}

void Year::Run() {
  for (std::size_t i = 0; i < kPeople; ++i) {
    Often(kVisit, chance_.people, [this, i] { Visit(visitors_[i]); });
  }
  Often(kAudit, chance_.people, [this] { Audit(); });
  Often(kWatch, chance_.people, [this] { Leave(*visitors_[kWatcher].client); });
  Often(kFault, chance_.troubles, [this] { TroubleLens(); });
  Often(kDisk, chance_.troubles, [this] { TroubleDisk(); });
  Often(kEnd, chance_.troubles, [this] { EndLife(); });
  Often(kJump, chance_.walls, [this] { JumpClock(); });
  NextLife();
  const std::int64_t end = machine::Now() + Nanoseconds(3600.0 * wish_.hours);
  while (machine::Now() < end) {
    while (!due_.empty() && due_.begin()->first <= machine::Now()) {
      const auto what = std::move(due_.extract(due_.begin()).mapped());
      what();
    }
    Serve(std::min(end, due_.begin()->first));
  }
  disk::KillAtCall(0);
  disk::Set({});
  for (const Visitor& visitor : visitors_) Leave(*visitor.client);
  life_.reset();
}

void Year::Serve(std::int64_t until) {
  machine::WaitForSockets(sockets_.epoll, until);
  if (machine::KillRequested()) return Killed();
  ReadAll();
}

void Year::ReadAll() {
  std::array<epoll_event, 16> events;
  const int ready = epoll_wait(sockets_.epoll, events.data(), events.size(), 0);
  for (int i = 0; i < ready; ++i) {
    for (const Visitor& visitor : visitors_) {
      if (visitor.client->socket() == events[static_cast<std::size_t>(i)].data.fd && !visitor.client->Read()) {
        if (life_) machine::Found("lensd closed a connection");
        Leave(*visitor.client);
      }
    }
  }
}

// ---- people --------------------------------------------------------------------------------------------------------

void Year::Ask(Client& client, Call call) {
  judge_.Asked(client, call);
  if (wish_.planted.lease_late && call.parameters.contains("forMs")) {
    Json longer = call.parameters;
    longer["forMs"] = 1.02 * longer["forMs"].get<double>() + 2000.0;
    return client.Send(call, longer);
  }
  client.Send(call);
}

Year::Visitor* Year::VisitorOf(const Client& client) {
  return &visitors_[client.number()];
}

void Year::Hear(Client& client, const Call& call, const Json& reply, bool last) {
  judge_.Answered(client, call, reply, last);
  Mind& mind = VisitorOf(client)->mind;
  const bool failed = reply.contains("error");
  if (failed && reply["error"] == "io.lensd.Lens.NotHomed") mind.must_home = call.lens();
  if (failed && reply["error"] == "io.lensd.Lens.Cancelled" && call.method == "Move") mind.latched = call.lens();
  if (call.method == "Stop") At(0.65, [this] { judge_.LookAtRest(); });
  if (failed || !last) return;
  if (call.method == "TakeLease") {
    mind.lease = reply["parameters"]["lease"];
    const double ends = 1e-3 * call.parameters.value("forMs", 0.0);
    for (const double at : {ends - 0.02, ends + 0.02}) {
      if (ends > 0.0) At(at, [this, lens = call.lens(), holder = client.number()] { Contest(lens, holder); });
    }
  }
  if (client.number() != kAuditor) return;
  if (call.method == "Status") judge_.Status(reply["parameters"]["lenses"]);
  if (call.method == "Metrics") judge_.Metrics(reply["parameters"]);
  if (call.method == "PresetList") judge_.Presets(call.lens(), reply["parameters"]["presets"]);
}

void Year::Leave(Client& client) {
  if (!client.connected()) return;
  judge_.Gone(client);
  for (const Call& call : client.Close()) judge_.Lost(client, call);
}

void Year::Visit(Visitor& visitor) {
  if (!life_ || visitor.client->connected()) return;
  ++happened_.visits;
  visitor.client->Connect(sockets_.address, sockets_.epoll);
  visitor.calls_left = 2 + static_cast<int>(chance_.people.Below(12));
  GoOn(visitor);
}

void Year::GoOn(Visitor& visitor) {
  Client& client = *visitor.client;
  if (!client.connected()) return;
  const bool waits = !client.waiting().empty();
  // Whoever waits mostly goes on waiting; some lose patience.
  if (waits && !chance_.people.OneIn(4)) {
    judge_.LookForLate(client);
  } else if (visitor.calls_left-- <= 0 || (waits && chance_.people.OneIn(3))) {
    return Leave(client);
  } else {
    Ask(client, NextCall(chance_.people, client.role(), visitor.mind));
  }
  const std::uint64_t connection = client.connection();
  At(chance_.people.Pause(kThink), [this, &visitor, connection] {
    if (visitor.client->connection() == connection) GoOn(visitor);
  });
}

/// Someone else tries a leased lens shortly before the lease is to end, and shortly after.
void Year::Contest(const std::string& lens, std::uint64_t holder) {
  for (std::size_t i = 0; i + 1 < kPeople; ++i) {
    Client& client = *visitors_[i].client;
    if (!client.connected() || client.number() == holder || !client.waiting().empty()) continue;
    return Ask(client,
               {.method = "Move", .parameters = {{"lens", lens}, {"axis", "focus"}, {"target", {{"relative", 5.0}}}}});
  }
}

void Year::Audit() {
  if (!life_) return;
  for (const Visitor& visitor : visitors_) judge_.LookForLate(*visitor.client);
  Client& watcher = *visitors_[kWatcher].client;
  if (!watcher.connected()) {
    watcher.Connect(sockets_.address, sockets_.epoll);
    Ask(watcher, {.method = "Monitor", .parameters = {{"minIntervalMs", 500.0}}, .more = true});
  }
  Client& auditor = *visitors_[kAuditor].client;
  if (!auditor.connected()) auditor.Connect(sockets_.address, sockets_.epoll);
  Ask(auditor, {.method = "Status"});
  Ask(auditor, {.method = "Metrics"});
  Ask(auditor, {.method = "PresetList", .parameters = {{"lens", AnyLens(chance_.people)}}});
}

// ---- trouble -------------------------------------------------------------------------------------------------------

void Year::TroubleLens() {
  ++happened_.faults;
  machine::Trace(lenses_.Trouble(chance_.troubles));
}

void Year::TroubleDisk() {
  ++happened_.disks;
  Chance& chance = chance_.troubles;
  disk::Set({.fails = chance.OneIn(3)   ? 1.0
                      : chance.OneIn(2) ? 0.0
                                        : chance.Between(0.02, 0.5),
             .slow = chance.OneIn(2) ? Nanoseconds(chance.Pause(0.1)) : 0});
  At(chance.Pause(60.0), [] { disk::Set({}); });
}

void Year::JumpClock() {
  ++happened_.jumps;
  const double by = chance_.walls.Between(-50'000.0, 50'000.0);
  machine::JumpWallClock(wish_.wall_jumps ? Nanoseconds(by) : 0);
}

void Year::EndLife() {
  if (!life_) return;
  Chance& chance = chance_.troubles;
  power_fails_ = chance.OneIn(3);
  switch (chance.Below(4)) {
    case 0:  // as by SIGTERM
      ++happened_.ends;
      disk::KillAtCall(0);
      life_.reset();
      power_fails_ = false;
      ReadAll();
      return Killed();
    case 1:  // now
      return Killed();
    default:  // in the midst of writing
      return disk::KillAtCall(1 + chance.Below(12));
  }
}

/// lensd is there no more.
void Year::Killed() {
  const bool regular = life_ == nullptr;
  if (!regular) {
    ++happened_.kills;
    machine::Kill([this](int descriptor) {
      return descriptor == sockets_.epoll || descriptor == sockets_.listening ||
             std::ranges::any_of(visitors_,
                                 [&](const Visitor& visitor) { return visitor.client->socket() == descriptor; });
    });
    (void)life_.release();  // what it points at is left as it was, for ever
  }
  machine::Trace(regular ? "ended" : power_fails_ ? "power cut" : "killed");
  for (const Visitor& visitor : visitors_) {
    if (visitor.client->connected()) (void)visitor.client->Read();  // what was answered before counts
    Leave(*visitor.client);
  }
  for (int left = 0; left >= 0;) {
    left = accept4(sockets_.listening, nullptr, nullptr, SOCK_CLOEXEC);
    if (left >= 0) close(left);
  }
  if (power_fails_) ++happened_.power_cuts;
  power_fails_ ? disk::LosePower(chance_.troubles) : disk::FlushAll();
  power_fails_ = false;
  judge_.Left(state_, regular ? Judge::Ended::Regularly : Judge::Ended::Killed);
  At(chance_.troubles.Between(0.5, 60.0), [this] { NextLife(); });
}

/// In a folder of another name: what a killed lensd has locked by name stays locked.
void Year::NextLife() {
  static int lives = 0;
  const std::string next = "state." + std::to_string(++lives);
  std::filesystem::rename(state_, next);
  state_ = next;
  disk::Mount(state_);
  judge_.Begun();
  life_ = std::make_unique<Life>(lenses_, state_, sockets_.listening);
}

}  // namespace lensd::year
