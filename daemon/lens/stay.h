// Where a lens is to stand: `start` puts it there when its device comes or comes back, and `keep` of [lens.focus]
// brings focus back where another program has moved it.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "base/clock.h"
#include "base/result.h"
#include "drivers/api/lens.h"
#include "rig/presets.h"

namespace lensd::daemon {

class ServedLens;

/// Where a lens was left: `kept` has it with its optics, but is written after the answer to a command; `left`, where
/// commands have left its axes, is written before. Nothing: not known.
std::optional<rig::Preset> LastPlace(std::optional<rig::Preset> kept,
                                     const drivers::PerAxis<std::optional<Native>>& left, const rig::Rig& rig);

/// What has come of clients, when it was last looked at where they have left the lens.
struct SeenCommands {
  std::uint64_t calls = 0;     ///< that may drive the lens
  std::uint64_t sendings = 0;  ///< of focus, by commands that are no stops
  int saying = 0;              ///< calls that say where an axis stands, and are not answered yet
};

/// Of one lens. Event loop thread only, but for problem(). Nothing of this moves a lens that is leased, was stopped for
/// good, or does not know where it stands; any other command ends it.
class LensStay {
 public:
  static constexpr Duration kBetweenReturns = std::chrono::seconds(2);  ///< at least, by `keep`

  explicit LensStay(ServedLens& lens);

  /// The lens was opened (anew). `last`: where it was left before lensd started; nothing: not known, or of no use.
  void Opened(std::optional<rig::Preset> last, const drivers::Capabilities& lens);
  /// The device of an open lens answers again.
  void Back();
  /// The lens' state is new.
  void Look();
  /// Somebody says where an axis stands: nothing is noted or begun until Said().
  void Saying() { ++seen_.saying; }
  /// The lens' state is new, and its position there has changed or not. Nothing has moved: there it is to stay.
  void Said(drivers::Axis axis, bool changed);
  /// From any thread: why the lens is not where it is to stand; empty: nothing is wrong.
  std::string problem() const;

 private:
  struct Order;

  std::uint64_t Commands() const;
  void Start();
  void Keep();
  void Note();
  void Take(const drivers::PerAxis<bool>& axes);
  void KeepLast();
  void Go(Order order);
  void Ended(const Order& order, const Result<rig::RecallOutcome>& outcome);
  bool Wanted() const;
  bool MayMove() const;
  bool AtRest() const;
  bool Known(drivers::Axis axis) const;
  bool NotMissingAnyMore() const;
  void Complain(const std::string& problem);

  ServedLens& lens_;
  std::optional<rig::Preset> last_{};   ///< where clients, or `start`, have left it
  std::optional<std::uint64_t> due_{};  ///< a start that has not begun: the commands of clients before it
  /// What moves the lens must begin no further move once this is true; null: nothing is under way.
  std::shared_ptr<std::atomic<bool>> under_way_{};
  /// What has come since last_ was taken: nothing, a call that may drive the lens, or a command that has.
  enum class Drive { None, Asked, Driven } drive_ = Drive::Asked;
  SeenCommands seen_{};
  drivers::PerAxis<bool> homes_{};  ///< axes that can search a reference
  bool missing_ = false;            ///< there was no such preset when the lens was to go there
  Instant returned_at_{};
  mutable std::mutex mutex_;
  std::string problem_{};  ///< guarded by mutex_
};

}  // namespace lensd::daemon
