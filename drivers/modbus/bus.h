// One bus: its connection, its thread, and who may speak next.
//
// Modbus has one question under way at a time, and on a serial line nothing in an answer says which question it belongs
// to. The thread asks all questions of all drives: stops first, between any two exchanges; otherwise the drives in
// turn, one order or one look each. A unit that is not there costs a whole response timeout whenever it is asked, so
// such units are asked rarely and never two in a row. What must not happen is that a late answer passes for that to a
// later question:
//  - received bytes are thrown away before every question, and after a bad exchange with a unit that is there nothing
//    is asked for another response timeout while what still comes in is thrown away (a stop does not wait for that);
//  - on a serial line the drive is then suspect, and is first asked for a number of registers asked for nowhere else
//    (the profile's probe, of another length each time). Drives answer in order: once an answer of that length is
//    there, nothing older is under way. A stop sent to a suspect drive is sent again after that.
// On TCP libmodbus compares transaction numbers.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "base/clock.h"
#include "base/result.h"
#include "drive.h"
#include "drivers/api/thread_barrier.h"
#include "link.h"
#include "turns.h"

namespace lensd::drivers::modbus {

/// A drive as its bus holds it.
struct BusSlot {
  explicit BusSlot(std::unique_ptr<Drive> the_drive) : drive(std::move(the_drive)) {}

  const std::unique_ptr<Drive> drive;

  // Questions and answers, guarded by Bus::mutex_; each is answered when the answered number reaches the asked one.
  std::optional<Order> order;
  bool order_taken = false;  ///< the thread is at it
  std::uint64_t orders_asked = 0, orders_answered = 0;
  Result<void> order_answer;
  bool stop = false;
  int stop_tries = 0;  ///< of this stop
  Instant stop_at{};   ///< it is not sent before: the drive answered that it is busy
  std::optional<Instant> stop_busy_since = {};
  std::uint64_t stops_asked = 0, stops_answered = 0;
  Result<void> stop_answer;
  std::uint64_t looks_asked = 0, looks_answered = 0;
  Result<Sample> look_answer;
  std::optional<Sample> newest;  ///< the last good look, none since the last order
  int in_use = 0;                ///< by the thread
  bool withdrawn = false;        ///< the caller of the order in progress has gone
  bool interrupted = false;      ///< a stop was served since this order or look was begun

  std::atomic<std::uint64_t> bad_exchanges = 0;
  ThreadBarrier barrier;  ///< what was thrown on the bus' thread while it served this drive

  // The bus' thread only.
  bool suspect = false;
  int probe = 0;
};

class Bus {
 public:
  Bus(BusConfig config, char parity);
  /// Ends the thread; no seat is left.
  ~Bus();
  Bus(const Bus&) = delete;
  Bus& operator=(const Bus&) = delete;

  const BusConfig& config() const { return config_; }
  char parity() const { return parity_; }

  /// From any thread: a drive takes part. The seat must outlive its Remove().
  void Add(BusSlot& seat);
  /// The drive that answers to `unit`, if one takes part: its label.
  std::optional<std::string> WhoIs(int unit);
  void Remove(BusSlot& seat);

  /// Counts calls of Interrupt() for one lens; guarded by the bus.
  struct Interrupts {
    std::uint64_t count = 0;
    std::uint64_t looks = 0;  ///< those that are for looks alone
  };
  enum class Calls { All, Looks };
  /// Those of that lens that wait for their answer return Cancelled.
  void Interrupt(Interrupts& interrupts, Calls calls);

  // These three throw what was thrown on the bus' thread while it served one of the seats; other drives do not notice.
  /// Gives an order and waits for its answer. Timeout, Cancelled: the order is withdrawn, unless it is out already.
  Result<void> Give(BusSlot& seat, const Order& order, const Interrupts& interrupts);
  /// Stops a drive, before everything else on the bus. What is interrupted is stopped all the same.
  Result<void> Stop(BusSlot& seat, const Interrupts& interrupts);
  /// Looks at all of `seats` from now on. Where the bus is slow, what was seen a little earlier, but after the last
  /// order, may be the answer.
  Result<std::vector<Sample>> Look(std::span<const std::unique_ptr<BusSlot>> seats, const Interrupts& interrupts);

 private:
  class Conversation;
  using Exchange = std::function<Result<void>(ModbusLink&)>;
  enum class Priority { Usual, Stop };  ///< a stop waits neither for quiet nor for a pause between connections
  struct Line {
    ModbusLink link;
    Instant last_byte{};
    Instant quiet_until{};
    Instant connect_at{};  ///< not before
    Duration connect_pause{};
    int bad_run = 0;  ///< exchanges in a row
  };

  void Run(const std::stop_token& stop);
  bool ServeStops(std::unique_lock<std::mutex>& lock);
  void TryToStop(std::unique_lock<std::mutex>& lock, BusSlot& seat);
  bool StopAgain(BusSlot& seat, const Error& error);
  Error NotInTime(const BusSlot& seat, const std::string& what);
  void Serve(std::unique_lock<std::mutex>& lock, BusSlot& seat);
  Result<void> Ask(BusSlot& seat, Priority priority, const Exchange& exchange);
  Result<void> WaitForTurn(BusSlot& seat);
  Result<void> Connect(Priority priority);
  Result<void> Probe(BusSlot& seat);
  Result<void> Send(BusSlot& seat, const Exchange& exchange);
  Result<void> Note(BusSlot& seat, Result<void> result, Instant sent_at);
  Result<void> NoteBad(BusSlot& seat);
  Instant Quiet() const;
  Duration IoDeadline() const;

  const BusConfig config_;
  const char parity_;
  const MonotonicClock clock_;

  std::mutex mutex_;
  std::condition_variable_any wake_;     // the thread's
  std::condition_variable_any answers_;  // the callers'
  std::vector<BusSlot*> seats_;          // guarded by mutex_
  Turns turns_;                          // guarded by mutex_
  bool quitting_ = false;                // guarded by mutex_
  Duration profile_gap_{};               // guarded by mutex_

  Line line_;  // the thread only
  std::jthread thread_;
};

}  // namespace lensd::drivers::modbus
