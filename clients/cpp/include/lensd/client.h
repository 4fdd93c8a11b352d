// A client of lensd. C++17; nothing but the standard library is needed to include it.
#ifndef LENSD_CLIENT_H_
#define LENSD_CLIENT_H_

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "lensd/error.h"
#include "lensd/picture.h"
#include "lensd/types.h"

namespace lensd {
inline namespace v1 {

using Milliseconds = std::chrono::milliseconds;

/// A call under way, on a connection of its own. Ended by its last reply, by an error, or where it is destroyed (which
/// ends the call, if it streams). One thread, but for Cancel(). Movable.
class LENSD_API Stream {
 public:
  Stream(Stream&&) noexcept;
  Stream& operator=(Stream&&) noexcept;
  ~Stream();

  /// The next reply as a JSON object, nullopt where there was the last one or Cancel(). Waits at most the stream's
  /// timeout for it.
  std::optional<std::string> Next();

  /// For event loops: wait until fd() is readable or left() has passed, then call Process() until it gives nothing. It
  /// never waits; nothing: none has come yet, or ended(). Past the timeout it throws "DeadlinePassed"; without one
  /// left() is -1, as poll(2) has it.
  int fd() const;
  std::optional<std::string> Process();
  Milliseconds left() const;
  bool ended() const;

  /// From any thread: a caller that waits in Next() gets nullopt.
  void Cancel();

 private:
  friend struct Access;
  struct Impl;
  explicit Stream(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Events of lenses, as Stream has replies.
class LENSD_API Monitor {
 public:
  Monitor(Monitor&&) noexcept;
  Monitor& operator=(Monitor&&) noexcept;
  ~Monitor();
  std::optional<Event> Next();
  int fd() const;
  std::optional<Event> Process();
  bool ended() const;
  void Cancel();

 private:
  friend class Client;
  explicit Monitor(Stream stream);
  Stream stream_;
};

/// Pictures as they come, as Stream has replies.
class LENSD_API View {
 public:
  View(View&&) noexcept;
  View& operator=(View&&) noexcept;
  ~View();
  std::optional<Picture> Next();
  int fd() const;
  std::optional<Picture> Process();
  Milliseconds left() const;
  bool ended() const;
  void Cancel();

 private:
  friend class Client;
  struct Impl;
  explicit View(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Where autofocus with own frames gets them: called with the lens standing where one is wanted; what it throws ends
/// the search.
using Grab = std::function<Frame(const AutofocusStep&)>;

/// A client of one lensd. Nothing is connected before the first call. Any thread may call: each call has a connection
/// for itself meanwhile. Whatever goes wrong is a LensdError. `lens` may be "" while exactly one lens is configured (of
/// Stop: every lens).
///
/// Each call has a timeout; 0 is the usual one (a minute for questions, ten for what moves, an hour for searches). Past
/// it "DeadlinePassed" is thrown and the call's connection closed: a plain move goes on, a search ends.
class LENSD_API Client {
 public:
  /// A path, "unix:PATH", or "": $LENSD_SOCKET, else the socket of the service.
  explicit Client(const std::string& path = "");
  /// The lensd of lensd@NAME.service.
  static Client OfRig(const std::string& name);
  Client(Client&&) noexcept;
  Client& operator=(Client&&) noexcept;
  ~Client();

  /// Any method of io.lensd.Lens (or, with dots, of another interface) by hand: JSON in, JSON out.
  std::string Call(const std::string& method, const std::string& parameters = "{}",
                   Milliseconds timeout = Milliseconds{0});
  /// Any method with its types: `client.Call(PresetSaveParameters().lens("cam").label("wall")).preset()`.
  template <class Parameters>
  typename Parameters::Reply Call(const Parameters& parameters, Milliseconds timeout = Milliseconds{0}) {
    typename Parameters::Reply reply;
    CallInto(Parameters::Method(), parameters, timeout, reply);
    return reply;
  }
  /// A call for an event loop: it is sent, and its replies are the Stream's; several where `more`. `timeout` is for
  /// each reply, 0: for ever.
  enum class Replies { One, More };
  Stream Begin(const std::string& method, const std::string& parameters, Replies replies,
               Milliseconds timeout = Milliseconds{0});

  std::vector<LensInfo> List();
  LensStatus Status(const std::string& lens = "");

  /// Moves to what lensctl reads ("2m", "1.2D", "inf", "@1200", "+50", "near:10", "ext:2.6mm"), and answers when it has
  /// settled; whether it arrived is in reached().
  MoveResult Focus(const std::string& lens, const std::string& where, Milliseconds timeout = Milliseconds{0});
  /// "f/2.8", "2.8", "@12".
  MoveResult Aperture(const std::string& lens, const std::string& where, Milliseconds timeout = Milliseconds{0});
  /// "35mm", "@120".
  MoveResult Zoom(const std::string& lens, const std::string& where, Milliseconds timeout = Milliseconds{0});
  MoveResult Move(const MoveParameters& parameters, Milliseconds timeout = Milliseconds{0});
  /// At once, on a connection of its own; the call that it ends throws "Cancelled". "": every lens.
  void Stop(const std::string& lens = "", const std::string& axis = "");
  /// With apply(true) the lens goes there.
  PlanReply Plan(const PlanParameters& parameters, Milliseconds timeout = Milliseconds{0});

  AutofocusResult Autofocus(const AutofocusParameters& parameters, Milliseconds timeout = Milliseconds{0});
  /// With frames of the caller's own camera.
  AutofocusResult Autofocus(const AutofocusBeginParameters& parameters, const Grab& grab,
                            Milliseconds timeout = Milliseconds{0});

  Picture Snapshot(const SnapshotParameters& parameters, Milliseconds timeout = Milliseconds{0});
  /// Frames beside the socket: their pixels are lensd's memory, and nothing is copied. `timeout` is for each picture.
  View OpenView(const ViewParameters& parameters, Milliseconds timeout = Milliseconds{0});
  /// `timeout` is for each event, 0: for ever.
  Monitor OpenMonitor(const std::string& lens = "", Milliseconds timeout = Milliseconds{0});

 private:
  void CallInto(const char* method, const Value& parameters, Milliseconds timeout, Value& reply);
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// For PlanParameters: the blur is at most (at least) `limit` ("8um", "1.5px") everywhere in `where` ("2m..3m",
/// "4m..inf", "1.5D").
LENSD_API BlurLimit Sharp(const std::string& where, const std::string& limit);
LENSD_API BlurLimit Blurred(const std::string& where, const std::string& limit);

}  // namespace v1
}  // namespace lensd

#endif
