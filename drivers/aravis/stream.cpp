// Buffers from Aravis' stream thread into a mailbox of one frame, newest wins; what was lost or incomplete is counted.
#include "stream.h"

#include <arv.h>

#include <utility>

namespace lensd::drivers::aravis {
namespace {

/// The system time stamp of a buffer is on the wall clock; both clocks read now tell where it lies on ours.
Instant ArrivalOf(ArvBuffer* buffer) {
  const auto now = std::chrono::steady_clock::now();
  const std::int64_t wall_ns = g_get_real_time() * 1000;
  const auto age = Duration(wall_ns - static_cast<std::int64_t>(arv_buffer_get_system_timestamp(buffer)));
  // A wall clock that was set meanwhile tells nothing.
  constexpr Duration kCredible = std::chrono::seconds(2);
  return age < Duration::zero() || age > kCredible ? now : now - age;
}

}  // namespace

// ---- the mailbox --------------------------------------------------------------------------------------------------

std::optional<RawFrame> Mailbox::Take() {
  barrier_.Check();
  const std::lock_guard lock(mutex_);
  return std::exchange(newest_, std::nullopt);
}

/// Frame numbers go up by one; those of GigE Vision 1 have 16 bits and leave out 0. What is missing between was lost.
void Mailbox::Advance(std::uint64_t frame_id) {
  constexpr std::uint64_t kLast = 0xffff;
  std::uint64_t step = 1;
  if (last_id_) {
    if (frame_id > *last_id_) {
      step = frame_id - *last_id_;
    } else if (*last_id_ <= kLast && frame_id < *last_id_) {
      step = kLast - *last_id_ + frame_id;
      if (step == 0) step = 1;
    }
    if (step > kLast / 2) step = 1;  // not a gap: the camera began to count anew
  }
  last_id_ = frame_id;
  sequence_ += step;
}

Handle<ArvBuffer> Mailbox::Put(RawFrame frame, std::uint64_t frame_id) {
  const std::lock_guard lock(mutex_);
  Advance(frame_id);
  counter_.Came(sequence_, frame.arrival);
  frame.sequence = sequence_;
  auto replaced = std::exchange(newest_, std::move(frame));
  return replaced ? std::move(replaced->buffer) : nullptr;
}

void Mailbox::NoteIncomplete(std::uint64_t frame_id) {
  const std::lock_guard lock(mutex_);
  Advance(frame_id);
}

void Mailbox::Begin() {
  const std::lock_guard lock(mutex_);
  newest_.reset();
  last_id_.reset();
  counter_.Restart();
}

void Mailbox::Clear() {
  const std::lock_guard lock(mutex_);
  newest_.reset();
}

// ---- the stream ---------------------------------------------------------------------------------------------------

Result<std::shared_ptr<Stream>> Stream::Start(ArvCamera* camera, const CameraConfig& config,
                                              std::shared_ptr<Mailbox> mailbox) {
  std::shared_ptr<Stream> stream(new Stream(std::move(mailbox)));
  CallError error;
  const auto callback =
      +[](void* self, ArvStreamCallbackType type, ArvBuffer* buffer) { Callback(self, type, buffer); };
  stream->stream_.reset(arv_camera_create_stream(camera, callback, stream.get(), error.out()));
  if (error) return error.Why("opening the stream");
  if (!stream->stream_) return Fail(Code::Protocol, "the camera offers no stream");
  ArvStream* raw = stream->stream_.get();
  if (ARV_IS_GV_STREAM(raw)) {
    g_object_set(raw, "packet-resend",
                 config.resend ? ARV_GV_STREAM_PACKET_RESEND_ALWAYS : ARV_GV_STREAM_PACKET_RESEND_NEVER, nullptr);
  }
  CallError payload_error;
  const guint payload = arv_camera_get_payload(camera, payload_error.out());
  if (payload_error) return payload_error.Why("asking for the size of a frame");
  for (int i = 0; i < config.buffers; ++i) arv_stream_push_buffer(raw, arv_buffer_new_allocate(payload));
  stream->mailbox_->Begin();
  stream->running_ = raw;
  CallError start_error;
  arv_camera_start_acquisition(camera, start_error.out());
  if (start_error) return start_error.Why("starting acquisition");
  return stream;
}

Stream::~Stream() {
  running_ = nullptr;
  stream_.reset();  // ends Aravis' thread
  mailbox_->Clear();
}

Result<void> Stream::Stop(ArvCamera* camera) {
  Count();
  CallError error;
  arv_camera_stop_acquisition(camera, error.out());
  return error.Check("stopping acquisition");
}

void Stream::Count() {
  if (!ARV_IS_GV_STREAM(stream_.get())) return;
  guint64 resent = 0, missing = 0;
  arv_gv_stream_get_statistics(ARV_GV_STREAM(stream_.get()), &resent, &missing);
  mailbox_->counter_.CountPackets(missing - std::exchange(missing_, missing), resent - std::exchange(resent_, resent));
}

void Stream::Return(Handle<ArvBuffer> buffer) {
  if (!buffer) return;
  if (ArvStream* raw = running_.load()) arv_stream_push_buffer(raw, buffer.release());
}

/// On Aravis' thread, whose frames nothing may be thrown through.
void Stream::Callback(void* self, int type, ArvBuffer*) {
  if (type != ARV_STREAM_CALLBACK_TYPE_BUFFER_DONE) return;
  auto& stream = *static_cast<Stream*>(self);
  stream.mailbox_->barrier_.Run([&] { stream.Done(); });
}

void Stream::Done() {
  ArvStream* raw = running_.load();
  if (raw == nullptr) return;
  while (Handle<ArvBuffer> buffer{arv_stream_try_pop_buffer(raw)}) {
    const std::uint64_t id = arv_buffer_get_frame_id(buffer.get());
    if (arv_buffer_get_status(buffer.get()) != ARV_BUFFER_STATUS_SUCCESS) {
      mailbox_->NoteIncomplete(id);
      arv_stream_push_buffer(raw, buffer.release());
      continue;
    }
    RawFrame frame;
    frame.device_ns = arv_buffer_get_timestamp(buffer.get());
    frame.arrival = ArrivalOf(buffer.get());
    frame.buffer = std::move(buffer);
    if (auto replaced = mailbox_->Put(std::move(frame), id)) arv_stream_push_buffer(raw, replaced.release());
  }
}

}  // namespace lensd::drivers::aravis
