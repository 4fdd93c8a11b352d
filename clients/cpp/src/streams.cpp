// Replies as they come, events, and pictures put together out of them.
#include "streams.h"

#include <utility>

#include "pictures.h"

namespace lensd {
inline namespace v1 {

std::optional<Json> Stream::Impl::Taken(Message message) {
  if (!message.error.empty()) ThrowError(message);
  ended = !message.continues;
  deadline = Deadline(timeout);
  return std::move(message.parameters);
}

std::optional<Json> Stream::Impl::Ended() {
  ended = true;
  if (!cancelled) throw;
  return std::nullopt;
}

std::optional<Json> Stream::Impl::Next() {
  if (ended || cancelled) return std::nullopt;
  try {
    deadline = Deadline(timeout);
    return Taken(connection.Receive(deadline));
  } catch (const LensdError&) {
    return Ended();
  }
}

std::optional<Json> Stream::Impl::Process() {
  if (ended || cancelled) return std::nullopt;
  try {
    if (auto message = connection.Process()) return Taken(*std::move(message));
    deadline.Left();
    return std::nullopt;
  } catch (const LensdError&) {
    return Ended();
  }
}

Milliseconds Stream::Impl::Left() const {
  if (timeout.count() <= 0) return Milliseconds{-1};
  try {
    return Milliseconds(deadline.Left());
  } catch (const LensdError&) {
    return Milliseconds{0};
  }
}

Stream Access::Wrap(std::unique_ptr<Access::StreamImpl> stream) {
  return Stream(std::move(stream));
}
Access::StreamImpl& Access::Of(Stream& stream) {
  return *stream.impl_;
}

namespace {

std::optional<std::string> Text(const std::optional<Json>& reply) {
  if (!reply) return std::nullopt;
  return reply->dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::optional<Event> EventOf(std::optional<Json> reply) {
  if (!reply) return std::nullopt;
  MonitorReply told;
  Access::Put(told, Access::Own(*std::move(reply)));
  return told.event();
}

}  // namespace

Stream::Stream(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Stream::Stream(Stream&&) noexcept = default;
Stream& Stream::operator=(Stream&&) noexcept = default;
Stream::~Stream() = default;

std::optional<std::string> Stream::Next() {
  return Text(impl_->Next());
}
std::optional<std::string> Stream::Process() {
  return Text(impl_->Process());
}
int Stream::fd() const {
  return impl_->connection.fd();
}
Milliseconds Stream::left() const {
  return impl_->Left();
}
bool Stream::ended() const {
  return impl_->ended || impl_->cancelled;
}
void Stream::Cancel() {
  impl_->cancelled = true;
  impl_->connection.Shut();
}

Monitor::Monitor(Stream stream) : stream_(std::move(stream)) {}
Monitor::Monitor(Monitor&&) noexcept = default;
Monitor& Monitor::operator=(Monitor&&) noexcept = default;
Monitor::~Monitor() = default;

std::optional<Event> Monitor::Next() {
  return EventOf(Access::Of(stream_).Next());
}
std::optional<Event> Monitor::Process() {
  return EventOf(Access::Of(stream_).Process());
}
int Monitor::fd() const {
  return stream_.fd();
}
bool Monitor::ended() const {
  return stream_.ended();
}
void Monitor::Cancel() {
  stream_.Cancel();
}

}  // namespace v1
}  // namespace lensd
