// One call and its answers. It outlives the connection, so a handler may finish it whenever the answer is there.
#include "daemon/server/exchange.h"

#include "daemon/server/connection.h"

namespace lensd::daemon {

const varlink::Json& Exchange::parameters() const {
  if (!parameters_) parameters_ = call_.parameters.ToJson();
  return *parameters_;
}

std::size_t Exchange::unread() const {
  return connection_ == nullptr ? 0 : connection_->unread();
}

std::string Exchange::caller() const {
  return connection_ == nullptr ? "a client that is gone" : connection_->caller();
}

void Exchange::Continue(std::string_view parameters) {
  if (connection_ != nullptr && in_turn_) connection_->Send(varlink::EncodeReply(parameters, /*continues=*/true));
}

void Exchange::Continue(std::string_view parameters, Descriptor file) {
  if (connection_ == nullptr || !in_turn_) return;
  connection_->Send(varlink::EncodeReply(parameters, /*continues=*/true), std::move(file));
}

void Exchange::SendLast(std::string message) {
  if (auto ended = std::exchange(ended_, nullptr)) ended();
  if (!in_turn_) {
    if (connection_ != nullptr && !held_) held_ = std::move(message);
  } else if (Connection* connection = std::exchange(connection_, nullptr)) {
    connection->SendLast(message);
  }
}

void Exchange::Finish(std::string_view parameters) {
  SendLast(varlink::EncodeReply(parameters, /*continues=*/false));
}

void Exchange::Refuse(std::string_view error, varlink::Json parameters) {
  varlink::Reply reply;
  reply.error = error;
  reply.parameters = std::move(parameters);
  SendLast(varlink::EncodeReply(reply));
}

void Exchange::AtClose(std::uint64_t key, std::move_only_function<void()> closed) {
  if (connection_ != nullptr) connection_->AtClose(key, std::move(closed));
}

void Exchange::PeerGone() {
  connection_ = nullptr;
  if (auto gone = std::exchange(gone_, nullptr)) gone();
}

void Exchange::PeerDrained() {
  if (drained_) drained_();
}

}  // namespace lensd::daemon
