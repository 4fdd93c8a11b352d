// One connection a call, so that a call that hangs holds up no other. A table turns errors of lensd into HTTP statuses.
// table.
#include "lensd_link.h"

#include <array>
#include <utility>

#include "proto/interfaces.h"

namespace lensd::web {
namespace {

constexpr int kUnknownError = 500;
constexpr std::array<std::pair<std::string_view, int>, 22> kStatuses{{
    {"InvalidRequest", 400},
    {"OutOfRange", 400},
    {"BadData", 400},
    {"InvalidParameter", 400},
    {"ExpectedMore", 400},
    {"NotPermitted", 403},
    {"LensNotFound", 404},
    {"PresetNotFound", 404},
    {"MethodNotFound", 404},
    {"InterfaceNotFound", 404},
    {"Busy", 409},
    {"Leased", 409},
    {"Superseded", 409},
    {"Cancelled", 409},
    {"NotHomed", 409},
    {"Unsupported", 501},
    {"MethodNotImplemented", 501},
    {"Disconnected", 502},
    {"DeviceError", 502},
    {"ProtocolError", 502},
    {"Overrun", 503},
    {"Timeout", 504},
}};

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
  const std::string_view name = std::string_view(error.error).substr(error.error.rfind('.') + 1);
  int status = kUnknownError;
  for (const auto& [known, fits] : kStatuses) {
    if (known == name) status = fits;
  }
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
