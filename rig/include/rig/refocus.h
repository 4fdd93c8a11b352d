// Focus that is looked after once an autofocus has reached it: when it is due to be corrected, and how. Nothing here
// waits or owns a thread; the daemon, which drives the rig, asks what is due and has it done.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "autofocus/tracker.h"
#include "base/clock.h"
#include "base/result.h"
#include "base/units.h"
#include "rig/config.h"
#include "rig/focus_drift.h"
#include "rig/rig.h"

namespace lensd::rig {

enum class RefocusCause { Temperature, Time, Filter, Sharpness };

/// What an autofocus has reached, and what lensd has made of it since.
struct FocusReached {
  AutofocusRequest search{};                ///< what found it, to be asked for again
  std::optional<drivers::Region> region{};  ///< that it is in focus in; nothing: not in frames of the lens's own camera
  std::string method{};                     ///< that found it
  Native position;                          ///< of focus
  std::optional<Celsius> temperature{};     ///< that this position is of
  std::optional<Celsius> corrected_at{};    ///< at the newest search or move
  std::optional<Native> filter{};
  std::optional<Native> zoom{};
  std::optional<FNumber> f_number{};
  CommandCount commands{};  ///< for the focus, these included: with any other it is not lensd's to look after
  Instant found{};
};

/// One correction that is due.
struct RefocusOrder {
  RefocusCause cause = RefocusCause::Time;
  FocusReached from;
  RefocusConfig how;
  Result<FocusDrift> drift;  ///< or why it is not known
};

struct RefocusOutcome {
  enum class End {
    Moved,     ///< by what was learned or measured
    Searched,  ///< and found
    Refused,   ///< searched, and the lens is back where it was
    Failed     ///< neither
  };
  End end = End::Failed;
  std::string reason;                        ///< why that way
  std::optional<Metres> by{};                ///< of a move: how much extension it moved, where optics are known
  std::uint64_t commands = 1;                ///< for the focus, that it took
  std::optional<MoveOutcome> move{};         ///< where it moved
  std::optional<AutofocusOutcome> search{};  ///< where it searched
};

/// Carries one out. Superseded: a command for the focus has come since. Busy: the lens is not at rest, or held. Else as
/// Rig::Move() and Rig::Autofocus().
void Refocus(Rig& rig, RefocusOrder order, std::move_only_function<void(Result<RefocusOutcome>)> done);

/// Whether the region in focus has lost sharpness: shared by the rig's thread, which sees the frames, and who asks.
struct SharpnessWatch {
  explicit SharpnessWatch(double loss);  ///< the share that may be lost
  std::atomic<bool> over = false;        ///< no watcher asks any more
  std::atomic<bool> lost = false;
  std::atomic<bool> blind = false;  ///< frames failed: it is to be shown once more
  autofocus::Tracker tracker;       ///< the rig's thread
};
/// Looks at frames of a lens at rest, as often as `how` says. To be shown by the rig that is given; it must outlive it.
FrameViewer ViewerOf(const Rig& rig, const FocusReached& reached, const RefocusConfig& how,
                     std::shared_ptr<SharpnessWatch> watch);

/// What a lens has of what refocusing may need.
struct RefocusMeans {
  bool thermometer = false, filter = false, camera = false;
};
/// What is configured and can never happen, a sentence each.
std::vector<std::string> WhatRefocusLacks(const RefocusConfig& config, const RefocusMeans& means);

/// Decides. One thread.
class RefocusKeeper {
 public:
  RefocusKeeper(const RefocusConfig& config, std::vector<DriftSample> learned);

  /// An autofocus that a client asked for has ended with `status`. True: something was learned.
  bool Found(const AutofocusRequest& request, const AutofocusOutcome& outcome, const Status& status, Instant now,
             std::string made);
  /// What is to be done now. `waits`: empty, or why not for the moment. After it, Ended().
  std::optional<RefocusOrder> Due(const Status& status, Instant now, const std::string& waits);
  /// What was due has ended with `status`. True: something was learned.
  bool Ended(const Result<RefocusOutcome>& outcome, const Status& status, Instant now, std::string made);
  /// The lens is another one, or gone.
  void GiveUp(std::string why);
  /// Forgets what was learned, or the one of this number, from 0.
  void Forget(std::optional<std::size_t> sample);

  const std::vector<DriftSample>& learned() const { return learned_; }
  const Result<FocusDrift>& drift() const { return drift_; }
  const RefocusConfig& config() const { return config_; }
  /// What is looked after; nothing: nothing is, and why_not() says why.
  const std::optional<FocusReached>& reached() const { return reached_; }
  /// Why nothing happens now though it might; empty: nothing is due.
  const std::string& why_not() const { return why_not_; }
  /// Of the focus that is looked after, where sharpness counts; null: it does not. Another one with each search.
  const std::shared_ptr<SharpnessWatch>& watch() const { return watch_; }

 private:
  /// `made`: when, of an outcome that says where focus belongs at its temperature; nothing: it says too little.
  bool Adopt(FocusReached reached, const AutofocusOutcome& outcome, const Status& status,
             std::optional<std::string> made);
  std::optional<RefocusCause> CauseOf(const Status& status, Instant now) const;

  RefocusConfig config_;
  std::vector<DriftSample> learned_;
  Result<FocusDrift> drift_;
  std::optional<FocusReached> reached_;
  std::optional<FocusReached> former_;  ///< given up for one command: that may be the next autofocus
  std::string why_not_ = "no autofocus has reached focus since lensd began";
  std::shared_ptr<SharpnessWatch> watch_;
  std::optional<Instant> tried_;  ///< when the last one ended
  int failures_ = 0;              ///< in a row
  int subject_ = 0;
};

}  // namespace lensd::rig
