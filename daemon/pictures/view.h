// One View: frames from the rig's thread, made into pictures on another, sent from the event loop.
#pragma once

#include <atomic>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "daemon/pictures/frame_loans.h"
#include "daemon/pictures/picture.h"
#include "daemon/server/exchange.h"
#include "daemon/threads/task_thread.h"
#include "daemon/threads/waiter.h"
#include "loop/event_loop.h"
#include "rig/rig.h"

namespace lensd::daemon {

/// How pictures reach the client, and which frames wait while one is being made or the client has as much as it may:
/// the newest alone, and none while the client is full; or all that there is room for.
enum class PictureWay {
  Inline,     ///< in the replies; the newest frame waits
  InlineAll,  ///< in the replies; all frames wait that there is room for
  File,       ///< beside the replies, as open files; the newest frame waits
};

/// Never holds up who gives it frames: those that there is no room for are dropped, the oldest first.
class View : public Waiter, public std::enable_shared_from_this<View> {
 public:
  /// What views share; outlives them.
  struct Surroundings {
    EventLoop& loop;
    TaskThread& pictures;
    FrameLoans& loans;
  };
  View(const Surroundings& surroundings, ExchangePointer exchange, PictureWish wish, PictureWay way);
  /// Hears of its client from now on. From the event loop.
  void Begin();

  /// From the rig's thread; see rig::FrameViewer::show.
  bool Offer(const Result<rig::LensedFrame>& frame);
  /// Ends it with an error, unless it has ended. From the event loop.
  void End(const Error& error);
  /// The lens' worker hangs: no frame will come.
  void GiveUp(const Error& why) override { End(why); }
  /// What it shares with others is about to go: nothing of it is touched any more, but by a picture being made.
  void Abandon();
  /// Its client is gone, or it has been told of the end. From any thread.
  bool ended() const { return ended_; }

 private:
  /// Pictures made and not sent, where they go into the replies.
  static constexpr int kMostInline = 2;
  /// What a client may have unread when a picture is sent: more would make pictures old before they are seen.
  static constexpr std::size_t kFewUnread = std::size_t{64} << 10;
  static constexpr Duration kAgain = std::chrono::milliseconds(5);
  /// What PictureWay::InlineAll has room for: samples of all frames that wait.
  static constexpr std::size_t kMostSamples = std::size_t{32} << 20;

  void Work();
  void MakeOne(const rig::LensedFrame& frame, std::int64_t dropped);
  void SendInline(std::deque<std::string> pieces);
  void SendNext();
  bool Full();
  void MakeRoom();
  void GoOn();

  const Surroundings surroundings_;
  const ExchangePointer exchange_;
  const PictureWay way_;
  const std::uint64_t borrower_;
  PictureMaker maker_;  // the pictures' thread
  std::atomic<bool> ended_ = false;
  std::atomic<int> inline_ = 0;  // made and not sent
  /// Pictures on their way out in pieces.
  struct Outgoing {
    std::deque<std::deque<std::string>> pictures;  ///< the replies of each
    bool begun = false;                            ///< some of the first are sent
    bool sending = false;                          ///< a reply has not left the daemon
    bool waits = false;                            ///< for the client to read
  } outgoing_;                                     // the event loop
  /// Between the rig's thread and the pictures'.
  struct Waiting {
    std::mutex mutex;
    bool working = false;
    std::deque<rig::LensedFrame> frames;  ///< the oldest first
    std::int64_t dropped = 0;
  } waiting_;
};

}  // namespace lensd::daemon
