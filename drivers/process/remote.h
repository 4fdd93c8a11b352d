// A device in a driver process, as its lens and its camera share it.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "drivers/wire/wire.h"
#include "link.h"
#include "shared_process.h"
#include "urgent.h"

namespace lensd::drivers::process {

/// Any thread; calls are made one at a time.
class Remote {
 public:
  /// Opens the device. Errors of OpenInProcess().
  static Result<std::shared_ptr<Remote>> Open(const Program& program, const Settings& settings);
  /// Closes it in its process.
  ~Remote();
  Remote(const Remote&) = delete;
  Remote& operator=(const Remote&) = delete;

  /// Which connection a call goes by.
  enum class By { Lens, Urgent, Camera };
  /// One call. Cancelled: interrupted; its reply is passed over. Disconnected: the process has ended, now or before.
  Result<wire::Json> Call(By by, std::string_view method, wire::Json parameters = wire::Json::object(), int pass = -1);
  /// A call under way ends soon. Harmless when none is.
  void Interrupt() { urgent_->Interrupt(); }
  /// Ends the wait of a call of Read, and of no other call.
  void CutReadShort() { urgent_->CutReadShort(); }
  /// As the driver counts them, and replies that were wrong.
  std::uint64_t bus_errors() const { return bus_errors_ + wrong_replies_; }
  void CountWrongReply() { ++wrong_replies_; }
  const std::string& device() const { return device_; }
  /// The connection for colours.
  Result<std::unique_ptr<Link>> ConnectForColours() const;

 private:
  Remote(const Program& program, std::shared_ptr<SharedProcess> shared, SharedProcess::Connected connected);
  Result<varlink::Reply> Converse(By by, std::string_view method, wire::Json parameters, int pass, Instant deadline);
  Result<wire::Json> Judge(std::string_view method, Result<varlink::Reply> reply, Duration after);
  Error Lose(Error why);

  const Program program_;
  const std::shared_ptr<SharedProcess> shared_;
  std::shared_ptr<HostProcess> process_;
  const std::string device_;  ///< how the process calls it
  std::unique_ptr<Link> lens_, camera_;
  std::unique_ptr<Urgent> urgent_;
  std::mutex calling_;         ///< held during a call; guards the next
  std::optional<Error> lost_;  ///< why no further call is made
  std::atomic<std::uint64_t> bus_errors_ = 0, wrong_replies_ = 0;
};

}  // namespace lensd::drivers::process
