// One request and its answer, whole or as a stream. What answers it never waits: it replies when it can.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "loop/web_event_loop.h"

struct MHD_Connection;
struct MHD_Response;

namespace lensd::web {

struct Answer {
  int status = 200;
  std::string type = "application/json";
  std::string body{};
  std::vector<std::pair<std::string, std::string>> headers{};
};

/// An answer that is an error of lens-web's own, written as those of lensd are: {"error", "parameters": {"message"}}.
Answer Refusal(int status, std::string_view error, std::string_view message);

/// A body that comes piece by piece.
class Stream {
 public:
  virtual ~Stream() = default;
  /// Up to `size` bytes to `to`. 0: none for now, until Exchange::Wake(). None: it has ended.
  virtual std::optional<std::size_t> Read(char* to, std::size_t size) = 0;
};

/// What an exchange needs of the server it belongs to.
struct ServerFloor {
  EventLoop& loop;
  std::function<void()> turn;  ///< lets libmicrohttpd look after connections that have woken, soon
};

/// Belongs to the HTTP server; gone with its client. Event loop thread only.
class Exchange {
 public:
  Exchange(const ServerFloor& floor, MHD_Connection* connection, std::string method, std::string path);
  ~Exchange();
  Exchange(const Exchange&) = delete;
  Exchange& operator=(const Exchange&) = delete;

  const std::string& method() const { return method_; }
  const std::string& path() const { return path_; }
  const std::string& body() const { return body_; }
  /// Of the request; empty where there is none.
  std::string_view Header(const char* name) const;
  std::string_view Query(const char* name) const;
  std::string_view Cookie(const char* name) const;

  /// The answer: once, now or later. Never destroys the exchange.
  void Reply(const Answer& answer);
  void Reply(const char* type, std::unique_ptr<Stream> stream);
  bool replied() const { return response_ != nullptr; }
  /// The stream has more, or has ended.
  void Wake();
  /// Held until the client is gone or has its answer: what works at it, and what that takes.
  void Hold(std::shared_ptr<void> work) { work_.push_back(std::move(work)); }

  // For the server.
  /// Takes a piece of the body. False: it is too long.
  bool Take(std::string_view piece);
  /// Sends the answer, or sleeps until there is one. False: the connection cannot go on.
  bool Go();

 private:
  static ssize_t ReadStream(void* self, std::uint64_t position, char* to, std::size_t size);
  void Sleep();
  void Gone();
  void Answered(int status, MHD_Response* response);

  const ServerFloor& floor_;
  MHD_Connection* const connection_;
  const std::string method_, path_;
  std::string body_;
  std::vector<std::shared_ptr<void>> work_;
  std::unique_ptr<Stream> stream_;
  MHD_Response* response_ = nullptr;
  int status_ = 0;
  bool gone_ = false, asleep_ = false;
  Watch hangup_;  // while it sleeps
};

}  // namespace lensd::web
