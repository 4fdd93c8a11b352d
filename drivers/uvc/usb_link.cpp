// libusb as UVC needs it: asynchronous transfers, one event thread, a private context. After NO_DEVICE everything is
// cancelled and waited for before the handle closes.
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

#include "drivers/api/thread_barrier.h"
#include "drivers/hotplug/waking.h"
#include "usb_errors.h"

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

/// One transfer that is submitted again as long as it is wanted. Its own memory, freed when its last callback is over.
struct Stream {
  TransferPtr transfer;
  std::vector<std::uint8_t> buffer;
  bool in_flight = false;
};

class UsbLink final : public Transport {
 public:
  explicit UsbLink(LinkOptions options) : options_(std::move(options)) {}
  ~UsbLink() override;

  Result<void> Open();

  Reply Control(const Setup& setup, std::span<const std::uint8_t> out, Duration timeout) override;
  void WaitUntil(Instant until) override;
  std::vector<std::vector<std::uint8_t>> TakeStatus() override;
  Result<void> StartStream(const StreamPipe& pipe, PayloadSink& sink) override;
  void StopStream() override;
  bool Gone() const override { return gone_; }
  void CheckThread() const override { barrier_.Check(); }
  void BeginCall() override;
  void Interrupt() override;

 private:
  struct ControlCall {
    UsbLink* link;
    bool done = false;
    libusb_transfer_status status = LIBUSB_TRANSFER_ERROR;
    int length = 0;
  };

  struct Usb {
    int fd = -1;
    libusb_context* context = nullptr;
    libusb_device_handle* handle = nullptr;
    std::vector<std::uint8_t> claimed;
  };
  struct Status {
    std::vector<std::unique_ptr<Stream>> transfers;
    bool wanted = false;
    std::deque<std::vector<std::uint8_t>> packets;
  };
  struct Pictures {
    std::vector<std::unique_ptr<Stream>> transfers;
    bool wanted = false;
    std::atomic<PayloadSink*> sink = nullptr;
    StreamPipe pipe;
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
  Usb usb_;
  std::jthread events_;
  std::atomic<bool> stop_events_ = false;
  std::atomic<bool> gone_ = false;

  std::mutex mutex_;  ///< of everything below; held by callbacks too, never while libusb may call back
  std::condition_variable changed_;
  bool interrupted_ = false;
  libusb_transfer* control_ = nullptr;  ///< under way
  Status status_;
  Pictures pictures_;
  ThreadBarrier barrier_;  ///< libusb's frames lie between the callbacks and their thread
};

Result<void> UsbLink::Open() {
  usb_.fd = hotplug::OpenInTurn([this] { return ::open(options_.node.c_str(), O_RDWR | O_CLOEXEC); });
  if (usb_.fd < 0) {
    const int error = errno;
    const std::string what = options_.node + ": " + std::strerror(error);
    if (error == EACCES || error == EPERM) return Fail(Code::Io, what + ": see the udev rules in docs/drivers/uvc.md");
    return Fail(Code::Disconnected, what);
  }
  return Connect();
}

Result<void> UsbLink::Connect() {
  // Not told to leave discovery out (LIBUSB_OPTION_NO_DEVICE_DISCOVERY), although the node is known: before 1.0.27 that
  // holds for every context of the process, and other libraries look for their cameras through libusb.
  if (const int code = libusb_init(&usb_.context); code != 0) return PassOn(ErrorFromUsb(code, "libusb"));
  if (const int code = libusb_wrap_sys_device(usb_.context, usb_.fd, &usb_.handle); code != 0) {
    return PassOn(ErrorFromUsb(code, options_.node));
  }
  events_ = std::jthread([this] {
    while (!stop_events_) {
      timeval second{1, 0};
      libusb_handle_events_timeout_completed(usb_.context, &second, nullptr);
    }
  });
  libusb_set_auto_detach_kernel_driver(usb_.handle, 1);
  for (const std::uint8_t interface : options_.interfaces) {
    if (const int code = libusb_claim_interface(usb_.handle, interface); code != 0) {
      return PassOn(ErrorFromUsb(code, "interface " + std::to_string(interface) + " of " + options_.node));
    }
    usb_.claimed.push_back(interface);
  }
  StartStatus();
  return {};
}

UsbLink::~UsbLink() {
  StopStream();
  if (usb_.handle != nullptr) {
    std::unique_lock lock(mutex_);
    status_.wanted = false;
    CancelAll(status_.transfers, lock);
    lock.unlock();
    // Streaming first, control last: the kernel's driver binds to the control interface and takes the others along.
    for (auto interface = usb_.claimed.rbegin(); interface != usb_.claimed.rend(); ++interface) {
      libusb_release_interface(usb_.handle, *interface);
    }
    stop_events_ = true;
    libusb_interrupt_event_handler(usb_.context);
    events_.join();
    libusb_close(usb_.handle);
  }
  if (usb_.context != nullptr) libusb_exit(usb_.context);
  if (usb_.fd >= 0) ::close(usb_.fd);
}

void UsbLink::BeginCall() {
  const std::lock_guard lock(mutex_);
  interrupted_ = false;
}

void UsbLink::Interrupt() {
  const std::lock_guard lock(mutex_);
  interrupted_ = true;
  if (control_ != nullptr) libusb_cancel_transfer(control_);
  changed_.notify_all();
}

void UsbLink::WaitUntil(Instant until) {
  std::unique_lock lock(mutex_);
  changed_.wait_until(lock, until, [this] { return interrupted_; });
}

void UsbLink::OnControl(libusb_transfer* transfer) {
  auto& call = *static_cast<ControlCall*>(transfer->user_data);
  UsbLink& link = *call.link;
  const std::lock_guard lock(link.mutex_);
  call.status = transfer->status;
  call.length = transfer->actual_length;
  call.done = true;
  link.control_ = nullptr;
  if (transfer->status == LIBUSB_TRANSFER_NO_DEVICE) link.gone_ = true;
  link.changed_.notify_all();
}

Reply UsbLink::Control(const Setup& setup, std::span<const std::uint8_t> out, Duration timeout) {
  using Outcome = Reply::Outcome;
  std::vector<std::uint8_t> buffer(LIBUSB_CONTROL_SETUP_SIZE + setup.length);
  libusb_fill_control_setup(buffer.data(), setup.request_type, setup.request, setup.value, setup.index, setup.length);
  std::ranges::copy(out, buffer.begin() + LIBUSB_CONTROL_SETUP_SIZE);
  const TransferPtr transfer(libusb_alloc_transfer(0));
  ControlCall call{this};
  const auto ms = std::chrono::ceil<std::chrono::milliseconds>(timeout);
  libusb_fill_control_transfer(transfer.get(), usb_.handle, buffer.data(), OnControl, &call,
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

Stream* UsbLink::FindStream(std::vector<std::unique_ptr<Stream>>& streams, const libusb_transfer* transfer) {
  for (auto& stream : streams) {
    if (stream->transfer.get() == transfer) return stream.get();
  }
  return nullptr;
}

/// Call with the lock held.
void UsbLink::Resubmit(Stream& stream, bool wanted) {
  stream.in_flight = false;
  if (stream.transfer->status == LIBUSB_TRANSFER_NO_DEVICE) gone_ = true;
  if (wanted && !gone_) {
    const int code = libusb_submit_transfer(stream.transfer.get());
    stream.in_flight = code == 0;
    if (code == LIBUSB_ERROR_NO_DEVICE) gone_ = true;
  }
  changed_.notify_all();
}

void UsbLink::StartStatus() {
  if (options_.status_endpoint == 0) return;
  auto stream = std::make_unique<Stream>();
  stream->buffer.resize(std::max<std::size_t>(options_.status_bytes, 16));
  stream->transfer.reset(libusb_alloc_transfer(0));
  libusb_fill_interrupt_transfer(stream->transfer.get(), usb_.handle, options_.status_endpoint, stream->buffer.data(),
                                 static_cast<int>(stream->buffer.size()), OnStatus, this, 0);
  const std::lock_guard lock(mutex_);
  status_.wanted = true;
  stream->in_flight = libusb_submit_transfer(stream->transfer.get()) == 0;
  status_.transfers.push_back(std::move(stream));
}

void UsbLink::OnStatus(libusb_transfer* transfer) {
  UsbLink& link = *static_cast<UsbLink*>(transfer->user_data);
  const std::lock_guard lock(link.mutex_);
  Stream* stream = FindStream(link.status_.transfers, transfer);
  if (transfer->status == LIBUSB_TRANSFER_COMPLETED && transfer->actual_length > 0) {
    link.barrier_.Run([&] {
      link.status_.packets.emplace_back(transfer->buffer, transfer->buffer + transfer->actual_length);
      if (link.status_.packets.size() > kMostStatus) link.status_.packets.pop_front();
    });
  }
  // A stalled status endpoint stays silent; the controls themselves still answer.
  const bool healthy = transfer->status == LIBUSB_TRANSFER_COMPLETED || transfer->status == LIBUSB_TRANSFER_TIMED_OUT;
  link.Resubmit(*stream, link.status_.wanted && healthy);
}

std::vector<std::vector<std::uint8_t>> UsbLink::TakeStatus() {
  const std::lock_guard lock(mutex_);
  std::vector<std::vector<std::uint8_t>> packets(std::make_move_iterator(status_.packets.begin()),
                                                 std::make_move_iterator(status_.packets.end()));
  status_.packets.clear();
  return packets;
}

Result<std::unique_ptr<Stream>> UsbLink::MakeStream(const StreamPipe& pipe) {
  auto stream = std::make_unique<Stream>();
  const int packets = pipe.isochronous ? kPacketsPerTransfer : 0;
  stream->buffer.resize(static_cast<std::size_t>(pipe.transfer_bytes) * (pipe.isochronous ? kPacketsPerTransfer : 1));
  stream->transfer.reset(libusb_alloc_transfer(packets));
  const auto size = static_cast<int>(stream->buffer.size());
  if (pipe.isochronous) {
    libusb_fill_iso_transfer(stream->transfer.get(), usb_.handle, pipe.endpoint, stream->buffer.data(), size, packets,
                             OnStream, this, 0);
    libusb_set_iso_packet_lengths(stream->transfer.get(), pipe.transfer_bytes);
  } else {
    libusb_fill_bulk_transfer(stream->transfer.get(), usb_.handle, pipe.endpoint, stream->buffer.data(), size, OnStream,
                              this, 0);
  }
  if (const int code = libusb_submit_transfer(stream->transfer.get()); code != 0) {
    return PassOn(ErrorFromUsb(code, "stream"));
  }
  stream->in_flight = true;
  return stream;
}

Result<void> UsbLink::StartStream(const StreamPipe& pipe, PayloadSink& sink) {
  StopStream();
  if (pipe.isochronous) {
    const int code = libusb_set_interface_alt_setting(usb_.handle, pipe.interface, pipe.alternate);
    if (code != 0) return PassOn(ErrorFromUsb(code, "stream"));
  } else {
    libusb_clear_halt(usb_.handle, pipe.endpoint);
  }
  std::unique_lock lock(mutex_);
  pictures_.pipe = pipe;
  pictures_.sink = &sink;
  pictures_.wanted = true;
  const int count = pipe.isochronous ? kIsochronousTransfers : kBulkTransfers;
  for (int i = 0; i < count; ++i) {
    auto stream = MakeStream(pipe);
    if (!stream) {
      lock.unlock();
      StopStream();
      return PassOn(stream);
    }
    pictures_.transfers.push_back(*std::move(stream));
  }
  return {};
}

void UsbLink::Deliver(const libusb_transfer& transfer) {
  PayloadSink& sink = *pictures_.sink;
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

void UsbLink::OnStream(libusb_transfer* transfer) {
  UsbLink& link = *static_cast<UsbLink*>(transfer->user_data);
  const bool over = transfer->status == LIBUSB_TRANSFER_CANCELLED || transfer->status == LIBUSB_TRANSFER_NO_DEVICE;
  // Not under the lock: StopStream() waits for this callback before the sink may go.
  if (!over) link.barrier_.Run([&] { link.Deliver(*transfer); });
  const std::lock_guard lock(link.mutex_);
  const bool stalled = transfer->status == LIBUSB_TRANSFER_STALL;
  link.Resubmit(*FindStream(link.pictures_.transfers, transfer), link.pictures_.wanted && !over && !stalled);
}

/// Cancels, waits for every callback, frees.
void UsbLink::CancelAll(std::vector<std::unique_ptr<Stream>>& streams, std::unique_lock<std::mutex>& lock) {
  for (auto& stream : streams) {
    if (stream->in_flight) libusb_cancel_transfer(stream->transfer.get());
  }
  changed_.wait(lock, [&] { return std::ranges::none_of(streams, &Stream::in_flight); });
  streams.clear();
}

void UsbLink::StopStream() {
  std::unique_lock lock(mutex_);
  if (!std::exchange(pictures_.wanted, false)) return;
  CancelAll(pictures_.transfers, lock);
  pictures_.sink = nullptr;
  lock.unlock();
  if (gone_) return;
  if (pictures_.pipe.isochronous) {
    libusb_set_interface_alt_setting(usb_.handle, pictures_.pipe.interface, 0);
  } else {
    libusb_clear_halt(usb_.handle, pictures_.pipe.endpoint);  // tells a bulk camera that we read no more
  }
}

}  // namespace

Result<std::shared_ptr<Transport>> OpenLink(const LinkOptions& options) {
  auto link = std::make_shared<UsbLink>(options);
  if (auto opened = link->Open(); !opened) return PassOn(opened);
  return std::shared_ptr<Transport>(std::move(link));
}

}  // namespace lensd::drivers::uvc
