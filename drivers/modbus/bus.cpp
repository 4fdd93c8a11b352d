// The thread of one bus: stops first, then the drives in turn, one exchange at a time. After anything odd the line is
// drained before the next question.
#include "bus.h"

#include <algorithm>
#include <array>
#include <utility>

namespace lensd::drivers::modbus {
namespace {

using std::chrono::milliseconds;

constexpr int kStopAttempts = 3;
constexpr Duration kBusyStop = std::chrono::seconds(1);  ///< so long a busy drive is asked again to stop
constexpr Duration kBusyPause = milliseconds(10);        ///< before a busy drive is asked again
constexpr Duration kFirstPause = milliseconds(100);      ///< between attempts to connect
constexpr Duration kLongestPause = std::chrono::seconds(2);
constexpr int kReconnectAfter = 3;  ///< bad exchanges in a row, on TCP

Error Named(const Drive& drive, const Error& error) {
  return {error.code, drive.label() + " " + error.message};
}

bool StopIsDue(const BusSlot& seat, Instant now) {
  return seat.stop && seat.stop_at <= now;
}

bool AnyStop(const std::vector<BusSlot*>& seats, Instant now) {
  return std::ranges::any_of(seats, [&](const BusSlot* seat) { return StopIsDue(*seat, now); });
}

/// When the next stop is due that had to be put off; nothing where none was.
std::optional<Instant> NextStop(const std::vector<BusSlot*>& seats) {
  std::optional<Instant> next;
  for (const BusSlot* const seat : seats) {
    if (seat->stop) next = std::min(next.value_or(seat->stop_at), seat->stop_at);
  }
  return next;
}

}  // namespace

/// A drive's own end of the bus.
class Bus::Conversation final : public RegisterAccess {
 public:
  Conversation(Bus& bus, BusSlot& seat, Priority priority) : bus_(bus), seat_(seat), priority_(priority) {}

  Result<void> Read(std::uint16_t address, std::span<std::uint16_t> registers) override {
    const DriveConfig& config = seat_.drive->config();
    return bus_.Ask(seat_, priority_, [&](ModbusLink& link) {
      return link.Read(config.unit, config.profile.read_function, address, registers);
    });
  }
  Result<void> Write(int function, std::uint16_t address, std::span<const std::uint16_t> registers) override {
    const int unit = seat_.drive->config().unit;
    return bus_.Ask(seat_, priority_, [&](ModbusLink& link) { return link.Write(unit, function, address, registers); });
  }
  bool suspect() const override { return seat_.suspect; }

 private:
  Bus& bus_;
  BusSlot& seat_;
  const Priority priority_;
};

Bus::Bus(BusConfig config, char parity)
    : config_(std::move(config)), parity_(parity), turns_(config_.response_timeout), line_{.link{config_, parity}} {
  thread_ = std::jthread([this](const std::stop_token& stop) { Run(stop); });
}

Bus::~Bus() {
  {
    const std::lock_guard lock(mutex_);
    quitting_ = true;
  }
  thread_.request_stop();
  thread_.join();
}

void Bus::Add(BusSlot& seat) {
  const std::lock_guard lock(mutex_);
  seats_.push_back(&seat);
  profile_gap_ = std::max(profile_gap_, seat.drive->config().profile.gap);
}

std::optional<std::string> Bus::WhoIs(int unit) {
  const std::lock_guard lock(mutex_);
  const auto found =
      std::ranges::find_if(seats_, [&](const BusSlot* seat) { return seat->drive->config().unit == unit; });
  if (found == seats_.end()) return std::nullopt;
  return (*found)->drive->label();
}

void Bus::Remove(BusSlot& seat) {
  std::unique_lock lock(mutex_);
  std::erase(seats_, &seat);
  seat.withdrawn = true;
  wake_.notify_all();
  answers_.wait(lock, [&] { return seat.in_use == 0; });
}

// ---- the thread ---------------------------------------------------------------------------------------------------

void Bus::Run(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (!stop.stop_requested()) {
    if (ServeStops(lock)) continue;
    BusSlot* const seat = turns_.Next(seats_, clock_.Now());
    if (seat == nullptr) {
      const auto absent = turns_.NextAbsent(seats_), stop_due = NextStop(seats_);
      // Where a caller has asked meanwhile for a drive that is not there, the wait begins anew.
      const auto changed = [&] {
        return turns_.Next(seats_, clock_.Now()) != nullptr || AnyStop(seats_, clock_.Now()) ||
               turns_.NextAbsent(seats_) != absent;
      };
      if (absent || stop_due) {
        wake_.wait_until(lock, stop, std::min(absent.value_or(Instant::max()), stop_due.value_or(Instant::max())),
                         changed);
      } else {
        wake_.wait(lock, stop, changed);
      }
    } else {
      turns_.Served(*seat);
      Serve(lock, *seat);
    }
  }
}

/// Sends every stop that is wanted, those first that have failed least often. Whether there was one.
bool Bus::ServeStops(std::unique_lock<std::mutex>& lock) {
  bool any = false;
  while (AnyStop(seats_, clock_.Now())) {
    BusSlot* next = nullptr;
    for (BusSlot* const seat : seats_) {
      if (StopIsDue(*seat, clock_.Now()) && (next == nullptr || seat->stop_tries < next->stop_tries)) next = seat;
    }
    if (next == nullptr) continue;
    TryToStop(lock, *next);
    any = true;
  }
  return any;
}

void Bus::TryToStop(std::unique_lock<std::mutex>& lock, BusSlot& seat) {
  ++seat.in_use;
  const auto number = seat.stops_asked;
  seat.stop = false;
  seat.interrupted = true;
  lock.unlock();
  Conversation talk(*this, seat, Priority::Stop);
  auto stopped = seat.barrier.Answer([&] { return seat.drive->Halt(talk); });
  lock.lock();
  --seat.in_use;
  if (!stopped && StopAgain(seat, stopped.error())) {
    seat.stop = true;
  } else {
    seat.stop_tries = 0;
    seat.stop_busy_since.reset();
    seat.stop_answer = std::move(stopped);
    seat.stops_answered = number;
  }
  answers_.notify_all();
}

/// Whether a stop that failed is sent once more, and from when on. A busy drive has heard the question: what it is
/// asked again is counted by time, not by attempts.
bool Bus::StopAgain(BusSlot& seat, const Error& error) {
  if (seat.stops_answered == seat.stops_asked) return false;  // a newer command took over meanwhile
  if (error.code == Code::Disconnected) return false;
  if (error.code != Code::Busy) return ++seat.stop_tries < kStopAttempts;
  const Instant now = clock_.Now();
  if (!seat.stop_busy_since) seat.stop_busy_since = now;
  seat.stop_at = now + kBusyPause;
  return now - *seat.stop_busy_since < kBusyStop;
}

/// One order, or one look.
void Bus::Serve(std::unique_lock<std::mutex>& lock, BusSlot& seat) {
  ++seat.in_use;
  seat.interrupted = false;
  seat.withdrawn = false;
  Conversation talk(*this, seat, Priority::Usual);
  if (seat.order) {
    const Order order = *std::exchange(seat.order, std::nullopt);
    const auto number = seat.orders_asked;
    seat.order_taken = true;
    lock.unlock();
    auto obeyed = seat.barrier.Answer([&] { return seat.drive->Execute(order, talk); });
    lock.lock();
    seat.order_taken = false;
    seat.order_answer = std::move(obeyed);
    seat.orders_answered = number;
  } else {
    const auto number = seat.looks_asked;
    const auto orders = seat.orders_asked, stops = seat.stops_asked;
    lock.unlock();
    auto seen = seat.barrier.Answer([&] { return seat.drive->Look(talk); });
    lock.lock();
    // A look that a stop has cut short is not a look.
    if (!seat.interrupted || seat.withdrawn) {
      if (seen && orders == seat.orders_asked && stops == seat.stops_asked) seat.newest = *seen;
      seat.look_answer = std::move(seen);
      seat.looks_answered = number;
    }
  }
  --seat.in_use;
  answers_.notify_all();
}

Result<void> Bus::Ask(BusSlot& seat, Priority priority, const Exchange& exchange) {
  if (priority == Priority::Usual) {
    if (auto turn = WaitForTurn(seat); !turn) return turn;
  }
  if (auto connected = Connect(priority); !connected) return connected;
  if (priority == Priority::Usual && seat.suspect) {
    if (auto probed = Probe(seat); !probed) return probed;
  }
  return Send(seat, exchange);
}

/// Waits for the silence before a frame, and longer after a bad exchange, letting stops through.
Result<void> Bus::WaitForTurn(BusSlot& seat) {
  std::unique_lock lock(mutex_);
  while (true) {
    ServeStops(lock);
    if (seat.interrupted || seat.withdrawn || quitting_) return Fail(Code::Cancelled, "stopped");
    const Instant free = std::max(line_.quiet_until, Quiet());
    if (clock_.Now() >= free) return {};
    wake_.wait_until(lock, free, [&] { return quitting_ || AnyStop(seats_, clock_.Now()); });
  }
}

Result<void> Bus::Connect(Priority priority) {
  if (line_.link.open()) return {};
  const auto unreachable = [&](const std::string& why) {
    return Fail(Code::Disconnected, "bus " + config_.name + ": " + why);
  };
  if (clock_.Now() < line_.connect_at && priority == Priority::Usual)
    return unreachable("the connection to " + config_.Endpoint() + " is lost");
  auto opened = line_.link.Open();
  if (!opened) {
    line_.connect_pause = std::clamp<Duration>(2 * line_.connect_pause, kFirstPause, kLongestPause);
    line_.connect_at = clock_.Now() + line_.connect_pause;
    return unreachable(opened.error().message);
  }
  line_.connect_pause = {};
  line_.bad_run = 0;
  const std::lock_guard lock(mutex_);
  for (BusSlot* const seat : seats_) seat->suspect = false;
  return {};
}

/// Asks for as many registers as no other question does, so that the answer cannot be one to anything older.
Result<void> Bus::Probe(BusSlot& seat) {
  const Profile& profile = seat.drive->config().profile;
  if (!profile.probe) {
    seat.suspect = false;  // it has been quiet for long enough
    return {};
  }
  // Numbers are one or two registers: lengths beyond are the probes'.
  do {
    seat.probe =
        seat.probe + profile.probe_step > profile.probe_count ? profile.probe_step : seat.probe + profile.probe_step;
  } while (seat.probe <= 2 && profile.probe_count > 2);
  std::array<std::uint16_t, 125> registers{};
  const std::span wanted = std::span(registers).first(static_cast<std::size_t>(seat.probe));
  auto probed = Send(seat, [&](ModbusLink& link) {
    return link.Read(seat.drive->config().unit, profile.read_function, profile.probe->address, wanted);
  });
  if (probed) seat.suspect = false;
  return probed;
}

Result<void> Bus::Send(BusSlot& seat, const Exchange& exchange) {
  std::unique_lock lock(mutex_);
  const Instant quiet = Quiet();
  lock.unlock();
  std::this_thread::sleep_until(quiet);
  line_.link.Flush();
  const Instant sent_at = clock_.Now();
  return Note(seat, exchange(line_.link), sent_at);
}

/// What an exchange means for those that follow.
Result<void> Bus::Note(BusSlot& seat, Result<void> result, Instant sent_at) {
  const Instant now = clock_.Now();
  // After silence the line has been quiet since the question.
  line_.last_byte = !result && result.error().code == Code::Timeout ? sent_at : now;
  if (line_.link.outcome() != ModbusLink::Outcome::Answered) ++seat.bad_exchanges;
  switch (line_.link.outcome()) {
    case ModbusLink::Outcome::Answered: {
      line_.bad_run = 0;
      const std::lock_guard lock(mutex_);
      turns_.Answered(seat);
      break;
    }
    case ModbusLink::Outcome::Lost: {
      line_.connect_at = now;
      const std::lock_guard lock(mutex_);
      for (BusSlot* const other : seats_) other->drive->Forget();
      break;
    }
    case ModbusLink::Outcome::Bad:
      if (auto gone = NoteBad(seat); !gone) return gone;
      break;
  }
  if (!result) return PassOn(Named(*seat.drive, result.error()));
  return result;
}

/// Disconnected: it has failed often enough to count as gone.
Result<void> Bus::NoteBad(BusSlot& seat) {
  const Instant now = clock_.Now();
  line_.link.Flush();
  seat.suspect = config_.serial();
  if (++line_.bad_run >= kReconnectAfter && !config_.serial()) {
    line_.link.Close();
    line_.connect_at = now;
  }
  const std::lock_guard lock(mutex_);
  // From a unit that is not there nothing late is to be expected; should it come, it answers for no other unit.
  if (!turns_.Absent(seat)) {
    const bool probed = seat.drive->config().profile.probe || !config_.serial();
    line_.quiet_until = now + config_.response_timeout * (probed ? 1 : 3);
  }
  turns_.Failed(seat, now);
  const Turns::Unit unit = turns_.Of(seat);
  const bool first = !unit.heard && unit.failures == 1;  // one answer may be lost to noise
  if (first || !turns_.Absent(seat)) return {};
  seat.drive->Forget();
  return PassOn(Named(*seat.drive, {Code::Disconnected, unit.heard ? "does not answer any more" : "does not answer"}));
}

/// When there has been silence enough for a frame on a serial line: three and a half characters, never less than 1.75
/// ms (Modbus over serial line, 2.5.1.1). Under mutex_.
Instant Bus::Quiet() const {
  if (!config_.serial()) return {};
  const Duration characters{static_cast<Duration::rep>(3.5 * 11.0 * 1e9 / config_.baud)};
  return line_.last_byte + std::max({characters, Duration(std::chrono::microseconds(1750)), profile_gap_, config_.gap});
}

}  // namespace lensd::drivers::modbus
