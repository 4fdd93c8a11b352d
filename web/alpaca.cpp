// Each request asks lensd anew for its list and its states: clients poll a few times a second, and nothing here can be
// out of date. Names of parameters count as written in PUT, and in any case in GET, as the standard has it.
#include "alpaca.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/epoll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <ctime>
#include <functional>
#include <utility>

namespace lensd::web {
namespace {

using varlink::Json;
constexpr Duration kAsk = std::chrono::seconds(10);
constexpr Duration kMoveAtMost = std::chrono::minutes(10);
constexpr int kDiscoveryPort = 32227;

enum AlpacaError {
  kNone = 0,
  kNotImplemented = 0x400,
  kInvalidValue = 0x401,
  kNotConnected = 0x407,
  kInvalidOperation = 0x40B,
  kActionNotImplemented = 0x40C,
  kDisconnected = 0x500,
  kDeviceError = 0x502
};

constexpr std::array kGets{
    "absolute",      "connected",        "connecting",       "description",  "devicestate",       "driverinfo",
    "driverversion", "interfaceversion", "ismoving",         "maxincrement", "maxstep",           "name",
    "position",      "stepsize",         "supportedactions", "tempcomp",     "tempcompavailable", "temperature"};
constexpr std::array kPuts{"action",    "commandblind", "commandbool", "commandstring", "connect",
                           "connected", "disconnect",   "halt",        "move",          "tempcomp"};
/// What may be asked before Connected is true.
constexpr std::array kBeforeConnected{"connected",   "connecting",      "connect",       "disconnect",
                                      "description", "driverinfo",      "driverversion", "interfaceversion",
                                      "name",        "supportedactions"};

template <class Names>
bool IsAmong(const Names& names, std::string_view name) {
  return std::ranges::find(names, name) != names.end();
}

/// "a%20b+c" as text.
std::string FromForm(std::string_view text) {
  std::string plain;
  for (std::size_t i = 0; i < text.size(); ++i) {
    unsigned value = 0;
    if (text[i] == '%' && i + 2 < text.size() &&
        std::from_chars(text.data() + i + 1, text.data() + i + 3, value, 16).ptr == text.data() + i + 3) {
      plain += static_cast<char>(value);
      i += 2;
    } else {
      plain += text[i] == '+' ? ' ' : text[i];
    }
  }
  return plain;
}

/// A parameter: of a PUT in the body, of a GET in the query. None: it is not given.
std::optional<std::string> ParameterOf(const Exchange& exchange, const char* name) {
  if (exchange.method() != "PUT") {
    const std::string_view value = exchange.Query(name);
    return value.data() == nullptr ? std::nullopt : std::optional(std::string(value));
  }
  std::string_view rest = exchange.body();
  while (!rest.empty()) {
    const std::string_view field = rest.substr(0, rest.find('&'));
    rest.remove_prefix(std::min(rest.size(), field.size() + 1));
    const std::size_t equals = field.find('=');
    if (equals != std::string_view::npos && FromForm(field.substr(0, equals)) == name) {
      return FromForm(field.substr(equals + 1));
    }
  }
  return std::nullopt;
}

template <class Number>
std::optional<Number> NumberIn(std::string_view text) {
  Number value = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || read.ec != std::errc{} || read.ptr != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<bool> TruthIn(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::tolower(c); });
  if (text == "true") return true;
  if (text == "false") return false;
  return std::nullopt;
}

Answer Malformed(const std::string& why) {
  return {.status = 400, .type = "text/plain; charset=utf-8", .body = why + "\n"};
}

Json FocusOf(const Json& axes) {
  for (const Json& axis : axes) {
    if (axis.value("axis", "") == "focus") return axis;
  }
  return nullptr;
}

/// Steps count from the lowest target.
std::int64_t StepsBetween(double from, double to) {
  return std::llround(to - from);
}

AlpacaError ErrorOf(std::string_view name) {
  name = name.substr(name.rfind('.') + 1);
  if (name == "OutOfRange" || name == "InvalidRequest") return kInvalidValue;
  if (name == "Unsupported") return kNotImplemented;
  if (name == "Disconnected" || name == "Timeout") return kDisconnected;
  return name == "DeviceError" || name == "ProtocolError" ? kDeviceError : kInvalidOperation;
}

}  // namespace

/// One request. Held by its exchange.
class AlpacaRequest {
 public:
  AlpacaRequest(Alpaca& alpaca, Exchange& exchange) : alpaca_(alpaca), exchange_(exchange) {}
  void Begin();

 private:
  bool ReadPath();
  void Ask(const char* method, Json parameters, const std::function<void(const Json&)>& then);
  void Listed(const Json& list);
  void Perform();
  void Put();
  void Move();
  void Stop();
  void Connect(const std::optional<bool>& wanted);
  void Get();
  void Tell(const Json& state);
  Json StateOf(const Json& state, std::string_view what) const;
  void Value(const Json& value) { Reply(value, kNone, ""); }
  void Failed(AlpacaError error, const std::string& why) { Reply(nullptr, error, why); }
  void Reply(const Json& value, AlpacaError error, const std::string& why);

  Alpaca& alpaca_;
  Exchange& exchange_;
  std::unique_ptr<UpstreamCall> call_;
  std::string method_;  // "position"
  std::size_t number_ = 0;
  Json lens_;   // of List
  Json focus_;  // its focus axis
};

void AlpacaRequest::Reply(const Json& value, AlpacaError error, const std::string& why) {
  const auto id = ParameterOf(exchange_, "ClientTransactionID");
  Json body{{"ClientTransactionID", id ? NumberIn<std::uint32_t>(*id).value_or(0) : 0},
            {"ServerTransactionID", ++alpaca_.transactions_},
            {"ErrorNumber", static_cast<int>(error)},
            {"ErrorMessage", why}};
  if (exchange_.method() == "GET") body["Value"] = value;
  exchange_.Reply({.body = varlink::WriteJson(body)});
}

void AlpacaRequest::Begin() {
  for (const char* name : {"ClientID", "ClientTransactionID"}) {
    const auto id = ParameterOf(exchange_, name);
    if (id && !NumberIn<std::uint32_t>(*id))
      return exchange_.Reply(Malformed(std::string(name) + " is no unsigned number"));
  }
  const std::string& path = exchange_.path();
  if (path == "/management/apiversions") return Value(Json::array({1}));
  if (path == "/management/v1/description") {
    return Value(
        {{"ServerName", "lensd"}, {"Manufacturer", "lensd"}, {"ManufacturerVersion", LENSD_VERSION}, {"Location", ""}});
  }
  if (path != "/management/v1/configureddevices" && !ReadPath()) return;
  Ask("List", Json::object(), [this](const Json& list) { Listed(list); });
}

/// False: answered already, since the path is none of the API.
bool AlpacaRequest::ReadPath() {
  constexpr std::string_view kPrefix = "/api/v1/focuser/";
  const std::string_view path = exchange_.path();
  const std::size_t slash = path.starts_with(kPrefix) ? path.find('/', kPrefix.size()) : std::string_view::npos;
  const auto number = slash == std::string_view::npos
                          ? std::nullopt
                          : NumberIn<std::uint32_t>(path.substr(kPrefix.size(), slash - kPrefix.size()));
  if (number) method_ = path.substr(slash + 1);
  const bool known = exchange_.method() == "PUT" ? IsAmong(kPuts, method_) : IsAmong(kGets, method_);
  if (!number || !known) exchange_.Reply(Malformed("there is no such device or method: " + std::string(path)));
  number_ = number.value_or(0);
  return number && known;
}

void AlpacaRequest::Ask(const char* method, Json parameters, const std::function<void(const Json&)>& then) {
  call_ = alpaca_.link_.Begin(method, std::move(parameters), /*more=*/false, kAsk,
                              {.reply =
                                   [this, then](const varlink::Reply& reply, const File&) {
                                     if (reply.error.empty()) return then(reply.parameters);
                                     Failed(ErrorOf(reply.error), reply.parameters.value("message", reply.error));
                                   },
                               .failed = [this](const Error& why) { Failed(kDisconnected, why.message); }});
}

void AlpacaRequest::Listed(const Json& list) {
  Json devices = Json::array();
  for (const Json& lens : list["lenses"]) {
    const Json focus = FocusOf(lens["axes"]);
    if (focus.is_null()) continue;
    if (devices.size() == number_) {
      lens_ = lens;
      focus_ = focus;
    }
    const std::string name = lens["name"];
    devices.push_back({{"DeviceName", name},
                       {"DeviceType", "Focuser"},
                       {"DeviceNumber", devices.size()},
                       {"UniqueID", "lensd-" + name}});
  }
  if (method_.empty()) return Value(devices);
  if (lens_.is_null()) return exchange_.Reply(Malformed("there is no focuser of that number"));
  Perform();
}

void AlpacaRequest::Perform() {
  const auto& focuser = alpaca_.focusers_[lens_["name"]];
  if (!focuser.connected && !IsAmong(kBeforeConnected, method_)) return Failed(kNotConnected, "not connected");
  exchange_.method() == "PUT" ? Put() : Get();
}

void AlpacaRequest::Put() {
  if (method_ == "move") return Move();
  if (method_ == "halt") return Stop();
  if (method_ == "connect") return Connect(true);
  if (method_ == "disconnect") return Connect(false);
  if (method_ == "connected") {
    const auto given = ParameterOf(exchange_, "Connected");
    return Connect(given ? TruthIn(*given) : std::nullopt);
  }
  if (method_ == "action") return Failed(kActionNotImplemented, "there are no actions");
  if (method_ == "tempcomp" && !TruthIn(ParameterOf(exchange_, "TempComp").value_or(""))) {
    return exchange_.Reply(Malformed("TempComp is True or False"));
  }
  Failed(kNotImplemented, method_ + " is not implemented");
}

void AlpacaRequest::Connect(const std::optional<bool>& wanted) {
  if (!wanted) return exchange_.Reply(Malformed("Connected is True or False"));
  alpaca_.focusers_[lens_["name"]].connected = *wanted;
  Value(nullptr);
}

/// Answers at once: IsMoving is true until lensd has answered.
void AlpacaRequest::Move() {
  const auto given = ParameterOf(exchange_, "Position");
  const auto position = given ? NumberIn<std::int32_t>(*given) : std::nullopt;
  if (!position) return exchange_.Reply(Malformed("Position is a whole number"));
  const double low = focus_["minimum"], high = focus_["maximum"];
  if (*position < 0 || *position > StepsBetween(low, high)) {
    return Failed(kInvalidValue, "Position is 0 to " + std::to_string(StepsBetween(low, high)));
  }
  const std::string lens = lens_["name"];
  auto& move = alpaca_.focusers_[lens].move;
  const auto ended = [&move] { move.reset(); };
  move = alpaca_.link_.Begin("Move", {{"lens", lens}, {"axis", "focus"}, {"target", {{"position", low + *position}}}},
                             /*more=*/false, kMoveAtMost,
                             {.reply = [ended](const varlink::Reply&, const File&) { ended(); },
                              .failed = [ended](const Error&) { ended(); }});
  Value(nullptr);
}

void AlpacaRequest::Stop() {
  Ask("Stop", {{"lens", lens_["name"]}}, [this](const Json&) { Value(nullptr); });
}

void AlpacaRequest::Get() {
  const std::string name = lens_["name"];
  const std::int64_t range = StepsBetween(focus_["minimum"], focus_["maximum"]);
  if (method_ == "absolute") return Value(true);
  if (method_ == "connected") return Value(alpaca_.focusers_[name].connected);
  if (method_ == "connecting" || method_ == "tempcomp" || method_ == "tempcompavailable") return Value(false);
  if (method_ == "name" || method_ == "description") return Value(name);
  if (method_ == "driverinfo") return Value("lens-web of lensd " LENSD_VERSION);
  if (method_ == "driverversion") return Value(LENSD_VERSION);
  if (method_ == "interfaceversion") return Value(4);
  if (method_ == "supportedactions") return Value(Json::array());
  if (method_ == "maxstep" || method_ == "maxincrement") return Value(range);
  if (method_ == "stepsize") {
    const Json& optics = lens_["optics"];
    if (!optics.is_object() || range == 0) return Failed(kNotImplemented, "the size of a step is not known");
    const double um = 1000 * (optics["extensionMaxMm"].get<double>() - optics["extensionMinMm"].get<double>());
    return Value(std::abs(um) / static_cast<double>(range));
  }
  Ask("Status", {{"lens", name}}, [this](const Json& status) { Tell(status["lenses"][0]); });
}

/// ismoving, position, temperature, or null where that is not known.
Json AlpacaRequest::StateOf(const Json& state, std::string_view what) const {
  const Json axis = FocusOf(state["axes"]);
  const auto& move = alpaca_.focusers_[state["name"]].move;
  if (what == "ismoving") return move != nullptr || (axis.is_object() && axis["moving"] == true);
  if (what == "temperature") return state.value("temperatureC", Json());
  return axis.is_object() ? Json(StepsBetween(focus_["minimum"], axis["position"])) : Json();
}

void AlpacaRequest::Tell(const Json& state) {
  if (method_ != "devicestate") {
    const Json value = StateOf(state, method_);
    return value.is_null() ? Failed(kNotImplemented, method_ + " is not known") : Value(value);
  }
  std::array<char, 32> time{};
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  (void)std::strftime(time.data(), time.size(), "%FT%TZ", gmtime_r(&now, &utc));
  Json states = Json::array({{{"Name", "TimeStamp"}, {"Value", time.data()}}});
  for (const auto& [name, what] :
       {std::pair{"IsMoving", "ismoving"}, {"Position", "position"}, {"Temperature", "temperature"}}) {
    const Json value = StateOf(state, what);
    if (!value.is_null()) states.push_back({{"Name", name}, {"Value", value}});
  }
  Value(states);
}

std::optional<Answer> Alpaca::Gate(const Exchange& exchange) {
  const std::string_view site = exchange.Header("Sec-Fetch-Site");
  if (!exchange.Header("Origin").empty() || site == "cross-site" || site == "same-site") {
    return Refusal(403, "ForeignOrigin", "this is for programs, not for pages");
  }
  if (exchange.method() == "GET" || exchange.method() == "PUT") return std::nullopt;
  return Malformed("GET reads, PUT acts");
}

void Alpaca::Handle(Exchange& exchange) {
  auto request = std::make_shared<AlpacaRequest>(*this, exchange);
  exchange.Hold(request);
  request->Begin();
}

Result<std::unique_ptr<AlpacaDiscovery>> AlpacaDiscovery::Create(EventLoop& loop, int alpaca_port) {
  File socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  const int on = 1;  // several servers of one machine share the port
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(kDiscoveryPort);
  if (socket.get() < 0 || setsockopt(socket.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) != 0 ||
      bind(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    return Fail(Code::Io, std::string("Alpaca's discovery cannot listen at UDP 32227: ") + std::strerror(errno));
  }
  std::unique_ptr<AlpacaDiscovery> made(new AlpacaDiscovery(std::move(socket), alpaca_port));
  made->ready_ =
      loop.OnDescriptor(made->socket_.get(), EPOLLIN, [self = made.get()](std::uint32_t) { self->Respond(); });
  return made;
}

void AlpacaDiscovery::Respond() const {
  std::array<char, 64> asked{};
  sockaddr_in from{};
  socklen_t size = sizeof from;
  const ssize_t count =
      recvfrom(socket_.get(), asked.data(), asked.size(), 0, reinterpret_cast<sockaddr*>(&from), &size);
  if (count <= 0 || !std::string_view(asked.data(), static_cast<std::size_t>(count)).starts_with("alpacadiscovery1"))
    return;
  const std::string told = varlink::WriteJson({{"AlpacaPort", port_}});
  (void)sendto(socket_.get(), told.data(), told.size(), 0, reinterpret_cast<const sockaddr*>(&from), size);
}

}  // namespace lensd::web
