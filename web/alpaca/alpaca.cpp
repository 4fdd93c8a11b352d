// Each request asks lensd anew for its list and its states: clients poll a few times a second, and nothing here can be
// out of date. Names of parameters count as written in PUT, and in any case in GET, as the standard has it.
#include "web/alpaca/alpaca.h"

#include <systemd/sd-id128.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <ctime>
#include <functional>
#include <utility>
#include <vector>

namespace lensd::web {
namespace {

using varlink::Json;
constexpr Duration kAsk = std::chrono::seconds(10);
constexpr std::size_t kMostClients = 64;  // of one focuser; programs that crash never disconnect

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

/// Programs open it in a browser where their user asks for a device's settings.
constexpr const char* kSetup =
    "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><title>lensd</title>"
    "<p>Lenses are set up in <code>/etc/lensd/lensd.toml</code> of this machine; nothing can be set here.</p></html>\n";

template <class Names>
bool IsAmong(const Names& names, const auto& name) {
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

/// Parameters that a method cannot do without, beside those that are read where they count.
std::vector<const char*> NeededBy(std::string_view method) {
  if (method == "action") return {"Action", "Parameters"};
  if (method.starts_with("command")) return {"Command", "Raw"};
  return {};
}

/// The same for ever, and no other machine's: the lens, and which machine this is.
std::string UniqueId(const std::string& lens) {
  constexpr sd_id128_t kApplication = {
      {0x5b, 0x0c, 0x3f, 0x1e, 0x7a, 0x92, 0x4d, 0x66, 0xb8, 0x41, 0x90, 0xd3, 0x2e, 0x57, 0xc4, 0x18}};
  sd_id128_t machine{};
  std::array<char, SD_ID128_STRING_MAX> text{};
  if (sd_id128_get_machine_app_specific(kApplication, &machine) < 0) return "lensd-" + lens;
  return std::string(sd_id128_to_string(machine, text.data())) + "-" + lens;
}

Json FocusOf(const Json& axes) {
  for (const Json& axis : axes) {
    if (axis.value("axis", "") == "focus") return axis;
  }
  return nullptr;
}

/// The grid of the device, whatever its unit: step n is the target `low` + n * `size`, for n from 0 to `count`.
struct Steps {
  double low = 0.0, size = 1.0;
  std::int64_t count = 0;

  double PositionOf(std::int64_t step) const {
    return low + size * static_cast<double>(std::clamp<std::int64_t>(step, 0, count));
  }
  /// The step nearest to a position, which may lie off the grid or beyond its ends.
  std::int64_t Nearest(double position) const {
    return std::llround(std::clamp((position - low) / size, 0.0, static_cast<double>(count)));
  }
};

Steps StepsOf(const Json& axis) {
  constexpr double kMostSteps = 2147483647.0;  // positions are 32-bit numbers
  constexpr double kRounding = 1e-6;           // of a step
  Steps steps{.low = axis["minimum"], .size = axis["resolution"]};
  const double range = axis["maximum"].get<double>() - steps.low;
  if (!(steps.size > 0.0)) steps.size = 1.0;
  steps.size = std::max(steps.size, range / kMostSteps);
  steps.count = static_cast<std::int64_t>(std::floor(range / steps.size + kRounding));
  return steps;
}

}  // namespace

/// One request. Held by its exchange.
class AlpacaRequest : public std::enable_shared_from_this<AlpacaRequest> {
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
  bool Connected() const;
  std::uint32_t Client() const;
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
  // Clients that expect a number cannot read a null: an error has no value.
  if (exchange_.method() == "GET" && error == kNone) body["Value"] = value;
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
  if (path == "/setup" || (path.starts_with("/setup/v1/focuser/") && path.ends_with("/setup"))) {
    return exchange_.Reply({.type = "text/html; charset=utf-8", .body = kSetup});
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
                                     Failed(AlpacaErrorOf(reply.error), reply.parameters.value("message", reply.error));
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
                       {"UniqueID", UniqueId(name)}});
  }
  if (method_.empty()) return Value(devices);
  if (lens_.is_null()) return exchange_.Reply(Malformed("there is no focuser with this number"));
  Perform();
}

void AlpacaRequest::Perform() {
  if (!Connected() && !IsAmong(kBeforeConnected, method_)) return Failed(kNotConnected, "not connected");
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
  for (const char* needed : NeededBy(method_)) {
    if (!ParameterOf(exchange_, needed)) return exchange_.Reply(Malformed(std::string(needed) + " is missing"));
  }
  if (method_ == "action") return Failed(kActionNotImplemented, "there are no actions");
  if (method_ == "tempcomp" && !TruthIn(ParameterOf(exchange_, "TempComp").value_or(""))) {
    return exchange_.Reply(Malformed("TempComp is True or False"));
  }
  Failed(kNotImplemented, method_ + " is not implemented");
}

void AlpacaRequest::Connect(const std::optional<bool>& wanted) {
  if (!wanted) return exchange_.Reply(Malformed("Connected is True or False"));
  auto& clients = alpaca_.focusers_[lens_["name"]].clients;
  std::erase(clients, Client());
  if (*wanted) clients.push_back(Client());
  if (auto& move = alpaca_.focusers_[lens_["name"]].move) move->Forget();
  if (clients.size() > kMostClients) clients.pop_front();
  Value(nullptr);
}

/// Each program connects for itself: one that disconnects does not part the others from the lens.
bool AlpacaRequest::Connected() const {
  return IsAmong(alpaca_.focusers_[lens_["name"]].clients, Client());
}

/// Programs that do not say who they are count as one.
std::uint32_t AlpacaRequest::Client() const {
  return NumberIn<std::uint32_t>(ParameterOf(exchange_, "ClientID").value_or("")).value_or(0);
}

/// IsMoving is true until lensd has answered. What is beyond an end of the travel goes to that end, as the standard has
/// it
/// ("will automatically stop at the limit").
void AlpacaRequest::Move() {
  const auto given = ParameterOf(exchange_, "Position");
  const auto position = given ? NumberIn<std::int32_t>(*given) : std::nullopt;
  if (!position) return exchange_.Reply(Malformed("Position is a whole number"));
  const Steps steps = StepsOf(focus_);
  const std::string lens = lens_["name"];
  const Json target{{"position", steps.PositionOf(*position)}};
  const auto begun = [asker = weak_from_this()](const std::optional<AlpacaFailure>& refusal) {
    const auto request = asker.lock();  // gone: the program has hung up
    if (request) refusal ? request->Failed(refusal->error, refusal->why) : request->Value(nullptr);
  };
  alpaca_.focusers_[lens].move =
      std::make_unique<AlpacaMove>(alpaca_.link_, Json{{"lens", lens}, {"axis", "focus"}, {"target", target}}, begun);
}

void AlpacaRequest::Stop() {
  if (const auto& move = alpaca_.focusers_[lens_["name"]].move) move->Halt();
  Ask("Stop", {{"lens", lens_["name"]}}, [this](const Json&) { Value(nullptr); });
}

void AlpacaRequest::Get() {
  const std::string name = lens_["name"];
  const std::int64_t range = StepsOf(focus_).count;
  if (method_ == "absolute") return Value(true);
  if (method_ == "connected") return Value(Connected());
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
  if (what == "ismoving") return (move && move->moving()) || (axis.is_object() && axis["moving"] == true);
  if (what == "temperature") return state.value("temperatureC", Json());
  if (!axis.is_object()) return Json();
  // Programs wait until Position is what they asked for: a move that was reached within its tolerance stands there.
  const double position = axis["position"];
  const bool arrived = move && move->arrived_at() == position;
  return Json(StepsOf(focus_).Nearest(arrived ? move->target() : position));
}

void AlpacaRequest::Tell(const Json& state) {
  const auto& move = alpaca_.focusers_[state["name"]].move;
  if (method_ == "ismoving" && move && move->failure()) return Failed(move->failure()->error, move->failure()->why);
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

}  // namespace lensd::web
