#include "exchange.h"

#include "connection.h"

namespace lensd::daemon {

const proto::Json& Exchange::parameters() const {
  if (!parameters_) parameters_ = call_.parameters.ToJson();
  return *parameters_;
}

void Exchange::Continue(std::string_view parameters) {
  if (connection_ != nullptr) connection_->Send(proto::EncodeReply(parameters, /*continues=*/true));
}

void Exchange::Finish(std::string_view parameters) {
  if (Connection* connection = std::exchange(connection_, nullptr)) {
    connection->SendLast(proto::EncodeReply(parameters, /*continues=*/false));
  }
}

void Exchange::Refuse(std::string_view error, proto::Json parameters) {
  if (Connection* connection = std::exchange(connection_, nullptr)) {
    proto::Reply reply;
    reply.error = error;
    reply.parameters = std::move(parameters);
    connection->SendLast(proto::EncodeReply(reply));
  }
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
