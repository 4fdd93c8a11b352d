// Calls and replies in and out. What breaks the rules of the protocol closes a connection; what is merely wrong for a
// method is the router's business.
#include "varlink/message.h"

#include <utility>

namespace lensd::varlink {
namespace {

constexpr const char* kMessageMustBeObject = "a message must be a JSON object";
constexpr const char* kParametersMustBeObject = "parameters must be an object";

Result<Json> ParseObject(std::string_view message) {
  Result<Json> parsed = ParseJson(message);
  if (parsed && !parsed->is_object()) return Fail(Code::Protocol, kMessageMustBeObject);
  return parsed;
}

/// Absent, null and {} mean the same.
Result<void> TakeParameters(Json& from, Json& into) {
  if (from.is_null()) return {};
  if (!from.is_object()) return Fail(Code::Protocol, kParametersMustBeObject);
  into = std::move(from);
  return {};
}

Result<void> TakeFlag(const std::string& name, const Json& from, bool& into) {
  if (!from.is_boolean()) return Fail(Code::Protocol, "the flag " + name + " must be true or false");
  into = from.get<bool>();
  return {};
}

Result<void> TakeFlag(std::string_view name, JsonView from, bool& into) {
  if (!from.is_boolean()) return Fail(Code::Protocol, "the flag " + std::string(name) + " must be true or false");
  into = from.boolean();
  return {};
}

Result<void> TakeMember(std::string_view name, JsonView value, ReceivedCall& call) {
  if (name == "method") {
    if (!value.is_string()) return Fail(Code::Protocol, "the method must be a string");
    call.method = value.text();
    return {};
  }
  if (name == "parameters") {
    if (!value.is_null() && !value.is_object()) return Fail(Code::Protocol, kParametersMustBeObject);
    call.parameters = value.is_null() ? EmptyObject() : value;
    return {};
  }
  if (name == "oneway") return TakeFlag(name, value, call.oneway);
  if (name == "more") return TakeFlag(name, value, call.more);
  if (name == "upgrade") return TakeFlag(name, value, call.upgrade);
  if (name.find('.') != std::string_view::npos) return {};
  return Fail(Code::Protocol, "a call has no member \"" + std::string(name) + "\"");
}

}  // namespace

Result<ReceivedCall> ReceiveCall(std::string_view message) {
  Result<Document> document = Document::Parse(message);
  if (!document) return PassOn(document);
  ReceivedCall call{.method = {}, .message = *std::move(document)};
  const JsonView root = call.message.root();
  if (!root.is_object()) return Fail(Code::Protocol, kMessageMustBeObject);
  for (const auto& [name, value] : root.members()) {
    if (auto taken = TakeMember(name, value, call); !taken) return PassOn(taken);
  }
  if (call.method.empty()) return Fail(Code::Protocol, "a call without a method");
  call.bytes = message.size();
  if (call.oneway + call.more + call.upgrade > 1) {
    return Fail(Code::Protocol, "at most one of oneway, more and upgrade may be set");
  }
  return call;
}

Result<Reply> ParseReply(std::string_view message) {
  Result<Json> parsed = ParseObject(message);
  if (!parsed) return PassOn(parsed);
  Reply reply;
  if (const auto error = parsed->find("error"); error != parsed->end() && !error->is_null()) {
    if (!error->is_string()) return Fail(Code::Protocol, "the error must be a string");
    reply.error = error->get<std::string>();
  }
  if (const auto parameters = parsed->find("parameters"); parameters != parsed->end()) {
    if (auto taken = TakeParameters(*parameters, reply.parameters); !taken) return PassOn(taken);
  }
  if (const auto continues = parsed->find("continues"); continues != parsed->end()) {
    if (auto taken = TakeFlag("continues", *continues, reply.continues); !taken) return PassOn(taken);
  }
  return reply;
}

std::string EncodeCall(const Call& call) {
  Json message{{"method", call.method}};
  if (!call.parameters.empty()) message["parameters"] = call.parameters;
  if (call.oneway) message["oneway"] = true;
  if (call.more) message["more"] = true;
  if (call.upgrade) message["upgrade"] = true;
  return WriteJson(message) + '\0';
}

std::string EncodeReply(const Reply& reply) {
  if (reply.error.empty()) return EncodeReply(WriteJson(reply.parameters), reply.continues);
  return WriteJson({{"error", reply.error}, {"parameters", reply.parameters}}) + '\0';
}

std::string EncodeReply(std::string_view parameters, bool continues) {
  std::string message = "{\"parameters\":";
  message += parameters;
  if (continues) message += ",\"continues\":true";
  message += '}';
  message += '\0';
  return message;
}

}  // namespace lensd::varlink
