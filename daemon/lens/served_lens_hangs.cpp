// Calls to a device that do not come back: their threads are let go, and the device is opened anew beside them.
#include <chrono>

#include "daemon/events/log.h"
#include "daemon/lens/served_lens.h"

namespace lensd::daemon {
namespace {

constexpr Duration kHungOpening = std::chrono::seconds(15);  // longer than any driver takes that keeps its deadlines
constexpr Duration kHungCall = std::chrono::seconds(10);     // the same of one step of a rig
constexpr std::size_t kMostStuck = 3;                        // threads of one lens: each may hold its device open

}  // namespace

void ServedLens::LookAfter() {
  ForgetStuck();
  const Instant now = surroundings_.clock.Now();
  if (worker_) {
    GiveUpStops();
    if (opening_.life >= Life::Ending && WritesPositions()) return;  // its disk is slow, not its device
    if (now - worker_->busy_since().value_or(now) >= kHungCall) GiveUp(kHungCall, "in a call");
  } else if (retry_) {
    if (opening_.tenure->OpeningFor(now) >= kHungOpening) GiveUp(kHungOpening, "while it was being opened");
  } else if (shown_.connection == "hung" && opening_.stuck.size() < kMostStuck && opening_.life < Life::Ending) {
    OpenAfter({});  // one of those that were too many has come back
  }
}

/// A thread that hangs in a driver cannot be helped. It keeps what it holds and is not listened to any more; another
/// one opens the device anew, unless too many hang already.
void ServedLens::GiveUp(Duration after, std::string_view what) {
  opening_.tenure->End();
  opening_.left_moving = opening_.left_moving || worker_ != nullptr;
  stop_signal_->Sever();
  stop_signal_ = std::make_shared<StopSignal>();
  if (worker_) worker_->Abandon();
  if (retry_) retry_->End();
  opening_.stuck.push_back({opening_.tenure, std::move(worker_), std::move(retry_)});
  simulation_.reset();
  const bool may_try = opening_.stuck.size() < kMostStuck;
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(after).count();
  const std::string problem =
      "its device has not answered for " + std::to_string(seconds) + " s " + std::string(what) +
      (opening_.left_moving ? ": a motor that was moving may continue" : "") +
      (may_try ? "; lensd opens it again beside this call"
               : "; " + std::to_string(kMostStuck) + " such calls hang: lensd waits until one comes back");
  Log(Severity::Error, Event::LensFailed, problem, name());
  if (opening_.life >= Life::Ending) {
    opening_.life = Life::Ended;
  } else {
    ShowAbsent("hung", problem);
    TellChange();
    RunParked();
    if (may_try) OpenAfter(PauseAfterFailure());
  }
  users_->waiters.GiveUpAll({Code::Disconnected, problem});
}

/// Those that waited for too long, and all of them once the worker is known to hang.
void ServedLens::GiveUpStops() {
  const Instant now = surroundings_.clock.Now();
  const bool hangs = now - worker_->busy_since().value_or(now) >= kStopAtMost;
  users_->waiters.GiveUpOverdue(
      hangs ? now + kStopAtMost : now,
      {Code::Timeout, "lens \"" + name() +
                          "\" has received the stop, but a call to its device has not returned yet: a motor that is "
                          "moving may continue until it returns"});
}

/// Threads that have come back after all.
void ServedLens::ForgetStuck() {
  const auto back = std::erase_if(
      opening_.stuck, [](const Stuck& one) { return one.worker ? !one.worker->busy_since() : one.retry->ended(); });
  if (back == 0) return;
  Log(Severity::Info, Event::LensReady, "a call that hung has returned; its answer is ignored", name());
}

}  // namespace lensd::daemon
