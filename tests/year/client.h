// A client of lensd: a socket, and the calls that wait for their answers.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <string>
#include <string_view>

#include "machine.h"
#include "varlink/frame.h"
#include "varlink/json.h"

namespace lensd::year {

using varlink::Json;

/// What a call was, and what held when it was made.
struct Call {
  std::string method;
  Json parameters = Json::object();
  bool more = false;
  bool oneway = false;
  std::int64_t at = 0;
  std::uint64_t drives = 0;    ///< calls that drive its lens, up to this one
  bool behind = false;         ///< an earlier call of its connection, whose answer goes first
  bool alone = false;          ///< no other call drove its lens
  bool lease_settled = false;  ///< nobody was about to change the lens' lease

  std::string lens() const { return parameters.value("lens", ""); }
};

enum class Role { Observer, Mover, Administrator };

class Client {
 public:
  /// Told of every reply. `last`: the call has no more of them.
  using Answered = std::function<void(Client&, const Call&, const Json& reply, bool last)>;

  Client(std::uint64_t number, Role role, Answered answered)
      : number_(number), role_(role), answered_(std::move(answered)) {}

  bool connected() const { return socket_ >= 0; }
  int socket() const { return socket_; }
  /// To lensd at this abstract address, and adds its socket to the epoll set.
  void Connect(const std::string& address, int epoll);
  void Send(const Call& call) { Send(call, call.parameters); }
  /// The same with other parameters than it knows of.
  void Send(const Call& call, const Json& parameters);
  /// What has come. False: lensd has closed the connection.
  bool Read();
  /// Calls without their last answer: nobody will tell any more.
  std::deque<Call> Close();
  const std::deque<Call>& waiting() const { return waiting_; }
  std::uint64_t number() const { return number_; }
  /// Which of its connections this is.
  std::uint64_t connection() const { return connection_; }
  Role role() const { return role_; }

 private:
  void Take(std::string_view message);

  const std::uint64_t number_;
  const Role role_;
  const Answered answered_;
  int socket_ = -1;
  std::uint64_t connection_ = 0;
  varlink::FrameReader frames_{varlink::kMaxReplyBytes};
  std::deque<Call> waiting_;
};

}  // namespace lensd::year
