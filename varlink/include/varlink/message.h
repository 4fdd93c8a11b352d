// Varlink calls and replies: what one message says, and the rules that close a connection.
#pragma once

#include <string>
#include <string_view>

#include "base/result.h"
#include "varlink/json.h"
#include "varlink/json_view.h"

namespace lensd::varlink {

/// One call. At most one flag is set.
struct Call {
  std::string method;                ///< fully qualified: interface.Method
  Json parameters = Json::object();  ///< always an object
  bool oneway = false;               ///< never answered, not even with an error
  bool more = false;                 ///< several replies are welcome
  bool upgrade = false;              ///< asks to leave the protocol; we refuse
};

/// One call as it came in: what most calls need of their parameters is a few members, not a Json of them all.
struct ReceivedCall {
  std::string method;
  bool oneway = false, more = false, upgrade = false;  ///< as in Call
  std::size_t bytes = 0;                               ///< of the message
  Document message;
  JsonView parameters = EmptyObject();  ///< an object, in `message`
};

/// One reply.
struct Reply {
  Json parameters = Json::object();  ///< always an object; an error's own fields where `error` is set
  std::string error;                 ///< fully qualified name, empty for success
  bool continues = false;            ///< further replies follow
};

/// Reads a call. Code::Protocol means that the connection must be closed: bad JSON, not an object, no method, a flag
/// that is not a boolean, two flags, parameters that are not an object, a member that is neither known nor prefixed
/// (a prefixed member has a dot in its name and is ignored).
Result<ReceivedCall> ReceiveCall(std::string_view message);
/// Reads a reply; members that are not known are ignored. Code::Protocol as above.
Result<Reply> ParseReply(std::string_view message);

/// The message with its NUL.
std::string EncodeCall(const Call& call);
/// The message with its NUL.
std::string EncodeReply(const Reply& reply);
/// The same for parameters that are serialised already (a JSON object).
std::string EncodeReply(std::string_view parameters, bool continues);

}  // namespace lensd::varlink
