// Calls: each has a connection for itself meanwhile, which the next one takes over.
#include "lensd/client.h"

#include <algorithm>
#include <ctime>
#include <iterator>
#include <mutex>
#include <utility>

#include "connection.h"
#include "pictures.h"
#include "quantities.h"
#include "streams.h"
#include "tables.h"

namespace lensd {
inline namespace v1 {
namespace {

constexpr Milliseconds kQuestion{60'000}, kMotion{600'000}, kSearch{3'700'000};
constexpr std::size_t kIdle = 4;

std::string FullName(const std::string& method) {
  return method.find('.') == std::string::npos ? "io.lensd.Lens." + method : method;
}

Milliseconds Or(Milliseconds timeout, Milliseconds usual) {
  return timeout.count() > 0 ? timeout : usual;
}

/// How long a method may take when the caller does not say.
Milliseconds UsualOf(std::string_view method) {
  if (method == "Autofocus" || method == "MeasureBacklash" || method == "FocusMap") return kSearch;
  const auto* end = std::end(kDrivingMethods);
  return std::find(std::begin(kDrivingMethods), end, method) != end ? kMotion : kQuestion;
}

Json Exchange(Connection& connection, const char* method, Json parameters, const Deadline& deadline) {
  connection.Send(FullName(method), std::move(parameters), Client::Replies::One, deadline);
  Message reply = connection.Receive(deadline);
  if (!reply.error.empty()) ThrowError(reply);
  return std::move(reply.parameters);
}

std::int64_t NowNs() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<std::int64_t>(now.tv_sec) * 1'000'000'000 + now.tv_nsec;
}

template <class T>
T ValueOf(Json json) {
  T value;
  Access::Put(value, Access::Own(std::move(json)));
  return value;
}

template <class T>
T Result(std::optional<T> result) {
  if (!result) throw LensdError("BrokenReply", "lensd answered without a result");
  return *std::move(result);
}

}  // namespace

struct Client::Impl {
  explicit Impl(std::string socket) : path(std::move(socket)) {}

  Connection Take(const Deadline& deadline) {
    for (;;) {
      std::unique_lock lock(mutex);
      if (idle.empty()) break;
      Connection connection = std::move(idle.back());
      idle.pop_back();
      lock.unlock();
      if (!connection.IsStale()) return connection;
    }
    return Connection::Open(path, deadline);
  }

  /// Takes one back on which nothing is under way.
  void Give(Connection connection) {
    const std::scoped_lock lock(mutex);
    if (idle.size() < kIdle) idle.push_back(std::move(connection));
  }

  Message Call(const std::string& method, Json parameters, Milliseconds timeout) {
    const Deadline deadline(timeout);
    Connection connection = Take(deadline);
    connection.Send(method, std::move(parameters), Replies::One, deadline);
    Message reply = connection.Receive(deadline);
    Give(std::move(connection));
    if (!reply.error.empty()) ThrowError(reply);
    return reply;
  }

  std::unique_ptr<Access::StreamImpl> Begin(const std::string& method, Json parameters, Replies replies,
                                            Milliseconds timeout) {
    const Deadline deadline(timeout);
    Connection connection = Connection::Open(path, deadline);
    connection.Send(FullName(method), std::move(parameters), replies, deadline);
    return std::make_unique<Access::StreamImpl>(std::move(connection), timeout);
  }

  const std::string path;
  std::mutex mutex;
  std::vector<Connection> idle;
};

struct View::Impl {
  std::optional<Picture> Completed(std::optional<Json> reply) {
    return reply ? assembly.Add(*reply, stream->connection) : std::nullopt;
  }

  std::unique_ptr<Access::StreamImpl> stream;
  Assembly assembly{};
};

View::View(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
View::View(View&&) noexcept = default;
View& View::operator=(View&&) noexcept = default;
View::~View() = default;

std::optional<Picture> View::Next() {
  while (!ended()) {
    if (auto picture = impl_->Completed(impl_->stream->Next())) return picture;
  }
  return std::nullopt;
}
std::optional<Picture> View::Process() {
  while (auto reply = impl_->stream->Process()) {
    if (auto picture = impl_->Completed(std::move(reply))) return picture;
  }
  return std::nullopt;
}
int View::fd() const {
  return impl_->stream->connection.fd();
}
Milliseconds View::left() const {
  return impl_->stream->Left();
}
bool View::ended() const {
  return impl_->stream->ended || impl_->stream->cancelled;
}
void View::Cancel() {
  impl_->stream->cancelled = true;
  impl_->stream->connection.Shut();
}

Client::Client(const std::string& path) : impl_(std::make_unique<Impl>(SocketPath(path))) {}
Client::Client(Client&&) noexcept = default;
Client& Client::operator=(Client&&) noexcept = default;
Client::~Client() = default;

Client Client::OfRig(const std::string& name) {
  constexpr const char* kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
  if (name.empty() || name.find_first_not_of(kLetters) != std::string::npos) {
    throw LensdError("BadText", "rig '" + name + "': a name has letters, digits, - and _");
  }
  return Client("/run/lensd/" + name + "/io.lensd.Lens");
}

std::string Client::Call(const std::string& method, const std::string& parameters, Milliseconds timeout) {
  Json given = Json::parse(parameters, nullptr, false);
  if (!given.is_object()) throw LensdError("BadText", "the parameters of a call are a JSON object");
  const Message reply = impl_->Call(FullName(method), std::move(given), Or(timeout, UsualOf(method)));
  return reply.parameters.dump(-1, ' ', false, Json::error_handler_t::replace);
}

void Client::CallInto(const char* method, const Value& parameters, Milliseconds timeout, Value& reply) {
  Message answer = impl_->Call(FullName(method), Access::Of(parameters), Or(timeout, UsualOf(method)));
  Access::Put(reply, Access::Own(std::move(answer.parameters)));
}

Stream Client::Begin(const std::string& method, const std::string& parameters, Replies replies, Milliseconds timeout) {
  Json given = Json::parse(parameters, nullptr, false);
  if (!given.is_object()) throw LensdError("BadText", "the parameters of a call are a JSON object");
  return Access::Wrap(impl_->Begin(method, std::move(given), replies, timeout));
}

std::vector<LensInfo> Client::List() {
  return Call(ListParameters()).lenses();
}

LensStatus Client::Status(const std::string& lens) {
  StatusParameters parameters;
  if (!lens.empty()) parameters.lens(lens);
  auto lenses = Call(parameters).lenses();
  if (lenses.size() != 1) throw LensdError("BadText", "say which lens: there are " + std::to_string(lenses.size()));
  return lenses.front();
}

namespace {

MoveParameters MoveOf(const std::string& lens, const char* axis, const Target& target) {
  MoveParameters parameters;
  if (!lens.empty()) parameters.lens(lens);
  return parameters.axis(axis).target(target);
}

}  // namespace

MoveResult Client::Focus(const std::string& lens, const std::string& where, Milliseconds timeout) {
  return Move(MoveOf(lens, "focus", FocusTarget(where)), timeout);
}
MoveResult Client::Aperture(const std::string& lens, const std::string& where, Milliseconds timeout) {
  return Move(MoveOf(lens, "iris", ApertureTarget(where)), timeout);
}
MoveResult Client::Zoom(const std::string& lens, const std::string& where, Milliseconds timeout) {
  return Move(MoveOf(lens, "zoom", ZoomTarget(where)), timeout);
}
MoveResult Client::Move(const MoveParameters& parameters, Milliseconds timeout) {
  return Result(Call(parameters, timeout).move());
}
PlanReply Client::Plan(const PlanParameters& parameters, Milliseconds timeout) {
  return Call(parameters, timeout);
}

void Client::Stop(const std::string& lens, const std::string& axis) {
  Json parameters = Json::object();
  if (!lens.empty()) parameters["lens"] = lens;
  if (!axis.empty()) parameters["axis"] = axis;
  const Deadline deadline(kQuestion);
  Connection connection = Connection::Open(impl_->path, deadline);
  Exchange(connection, "Stop", std::move(parameters), deadline);
}

AutofocusResult Client::Autofocus(const AutofocusParameters& parameters, Milliseconds timeout) {
  return Result(Call(parameters, timeout).autofocus());
}

AutofocusResult Client::Autofocus(const AutofocusBeginParameters& parameters, const Grab& grab, Milliseconds timeout) {
  const Deadline deadline(Or(timeout, kSearch));
  Connection connection = impl_->Take(deadline);  // the session ends with it, whatever is thrown
  const auto call = [&](const char* method, Json given) {
    return Exchange(connection, method, std::move(given), deadline);
  };
  const auto begun = ValueOf<AutofocusBeginReply>(call("AutofocusBegin", Access::Of(parameters)));
  std::optional<AutofocusStep> wanted = begun.next();
  std::optional<AutofocusResult> result;
  while (wanted) {
    const std::int64_t start_ns = NowNs();
    const Frame frame = grab(*wanted);
    const auto reply = ValueOf<AutofocusFrameReply>(SendFrame(begun.session(), frame, start_ns, NowNs(), call));
    wanted = reply.next();
    result = reply.autofocus();
  }
  impl_->Give(std::move(connection));
  return Result(std::move(result));
}

Picture Client::Snapshot(const SnapshotParameters& parameters, Milliseconds timeout) {
  auto stream = impl_->Begin("Snapshot", Access::Of(parameters), Replies::More, Or(timeout, kQuestion));
  Assembly assembly;
  while (auto reply = stream->Next()) {
    if (auto picture = assembly.Add(*reply, stream->connection)) return *std::move(picture);
  }
  throw LensdError("BrokenReply", "a picture ended before its last byte");
}

View Client::OpenView(const ViewParameters& parameters, Milliseconds timeout) {
  Json given = Access::Of(parameters);
  given.emplace("fd", true);
  auto view = std::make_unique<View::Impl>();
  view->stream = impl_->Begin("View", std::move(given), Replies::More, Or(timeout, kQuestion));
  return View(std::move(view));
}

Monitor Client::OpenMonitor(const std::string& lens, Milliseconds timeout) {
  Json given = Json::object();
  if (!lens.empty()) given["lens"] = lens;
  return Monitor(Access::Wrap(impl_->Begin("Monitor", std::move(given), Replies::More, timeout)));
}

}  // namespace v1
}  // namespace lensd
