#include "usb_link.h"

#include <fcntl.h>
#include <libusb-1.0/libusb.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <mutex>
#include <thread>
#include <utility>

namespace lensd::drivers::uvc {
namespace {

constexpr int kPacketsPerTransfer = 32;
constexpr int kIsochronousTransfers = 6;
constexpr int kBulkTransfers = 4;
constexpr std::size_t kMostStatus = 64;               // packets kept; a device that floods loses the oldest
constexpr Duration kGrace = std::chrono::seconds(2);  // beyond libusb's own timeout

struct TransferDeleter {
  void operator()(libusb_transfer* transfer) const { libusb_free_transfer(transfer); }
};
using TransferPtr = std::unique_ptr<libusb_transfer, TransferDeleter>;

/// This driver's errors out of libusb's.
Error ErrorFromUsb(int code, const std::string& what) {
  const std::string why = what + ": " + libusb_strerror(code);
  switch (code) {
    case LIBUSB_ERROR_NO_DEVICE:
    case LIBUSB_ERROR_NOT_FOUND:
      return {Code::Disconnected, why};
    case LIBUSB_ERROR_BUSY:
      return {Code::Busy, why + ": another program holds it"};
    case LIBUSB_ERROR_ACCESS:
      return {Code::Io, why + ": see the udev rules in docs/drivers/uvc.md"};
    case LIBUSB_ERROR_TIMEOUT:
      return {Code::Timeout, why};
    case LIBUSB_ERROR_NOT_SUPPORTED:
      return {Code::Unsupported, why};
    default:
      return {Code::Protocol, why};
  }
}

Reply::Outcome OutcomeOf(libusb_transfer_status status) {
  switch (status) {
    case LIBUSB_TRANSFER_COMPLETED:
      return Reply::Outcome::Done;
    case LIBUSB_TRANSFER_STALL:
      return Reply::Outcome::Stalled;
    case LIBUSB_TRANSFER_TIMED_OUT:
      return Reply::Outcome::TimedOut;
    case LIBUSB_TRANSFER_CANCELLED:
      return Reply::Outcome::Cancelled;
    case LIBUSB_TRANSFER_NO_DEVICE:
      return Reply::Outcome::Gone;
    default:
      return Reply::Outcome::Failed;
  }
}

/// One transfer that is submitted again as long as it is wanted. Its own memory, freed when its last callback is over.
struct Stream {
  TransferPtr transfer;
  std::vector<std::uint8_t> buffer;
  bool in_flight = false;
};

class Link final : public Transport {
 public:
  explicit Link(LinkOptions options) : options_(std::move(options)) {}
  ~Link() override;

  Result<void> Open();

  Reply Control(const Setup& setup, std::span<const std::uint8_t> out, Duration timeout) override;
  void WaitUntil(Instant until) override;
  std::vector<std::vector<std::uint8_t>> TakeStatus() override;
  Result<void> StartStream(const StreamPipe& pipe, PayloadSink& sink) override;
  void StopStream() override;
  bool Gone() const override { return gone_; }
  void BeginCall() override;
  void Interrupt() override;

 private:
  struct ControlCall {
    Link* link;
    bool done = false;
    libusb_transfer_status status = LIBUSB_TRANSFER_ERROR;
    int length = 0;
  };

  Result<void> Connect();
  void StartStatus();
  void CancelAll(std::vector<std::unique_ptr<Stream>>& streams, std::unique_lock<std::mutex>& lock);
  Result<std::unique_ptr<Stream>> MakeStream(const StreamPipe& pipe);
  void Resubmit(Stream& stream, bool wanted);
  void Deliver(const libusb_transfer& transfer);

  static void LIBUSB_CALL OnControl(libusb_transfer* transfer);
  static void LIBUSB_CALL OnStatus(libusb_transfer* transfer);
  static void LIBUSB_CALL OnStream(libusb_transfer* transfer);
  static Stream* FindStream(std::vector<std::unique_ptr<Stream>>& streams, const libusb_transfer* transfer);

  const LinkOptions options_;
  int fd_ = -1;
  libusb_context* context_ = nullptr;
  libusb_device_handle* handle_ = nullptr;
  std::vector<std::uint8_t> claimed_;
  std::jthread events_;
  std::atomic<bool> stop_events_ = false;
  std::atomic<bool> gone_ = false;

  std::mutex mutex_;  ///< of everything below; held by callbacks too, never while libusb may call back
  std::condition_variable changed_;
  bool interrupted_ = false;
  libusb_transfer* control_ = nullptr;  ///< under way
  std::vector<std::unique_ptr<Stream>> status_;
  bool want_status_ = false;
  std::deque<std::vector<std::uint8_t>> status_packets_;
  std::vector<std::unique_ptr<Stream>> streams_;
  bool want_streams_ = false;
  std::atomic<PayloadSink*> sink_ = nullptr;
  StreamPipe pipe_;
};

Result<void> Link::Open() {
  fd_ = ::open(options_.node.c_str(), O_RDWR | O_CLOEXEC);
  if (fd_ < 0) {
    const int error = errno;
    const std::string what = options_.node + ": " + std::strerror(error);
    if (error == EACCES || error == EPERM) return Fail(Code::Io, what + ": see the udev rules in docs/drivers/uvc.md");
    return Fail(Code::Disconnected, what);
  }
  return Connect();
}

Result<void> Link::Connect() {
  // Not told to leave discovery out (LIBUSB_OPTION_NO_DEVICE_DISCOVERY), although the node is known: before 1.0.27 that
  // holds for every context of the process, and other libraries look for their cameras through libusb.
  if (const int code = libusb_init(&context_); code != 0) return std::unexpected(ErrorFromUsb(code, "libusb"));
  if (const int code = libusb_wrap_sys_device(context_, fd_, &handle_); code != 0) {
    return std::unexpected(ErrorFromUsb(code, options_.node));
  }
  events_ = std::jthread([this] {
    while (!stop_events_) {
      timeval second{1, 0};
      libusb_handle_events_timeout_completed(context_, &second, nullptr);
    }
  });
  libusb_set_auto_detach_kernel_driver(handle_, 1);
  for (const std::uint8_t interface : options_.interfaces) {
    if (const int code = libusb_claim_interface(handle_, interface); code != 0) {
      return std::unexpected(ErrorFromUsb(code, "interface " + std::to_string(interface) + " of " + options_.node));
    }
    claimed_.push_back(interface);
  }
  StartStatus();
  return {};
}

Link::~Link() {
  StopStream();
  if (handle_ != nullptr) {
    std::unique_lock lock(mutex_);
    want_status_ = false;
    CancelAll(status_, lock);
    lock.unlock();
    // Streaming first, control last: the kernel's driver binds to the control interface and takes the others along.
    for (auto interface = claimed_.rbegin(); interface != claimed_.rend(); ++interface) {
      libusb_release_interface(handle_, *interface);
    }
    stop_events_ = true;
    libusb_interrupt_event_handler(context_);
    events_.join();
    libusb_close(handle_);
  }
  if (context_ != nullptr) libusb_exit(context_);
  if (fd_ >= 0) ::close(fd_);
}

void Link::BeginCall() {
  const std::lock_guard lock(mutex_);
  interrupted_ = false;
}

void Link::Interrupt() {
  const std::lock_guard lock(mutex_);
  interrupted_ = true;
  if (control_ != nullptr) libusb_cancel_transfer(control_);
  changed_.notify_all();
}

void Link::WaitUntil(Instant until) {
  std::unique_lock lock(mutex_);
  changed_.wait_until(lock, until, [this] { return interrupted_; });
}

void Link::OnControl(libusb_transfer* transfer) {
  auto& call = *static_cast<ControlCall*>(transfer->user_data);
  Link& link = *call.link;
  const std::lock_guard lock(link.mutex_);
  call.status = transfer->status;
  call.length = transfer->actual_length;
  call.done = true;
  link.control_ = nullptr;
  if (transfer->status == LIBUSB_TRANSFER_NO_DEVICE) link.gone_ = true;
  link.changed_.notify_all();
}

Reply Link::Control(const Setup& setup, std::span<const std::uint8_t> out, Duration timeout) {
  using Outcome = Reply::Outcome;
  std::vector<std::uint8_t> buffer(LIBUSB_CONTROL_SETUP_SIZE + setup.length);
  libusb_fill_control_setup(buffer.data(), setup.request_type, setup.request, setup.value, setup.index, setup.length);
  std::ranges::copy(out, buffer.begin() + LIBUSB_CONTROL_SETUP_SIZE);
  const TransferPtr transfer(libusb_alloc_transfer(0));
  ControlCall call{this};
  const auto ms = std::chrono::ceil<std::chrono::milliseconds>(timeout);
  libusb_fill_control_transfer(transfer.get(), handle_, buffer.data(), OnControl, &call,
                               static_cast<unsigned>(ms.count()));
  std::unique_lock lock(mutex_);
  if (interrupted_) return {Outcome::NotSent, {}};
  if (gone_) return {Outcome::Gone, {}};
  if (const int code = libusb_submit_transfer(transfer.get()); code != 0) {
    if (code == LIBUSB_ERROR_NO_DEVICE) gone_ = true;
    return {code == LIBUSB_ERROR_NO_DEVICE ? Outcome::Gone : Outcome::Failed, {}};
  }
  control_ = transfer.get();
  if (!changed_.wait_for(lock, timeout + kGrace, [&] { return call.done; })) {
    libusb_cancel_transfer(transfer.get());
    changed_.wait(lock, [&] { return call.done; });
  }
  Reply reply{OutcomeOf(call.status), {}};
  if (setup.in() && reply.outcome == Outcome::Done) {
    const auto* data = libusb_control_transfer_get_data(transfer.get());
    reply.data.assign(data, data + call.length);
  }
  // The kernel takes fewer bytes only from a device that does not take them all.
  if (!setup.in() && reply.outcome == Outcome::Done && call.length != setup.length) reply.outcome = Outcome::Failed;
  return reply;
}

Stream* Link::FindStream(std::vector<std::unique_ptr<Stream>>& streams, const libusb_transfer* transfer) {
  for (auto& stream : streams) {
    if (stream->transfer.get() == transfer) return stream.get();
  }
  return nullptr;
}

/// Call with the lock held.
void Link::Resubmit(Stream& stream, bool wanted) {
  stream.in_flight = false;
  if (stream.transfer->status == LIBUSB_TRANSFER_NO_DEVICE) gone_ = true;
  if (wanted && !gone_) {
    const int code = libusb_submit_transfer(stream.transfer.get());
    stream.in_flight = code == 0;
    if (code == LIBUSB_ERROR_NO_DEVICE) gone_ = true;
  }
  changed_.notify_all();
}

void Link::StartStatus() {
  if (options_.status_endpoint == 0) return;
  auto stream = std::make_unique<Stream>();
  stream->buffer.resize(std::max<std::size_t>(options_.status_bytes, 16));
  stream->transfer.reset(libusb_alloc_transfer(0));
  libusb_fill_interrupt_transfer(stream->transfer.get(), handle_, options_.status_endpoint, stream->buffer.data(),
                                 static_cast<int>(stream->buffer.size()), OnStatus, this, 0);
  const std::lock_guard lock(mutex_);
  want_status_ = true;
  stream->in_flight = libusb_submit_transfer(stream->transfer.get()) == 0;
  status_.push_back(std::move(stream));
}

void Link::OnStatus(libusb_transfer* transfer) {
  Link& link = *static_cast<Link*>(transfer->user_data);
  const std::lock_guard lock(link.mutex_);
  Stream* stream = FindStream(link.status_, transfer);
  if (transfer->status == LIBUSB_TRANSFER_COMPLETED && transfer->actual_length > 0) {
    link.status_packets_.emplace_back(transfer->buffer, transfer->buffer + transfer->actual_length);
    if (link.status_packets_.size() > kMostStatus) link.status_packets_.pop_front();
  }
  // A stalled status endpoint stays silent; the controls themselves still answer.
  const bool healthy = transfer->status == LIBUSB_TRANSFER_COMPLETED || transfer->status == LIBUSB_TRANSFER_TIMED_OUT;
  link.Resubmit(*stream, link.want_status_ && healthy);
}

std::vector<std::vector<std::uint8_t>> Link::TakeStatus() {
  const std::lock_guard lock(mutex_);
  std::vector<std::vector<std::uint8_t>> packets(std::make_move_iterator(status_packets_.begin()),
                                                 std::make_move_iterator(status_packets_.end()));
  status_packets_.clear();
  return packets;
}

Result<std::unique_ptr<Stream>> Link::MakeStream(const StreamPipe& pipe) {
  auto stream = std::make_unique<Stream>();
  const int packets = pipe.isochronous ? kPacketsPerTransfer : 0;
  stream->buffer.resize(static_cast<std::size_t>(pipe.transfer_bytes) * (pipe.isochronous ? kPacketsPerTransfer : 1));
  stream->transfer.reset(libusb_alloc_transfer(packets));
  const auto size = static_cast<int>(stream->buffer.size());
  if (pipe.isochronous) {
    libusb_fill_iso_transfer(stream->transfer.get(), handle_, pipe.endpoint, stream->buffer.data(), size, packets,
                             OnStream, this, 0);
    libusb_set_iso_packet_lengths(stream->transfer.get(), pipe.transfer_bytes);
  } else {
    libusb_fill_bulk_transfer(stream->transfer.get(), handle_, pipe.endpoint, stream->buffer.data(), size, OnStream,
                              this, 0);
  }
  if (const int code = libusb_submit_transfer(stream->transfer.get()); code != 0) {
    return std::unexpected(ErrorFromUsb(code, "stream"));
  }
  stream->in_flight = true;
  return stream;
}

Result<void> Link::StartStream(const StreamPipe& pipe, PayloadSink& sink) {
  StopStream();
  if (pipe.isochronous) {
    const int code = libusb_set_interface_alt_setting(handle_, pipe.interface, pipe.alternate);
    if (code != 0) return std::unexpected(ErrorFromUsb(code, "stream"));
  } else {
    libusb_clear_halt(handle_, pipe.endpoint);
  }
  std::unique_lock lock(mutex_);
  pipe_ = pipe;
  sink_ = &sink;
  want_streams_ = true;
  const int count = pipe.isochronous ? kIsochronousTransfers : kBulkTransfers;
  for (int i = 0; i < count; ++i) {
    auto stream = MakeStream(pipe);
    if (!stream) {
      lock.unlock();
      StopStream();
      return PassOn(std::move(stream));
    }
    streams_.push_back(*std::move(stream));
  }
  return {};
}

void Link::Deliver(const libusb_transfer& transfer) {
  PayloadSink& sink = *sink_;
  if (transfer.num_iso_packets == 0) {
    if (transfer.status == LIBUSB_TRANSFER_COMPLETED) {
      sink.OnPayload({transfer.buffer, static_cast<std::size_t>(transfer.actual_length)});
    } else {
      sink.OnLoss();
    }
    return;
  }
  for (int i = 0; i < transfer.num_iso_packets; ++i) {
    const auto& packet = transfer.iso_packet_desc[i];
    const std::uint8_t* begin = transfer.buffer + static_cast<std::size_t>(i) * packet.length;
    if (packet.status != LIBUSB_TRANSFER_COMPLETED) {
      sink.OnLoss();
    } else if (packet.actual_length > 0) {
      sink.OnPayload({begin, packet.actual_length});
    }
  }
}

void Link::OnStream(libusb_transfer* transfer) {
  Link& link = *static_cast<Link*>(transfer->user_data);
  const bool over = transfer->status == LIBUSB_TRANSFER_CANCELLED || transfer->status == LIBUSB_TRANSFER_NO_DEVICE;
  // Not under the lock: StopStream() waits for this callback before the sink may go.
  if (!over) link.Deliver(*transfer);
  const std::lock_guard lock(link.mutex_);
  const bool stalled = transfer->status == LIBUSB_TRANSFER_STALL;
  link.Resubmit(*FindStream(link.streams_, transfer), link.want_streams_ && !over && !stalled);
}

/// Cancels, waits for every callback, frees.
void Link::CancelAll(std::vector<std::unique_ptr<Stream>>& streams, std::unique_lock<std::mutex>& lock) {
  for (auto& stream : streams) {
    if (stream->in_flight) libusb_cancel_transfer(stream->transfer.get());
  }
  changed_.wait(lock, [&] { return std::ranges::none_of(streams, &Stream::in_flight); });
  streams.clear();
}

void Link::StopStream() {
  std::unique_lock lock(mutex_);
  if (!std::exchange(want_streams_, false)) return;
  CancelAll(streams_, lock);
  sink_ = nullptr;
  lock.unlock();
  if (gone_) return;
  if (pipe_.isochronous) {
    libusb_set_interface_alt_setting(handle_, pipe_.interface, 0);
  } else {
    libusb_clear_halt(handle_, pipe_.endpoint);  // tells a bulk camera that nobody reads any more
  }
}

}  // namespace

Result<std::shared_ptr<Transport>> OpenLink(const LinkOptions& options) {
  auto link = std::make_shared<Link>(options);
  if (auto opened = link->Open(); !opened) return PassOn(std::move(opened));
  return std::shared_ptr<Transport>(std::move(link));
}

}  // namespace lensd::drivers::uvc
