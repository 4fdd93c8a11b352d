// One connection a call, so that a call that hangs holds up no other. proto/errors_and_methods.md has the HTTP status
// of each error.
#include "web/link/lensd_link.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "proto/errors_and_methods.h"
#include "proto/interfaces.h"

namespace lensd::web {
namespace {

constexpr int kUnknownError = 500;

std::string Qualified(std::string_view method) {
  if (method.find('.') != std::string_view::npos) return std::string(method);
  return std::string(proto::kLensInterface) + "." + std::string(method);
}

}  // namespace

std::unique_ptr<UpstreamCall> LensdLink::Begin(std::string_view method, varlink::Json parameters, bool more,
                                               Duration limit, UpstreamCall::Listener listener) const {
  varlink::Call call;
  call.method = Qualified(method);
  call.parameters = std::move(parameters);
  call.more = more;
  return std::make_unique<UpstreamCall>(loop_, path_, call, limit, std::move(listener));
}

Answer AnswerOf(const varlink::Reply& error) {
  const auto* row = std::ranges::find(proto::kErrors, error.error, &proto::ErrorRow::name);
  const int status = row == std::end(proto::kErrors) ? kUnknownError : row->http;
  const varlink::Json body{{"error", error.error}, {"parameters", error.parameters}};
  return {.status = status, .body = varlink::WriteJson(body) + "\n"};
}

Answer AnswerOf(const Error& why) {
  const bool late = why.code == Code::Timeout;
  return Refusal(late ? 504 : 503, late ? "Timeout" : "NoDaemon", why.message);
}

Answer AsWished(const Exchange& exchange, Answer answer) {
  if (exchange.Query("errors") == "body") answer.status = 200;
  return answer;
}

}  // namespace lensd::web
