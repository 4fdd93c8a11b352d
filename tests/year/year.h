// A part of the year, from one seed: lensd after lensd, and all who use them.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "base/clock.h"
#include "client.h"
#include "judge.h"
#include "life.h"
#include "machine.h"
#include "programme.h"
#include "true_lenses.h"

namespace lensd::year {

/// What the command line says.
struct Wish {
  std::uint64_t seed = 1;
  double hours = 24.0;
  double pace = 1.0;  ///< everything happens so many times as often
  bool wall_jumps = true;
  std::string trace;
  Planted planted;
  std::string planted_name;
};

/// Counts, for the report.
struct Figure {
  std::string_view name;
  std::uint64_t value = 0;
};
using Figures = std::vector<Figure>;

class Year {
 public:
  /// In the folder we are in, which is empty. After machine::Begin().
  explicit Year(const Wish& wish);
  void Run();
  Figures figures() const;

 private:
  /// Someone who comes, works for a while, and goes.
  struct Visitor {
    std::unique_ptr<Client> client;
    Mind mind;
    int calls_left = 0;
  };
  struct Happened {
    std::uint64_t faults = 0, disks = 0, kills = 0, power_cuts = 0, ends = 0, visits = 0, jumps = 0;
  };
  struct Sockets {
    std::string address;
    int epoll = -1, listening = -1;
  };
  /// One stream of random numbers each: what one draws changes nothing for the others.
  struct Chances {
    Chance people, troubles, walls;
  };
  void At(double seconds, std::function<void()> what);
  void Often(double minutes, Chance& chance, std::function<void()> what);
  void Listen();
  void Serve(std::int64_t until);
  void ReadAll();
  void Hear(Client& client, const Call& call, const Json& reply, bool last);
  Visitor* VisitorOf(const Client& client);
  void Ask(Client& client, Call call);
  void Leave(Client& client);
  void Visit(Visitor& visitor);
  void GoOn(Visitor& visitor);
  void Contest(const std::string& lens, std::uint64_t holder);
  void Audit();
  void TroubleLens();
  void TroubleDisk();
  void JumpClock();
  void EndLife();
  void Killed();
  void NextLife();

  const Wish wish_;
  const MonotonicClock clock_;
  Lenses lenses_;
  Judge judge_;
  Chances chance_;
  std::multimap<std::int64_t, std::function<void()>> due_;
  std::vector<Visitor> visitors_;  // the last two look on: the auditor and the watcher
  std::unique_ptr<Life> life_;
  Happened happened_;
  Sockets sockets_;
  std::string state_;
  bool power_fails_ = false;
};

}  // namespace lensd::year
