// While an exchange waits libmicrohttpd is told to forget its connection, and the event loop watches for the client's
// end: a viewer that has gone is noticed at once, not at the next picture.
#include "web/exchange.h"

#include <microhttpd.h>
#include <sys/epoll.h>

#include <array>

#include "varlink/json.h"

namespace lensd::web {
namespace {

constexpr std::size_t kLongestBody = std::size_t{1} << 20;
constexpr std::size_t kPieceBytes = 65536;

/// The page needs nothing from elsewhere, and no page of elsewhere needs ours.
constexpr std::array<std::pair<const char*, const char*>, 6> kAlways{{
    {"Content-Security-Policy",
     "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; connect-src 'self'; "
     "frame-ancestors 'none'; base-uri 'none'; form-action 'none'"},
    {"X-Content-Type-Options", "nosniff"},
    {"Referrer-Policy", "no-referrer"},
    {"Cross-Origin-Resource-Policy", "same-origin"},
    {"X-Frame-Options", "DENY"},
    {"Cache-Control", "no-store"},
}};

std::string_view OrNothing(const char* text) {
  return text == nullptr ? std::string_view() : std::string_view(text);
}

}  // namespace

Answer Refusal(int status, std::string_view error, std::string_view message) {
  const varlink::Json body{{"error", error}, {"parameters", {{"message", message}}}};
  return {.status = status, .body = varlink::WriteJson(body) + "\n"};
}

Exchange::Exchange(const ServerFloor& floor, MHD_Connection* connection, std::string method, std::string path)
    : floor_(floor), connection_(connection), method_(std::move(method)), path_(std::move(path)) {}

Exchange::~Exchange() {
  if (response_ != nullptr) MHD_destroy_response(response_);
}

std::string_view Exchange::Header(const char* name) const {
  return OrNothing(MHD_lookup_connection_value(connection_, MHD_HEADER_KIND, name));
}

std::string_view Exchange::Query(const char* name) const {
  return OrNothing(MHD_lookup_connection_value(connection_, MHD_GET_ARGUMENT_KIND, name));
}

std::string_view Exchange::Cookie(const char* name) const {
  return OrNothing(MHD_lookup_connection_value(connection_, MHD_COOKIE_KIND, name));
}

bool Exchange::Take(std::string_view piece) {
  if (body_.size() + piece.size() > kLongestBody) return false;
  body_ += piece;
  return true;
}

void Exchange::Reply(const Answer& answer) {
  if (replied()) return;
  auto* bytes = const_cast<char*>(answer.body.data());  // copied, as asked for
  MHD_Response* response = MHD_create_response_from_buffer(answer.body.size(), bytes, MHD_RESPMEM_MUST_COPY);
  if (response == nullptr) return Gone();
  MHD_add_response_header(response, "Content-Type", answer.type.c_str());
  for (const auto& [name, value] : answer.headers) MHD_add_response_header(response, name.c_str(), value.c_str());
  Answered(answer.status, response);
}

void Exchange::Reply(const char* type, std::unique_ptr<Stream> stream) {
  if (replied()) return;
  stream_ = std::move(stream);
  MHD_Response* response =
      MHD_create_response_from_callback(MHD_SIZE_UNKNOWN, kPieceBytes, &Exchange::ReadStream, this, nullptr);
  if (response == nullptr) return Gone();
  MHD_add_response_header(response, "Content-Type", type);
  MHD_add_response_header(response, "X-Accel-Buffering", "no");  // nginx would hold the stream back
  Answered(200, response);
}

void Exchange::Answered(int status, MHD_Response* response) {
  for (const auto& [name, value] : kAlways) MHD_add_response_header(response, name, value);
  response_ = response;
  status_ = status;
  Wake();
}

bool Exchange::Go() {
  if (gone_) return false;
  if (!replied()) {
    Sleep();
    return true;
  }
  return MHD_queue_response(connection_, static_cast<unsigned>(status_), response_) == MHD_YES;
}

ssize_t Exchange::ReadStream(void* self, std::uint64_t, char* to, std::size_t size) {
  auto& exchange = *static_cast<Exchange*>(self);
  if (exchange.gone_) return MHD_CONTENT_READER_END_WITH_ERROR;
  const auto count = exchange.stream_->Read(to, size);
  if (!count) return MHD_CONTENT_READER_END_OF_STREAM;
  if (*count == 0) exchange.Sleep();
  return static_cast<ssize_t>(*count);
}

void Exchange::Sleep() {
  const MHD_ConnectionInfo* info = MHD_get_connection_info(connection_, MHD_CONNECTION_INFO_CONNECTION_FD);
  asleep_ = true;
  MHD_suspend_connection(connection_);
  hangup_ = floor_.loop.OnDescriptor(info->connect_fd, EPOLLRDHUP, [this](std::uint32_t) { Gone(); });
}

void Exchange::Wake() {
  if (!asleep_) return;
  asleep_ = false;
  hangup_.reset();
  MHD_resume_connection(connection_);
  floor_.turn();
}

void Exchange::Gone() {
  gone_ = true;
  Wake();
}

}  // namespace lensd::web
