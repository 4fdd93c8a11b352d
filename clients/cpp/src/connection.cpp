// A Unix socket that never blocks; every wait is a poll() with a deadline.
#include "connection.h"

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <iterator>
#include <string_view>
#include <thread>
#include <utility>

#include "tables.h"

namespace lensd {
inline namespace v1 {
namespace {

constexpr int kFiles = 16;
constexpr std::size_t kChunkBytes = std::size_t{256} * 1024;
constexpr Milliseconds kAgain{10};

std::string Reason(int error) {
  return std::strerror(error);
}

[[noreturn]] void ThrowRefused(const std::string& path, int error) {
  if (error == EACCES || error == EPERM) {
    throw LensdError("SocketRefused", "you may not use the socket " + path + "; ask for membership of its group");
  }
  throw LensdError("Unavailable", "no lensd answers at " + path + ": " + Reason(error) +
                                      "; start it, or name its socket (in the constructor or LENSD_SOCKET)");
}

/// The message of an error of Varlink itself, which has none of its own.
std::string MessageOf(const std::string& name, const Json& told) {
  const auto text = [&](const char* field) {
    const auto found = told.find(field);
    return found != told.end() && found->is_string() ? found->get<std::string>() : std::string("?");
  };
  if (told.contains("message") && told["message"].is_string()) return told["message"].get<std::string>();
  if (name == "InvalidParameter") {
    return "the parameter '" + text("parameter") +
           "' is missing, unknown or of the wrong kind; docs/interface.md has those of every method";
  }
  if (name == "ExpectedMore") return "this call answers several times: Begin() it with Replies::More";
  if (name == "InterfaceNotFound") return "this lensd has no interface '" + text("interface") + "'";
  if (name == "MethodNotFound" || name == "MethodNotImplemented") {
    return "this lensd has no method '" + text("method") + "': it is older than this library";
  }
  return "lensd answered " + name + " " + told.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Message Parsed(std::string_view text) {
  const Json json = Json::parse(text, nullptr, false);
  Message message;
  if (json.is_object()) {
    message.parameters = json.value("parameters", Json::object());
    const Json error = json.value("error", Json());
    const Json continues = json.value("continues", Json(false));
    if (message.parameters.is_null()) message.parameters = Json::object();
    if (error.is_string()) message.error = error.get<std::string>();
    if (message.parameters.is_object() && (error.is_string() || error.is_null()) && continues.is_boolean()) {
      message.continues = continues.get<bool>();
      return message;
    }
  }
  throw LensdError("BrokenReply", "what came is no Varlink reply; is it lensd that listens there?");
}

}  // namespace

Deadline::Deadline(Milliseconds timeout) : timeout_(timeout) {
  if (timeout.count() > 0) end_ = std::chrono::steady_clock::now() + timeout;
}

int Deadline::Left() const {
  if (!end_) return -1;
  const auto left = std::chrono::ceil<Milliseconds>(*end_ - std::chrono::steady_clock::now()).count();
  if (left <= 0) ThrowPassed();
  return static_cast<int>(std::min<long long>(left, 1'000'000'000));
}

void Deadline::ThrowPassed() const {
  throw LensdError("DeadlinePassed", "lensd did not answer within " + std::to_string(timeout_.count()) +
                                         " ms; the connection is closed, and a plain move goes on: Stop() ends it");
}

Connection Connection::Open(const std::string& path, const Deadline& deadline) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof(address.sun_path)) ThrowRefused(path, ENAMETOOLONG);
  path.copy(address.sun_path, path.size());
  const bool abstract = path[0] == '@';
  if (abstract) address.sun_path[0] = 0;
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + path.size() + (abstract ? 0 : 1));
  Connection connection(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (connection.socket_ < 0) throw LensdError("SocketFailed", "no socket to be had: " + Reason(errno));
  while (connect(connection.socket_, reinterpret_cast<const sockaddr*>(&address), size) != 0) {
    if (errno != EAGAIN && errno != EINTR) ThrowRefused(path, errno);
    deadline.Left();
    std::this_thread::sleep_for(kAgain);  // lensd's queue is full
  }
  return connection;
}

Connection::Connection(Connection&& other) noexcept
    : socket_(std::exchange(other.socket_, -1)),
      buffer_(std::move(other.buffer_)),
      start_(other.start_),
      scanned_(other.scanned_),
      files_(std::exchange(other.files_, {})) {}

Connection& Connection::operator=(Connection&& other) noexcept {
  std::swap(socket_, other.socket_);
  std::swap(buffer_, other.buffer_);
  std::swap(start_, other.start_);
  std::swap(scanned_, other.scanned_);
  std::swap(files_, other.files_);
  return *this;
}

Connection::~Connection() {
  for (const int file : files_) close(file);
  if (socket_ >= 0) close(socket_);
}

void Connection::WaitFor(short events, const Deadline& deadline) const {
  pollfd wait{socket_, events, 0};
  for (;;) {
    const int ready = poll(&wait, 1, deadline.Left());
    if (ready > 0) return;
    if (ready == 0) deadline.ThrowPassed();
    if (errno != EINTR) throw LensdError("SocketFailed", "poll: " + Reason(errno));
  }
}

void Connection::Send(const std::string& method, Json parameters, Client::Replies replies, const Deadline& deadline) {
  Json call{{"method", method}};
  if (!parameters.empty()) call["parameters"] = std::move(parameters);
  if (replies == Client::Replies::More) call["more"] = true;
  std::string bytes;
  try {
    bytes = call.dump() + '\0';
  } catch (const Json::exception&) {
    throw LensdError("BadText", "a text in the call is not UTF-8");
  }
  std::size_t sent = 0;
  while (sent < bytes.size()) {
    const ssize_t count = send(socket_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
    if (count >= 0) {
      sent += static_cast<std::size_t>(count);
    } else if (errno == EAGAIN) {
      WaitFor(POLLOUT, deadline);
    } else if (errno == EPIPE) {
      return;  // refused at the door: the reason may be waiting to be received
    } else if (errno != EINTR) {
      throw LensdError("SocketFailed", "lensd cannot be written to: " + Reason(errno));
    }
  }
}

/// Takes what has come with its files; false: nothing has.
bool Connection::Read() {
  std::array<char, CMSG_SPACE(sizeof(int) * kFiles)> control{};
  const std::size_t held = buffer_.size();
  buffer_.resize(held + kChunkBytes);
  iovec bytes{buffer_.data() + held, kChunkBytes};
  msghdr message{};
  message.msg_iov = &bytes;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  const ssize_t count = recvmsg(socket_, &message, MSG_DONTWAIT | MSG_CMSG_CLOEXEC);
  const int error = errno;
  buffer_.resize(held + static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
  if (count < 0 && (error == EAGAIN || error == EINTR)) return false;
  if (count < 0) throw LensdError("SocketFailed", "lensd cannot be read from: " + Reason(error));
  for (cmsghdr* part = CMSG_FIRSTHDR(&message); part != nullptr; part = CMSG_NXTHDR(&message, part)) {
    if (part->cmsg_level != SOL_SOCKET || part->cmsg_type != SCM_RIGHTS) continue;
    for (std::size_t at = 0; at < (part->cmsg_len - CMSG_LEN(0)) / sizeof(int); ++at) {
      int file = -1;
      std::memcpy(&file, CMSG_DATA(part) + at * sizeof(int), sizeof file);
      files_.push_back(file);
    }
  }
  if (count == 0) {
    throw LensdError("Unavailable", "lensd closed the connection without an answer; it has ended or was killed");
  }
  return true;
}

std::optional<Message> Connection::Next() {
  const auto end = buffer_.find('\0', scanned_);
  if (end == std::string::npos) {
    scanned_ = buffer_.size();
    return std::nullopt;
  }
  Message message = Parsed(std::string_view(buffer_).substr(start_, end - start_));
  start_ = scanned_ = end + 1;
  if (start_ == buffer_.size()) {
    buffer_.clear();
    start_ = scanned_ = 0;
  }
  return message;
}

std::optional<Message> Connection::Process() {
  auto message = Next();
  if (!message && start_ > 0) {  // what was handed out makes room
    buffer_.erase(0, start_);
    scanned_ -= start_;
    start_ = 0;
  }
  while (!message && Read()) message = Next();
  return message;
}

Message Connection::Receive(const Deadline& deadline) {
  for (;;) {
    if (auto message = Process()) return *std::move(message);
    WaitFor(POLLIN, deadline);
  }
}

int Connection::TakeFile() {
  if (files_.empty()) throw LensdError("BrokenReply", "a reply names a file, and none came with it");
  const int file = files_.front();
  files_.pop_front();
  return file;
}

bool Connection::IsStale() const {
  char byte = 0;
  return recv(socket_, &byte, 1, MSG_PEEK | MSG_DONTWAIT) >= 0 || errno != EAGAIN;
}

void Connection::Shut() const {
  shutdown(socket_, SHUT_RDWR);
}

void ThrowError(const Message& message) {
  const auto* row = std::find_if(std::begin(kErrorsOfLensd), std::end(kErrorsOfLensd),
                                 [&](const ErrorRow& known) { return message.error == known.wire; });
  const std::string name = row != std::end(kErrorsOfLensd) ? row->name : "UnknownError";
  const std::string shown = name == "UnknownError" ? message.error : name;
  Json fields = message.parameters;
  const std::string text = MessageOf(shown, fields);
  fields.erase("message");
  throw LensdError(name, text, fields.dump(-1, ' ', false, Json::error_handler_t::replace));
}

std::string SocketPath(const std::string& address) {
  constexpr std::string_view kPrefix = "unix:";
  const char* const told = std::getenv("LENSD_SOCKET");
  std::string path = !address.empty() ? address : told != nullptr && *told != 0 ? told : "/run/lensd/io.lensd.Lens";
  if (path.compare(0, kPrefix.size(), kPrefix) == 0)
    path = path.substr(kPrefix.size(), path.find(';') - kPrefix.size());
  return path;
}

}  // namespace v1
}  // namespace lensd
