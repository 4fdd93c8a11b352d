// Calls to lensd that wait for nothing: each on a connection of its own, so that none waits for another, Stop least of
// all.
#pragma once

#include <unistd.h>

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/clock.h"
#include "base/result.h"
#include "loop/web_event_loop.h"
#include "varlink/frame.h"
#include "varlink/message.h"

namespace lensd::web {

/// An open file, closed once; -1: none.
class File {
 public:
  File() = default;
  explicit File(int number) : number_(number) {}
  File(File&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  File& operator=(File&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  ~File() {
    if (number_ >= 0) close(number_);
  }
  int get() const { return number_; }

 private:
  int number_ = -1;
};

/// One call and its replies. Destroying it closes the connection, which ends the call. Its listeners may destroy it.
class UpstreamCall {
 public:
  struct Listener {
    /// A reply, an error of lensd too; `file` is the one that came with it, if any.
    std::function<void(varlink::Reply reply, File file)> reply;
    /// There will be none: Code::Disconnected (lensd is not there, or closed), Timeout, Protocol, Io. Never after the
    /// last reply.
    std::function<void(const Error& why)> failed;
  };

  /// Begins it; listeners are first called from the loop. `limit`: how long it may take in all.
  UpstreamCall(EventLoop& loop, const std::string& path, const varlink::Call& call, Duration limit, Listener listener);
  UpstreamCall(const UpstreamCall&) = delete;
  UpstreamCall& operator=(const UpstreamCall&) = delete;

 private:
  Result<void> Connect(const std::string& path);
  void WatchFor(std::uint32_t events);
  void Ready(std::uint32_t events);
  Result<void> Write();
  Result<void> Read();
  void TellReplies();
  void End(const Error& why);

  EventLoop& loop_;
  Listener listener_;
  File socket_;
  std::string unsent_;
  varlink::FrameReader frames_{varlink::kMaxReplyBytes};
  std::vector<File> files_;  // that came and belong to replies not yet told
  Watch watch_;
  Watch limit_;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);  // expires with this
};

}  // namespace lensd::web
