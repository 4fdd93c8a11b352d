// AutofocusBegin, AutofocusPixels, AutofocusFrame, AutofocusScore, AutofocusEnd: an autofocus whose camera belongs to
// the client. The rig's run is the same as with a camera of its own; here its wish for a frame becomes the answer to
// the client's last call, and the client's next call becomes the frame.
#include <algorithm>
#include <map>
#include <span>
#include <tuple>
#include <utility>

#include "autofocus/picture_lag.h"
#include "daemon/methods/lens_service.h"
#include "daemon/methods/serve.h"
#include "daemon/wire/autofocus_request.h"
#include "daemon/wire/lens_json.h"
#include "drivers/pixels/sizes.h"
#include "varlink/base64.h"

namespace lensd::daemon {
namespace {

using varlink::Json;

constexpr std::size_t kMostSessions = 8;
constexpr std::size_t kMostBytes = std::size_t{8} << 20;  ///< of one frame
constexpr double kDefaultSigma = 0.01;                    ///< of a score

/// What such a session was asked for, as far as it can be done once more.
rig::AutofocusRequest FramesDoNotComeAgain() {
  rig::AutofocusRequest asked;
  asked.outside.emplace();
  return asked;
}

/// Without pixelUm the lens' own camera counts.
Result<rig::OutsideCamera> CameraOf(const Json& parameters) {
  rig::OutsideCamera camera;
  if (const Json* pixel = Given(parameters, "pixelUm")) {
    camera.pixel_um = pixel->get<double>();
    if (!(camera.pixel_um > 0)) return PassOn(Wrong("pixelUm must be above 0", {.parameter = "pixelUm"}));
  }
  if (const Json* scores = Given(parameters, "scores")) camera.scores_only = scores->get<bool>();
  const Json* lag = Given(parameters, "lagFrames");
  if (lag == nullptr) return camera;
  const auto frames = lag->get<std::int64_t>();
  if (frames < 0 || frames > autofocus::kMostLagFrames) {
    return PassOn(
        Wrong("lagFrames must be from 0 to " + std::to_string(autofocus::kMostLagFrames),
              {.parameter = "lagFrames", .minimum = 0.0, .maximum = autofocus::kMostLagFrames, .unit = "frames"}));
  }
  camera.lag_frames = static_cast<int>(frames);
  return camera;
}

Error TooLarge() {
  return Fail(Code::OutOfRange, "a frame may have 8 MiB: send only the region",
              {.parameter = "data", .maximum = static_cast<double>(kMostBytes), .unit = "bytes"})
      .error();
}

struct Format {
  std::string_view name;
  int bits;
  std::size_t bytes;
};
constexpr Format kFormats[] = {{"mono8", 8, 1}, {"mono10le", 10, 2}, {"mono12le", 12, 2}, {"mono16le", 16, 2}};

/// Exposure start and end, checked against each other and the clock.
Result<std::pair<Instant, Instant>> ExposureOf(const Json& parameters, Instant now) {
  const Instant start{Duration(parameters["exposureStartNs"].get<std::int64_t>())};
  const Instant end{Duration(parameters["exposureEndNs"].get<std::int64_t>())};
  if (start < Instant{}) {
    return PassOn(Wrong("exposure times count from the start of CLOCK_MONOTONIC", {.parameter = "exposureStartNs"}));
  }
  if (end < start) {
    return PassOn(Wrong("the exposure ends before it begins", {.parameter = "exposureEndNs"}));
  }
  if (end > now) {
    return PassOn(Wrong("the exposure ends in the future: give its times in ns on CLOCK_MONOTONIC",
                        {.parameter = "exposureEndNs"}));
  }
  return std::pair(start, end);
}

/// Samples of a frame from its bytes.
Result<drivers::Frame> FrameOf(const Json& parameters, std::span<const std::uint8_t> bytes) {
  const auto width = parameters["widthPx"].get<std::int64_t>();
  const auto height = parameters["heightPx"].get<std::int64_t>();
  const Format& format = *std::ranges::find(kFormats, parameters["format"].get<std::string>(), &Format::name);
  constexpr std::int64_t kMostSide = 1 << 16;
  if (width < 1 || height < 1 || width > kMostSide || height > kMostSide) {
    return PassOn(Wrong("widthPx and heightPx must be from 1 to 65536",
                        {.parameter = width < 1 || width > kMostSide ? "widthPx" : "heightPx",
                         .minimum = 1.0,
                         .maximum = kMostSide,
                         .unit = "px"}));
  }
  const auto row = static_cast<std::size_t>(width) * format.bytes;
  std::size_t stride = row;
  if (const Json* given = Given(parameters, "strideBytes")) {
    if (given->get<std::int64_t>() < static_cast<std::int64_t>(row)) {
      return PassOn(Wrong("strideBytes is less than a row of pixels needs",
                          {.parameter = "strideBytes", .minimum = static_cast<double>(row), .unit = "bytes"}));
    }
    stride = static_cast<std::size_t>(given->get<std::int64_t>());
  }
  if (auto why = drivers::pixels::WhyNotRows(bytes.size(),
                                             {static_cast<int>(width), static_cast<int>(height), row, stride, 0})) {
    return Fail(Code::InvalidArgument, *std::move(why));
  }
  drivers::Frame frame;
  frame.width = static_cast<int>(width);
  frame.height = static_cast<int>(height);
  frame.bits = format.bits;
  if (const Json* gamma = Given(parameters, "gamma")) frame.gamma = gamma->get<double>();
  if (!(frame.gamma > 0 && frame.gamma < 10)) {
    return PassOn(Wrong("gamma must be above 0 and below 10", {.parameter = "gamma"}));
  }
  auto samples = std::make_shared<std::vector<std::uint16_t>>();
  samples->reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  const auto full = static_cast<std::uint16_t>((1u << format.bits) - 1u);
  for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) {
    const std::uint8_t* at = bytes.data() + y * stride;
    for (std::size_t x = 0; x < static_cast<std::size_t>(width); ++x, at += format.bytes) {
      const unsigned value = format.bytes == 1 ? at[0] : at[0] | (unsigned{at[1]} << 8);
      if (value > full) {
        return Fail(Code::InvalidArgument, "a pixel is above the full scale of " + std::string(format.name));
      }
      samples->push_back(static_cast<std::uint16_t>(value));
    }
  }
  frame.samples = std::move(samples);
  return frame;
}

/// What a session is between the client's calls. Event loop thread only.
struct FrameSession {
  std::int64_t number = 0;
  ServedLens* lens = nullptr;
  const void* peer = nullptr;
  ExchangePointer begun;    ///< the call that began it: as long as this lasts, that drives the lens
  ExchangePointer waiting;  ///< the call that the next wish or the end will answer; null: the client has its wish
  std::vector<std::uint8_t> pixels;
  std::optional<Result<rig::AutofocusOutcome>> end;                    ///< that no client was there to hear
  std::shared_ptr<bool> ended_in_rig = std::make_shared<bool>(false);  ///< the worker's thread
};

using FrameSessionPointer = std::shared_ptr<FrameSession>;

/// The sessions that are open, and the calls that drive them. Event loop thread only.
class FrameSessions {
 public:
  explicit FrameSessions(LensService& service) : service_(service) {}

  void Begin(const ExchangePointer& exchange);
  void Pixels(const ExchangePointer& exchange);
  void Frame(const ExchangePointer& exchange);
  void Score(const ExchangePointer& exchange);
  void End(const ExchangePointer& exchange);

 private:
  FrameSessionPointer FindSession(const ExchangePointer& exchange);
  template <class Command>
  void Give(const FrameSessionPointer& session, const ExchangePointer& exchange, Command give);
  void Conclude(const FrameSessionPointer& session, const ExchangePointer& exchange);
  void EndSession(const FrameSessionPointer& session);

  LensService& service_;
  std::map<std::int64_t, FrameSessionPointer> sessions_;
  std::int64_t last_session_ = 0;
};

/// The rig's next wish answers the call that waits for it.
void TellWish(const FrameSessionPointer& session, const Json& wish) {
  const ExchangePointer waiting = std::exchange(session->waiting, nullptr);
  if (!waiting) return;
  Json answer{{"next", wish}};
  if (waiting->call().method.ends_with("Begin")) answer["session"] = session->number;
  waiting->Finish(varlink::WriteJson(answer));
}

void FrameSessions::Begin(const ExchangePointer& exchange) {
  ServedLens* const lens = service_.FindPresent(exchange);
  if (lens == nullptr) return;
  const Json& parameters = exchange->parameters();
  auto request = AutofocusRequestOf(parameters);
  if (!request) return Refuse(exchange, *lens, request.error());
  auto camera = CameraOf(parameters);
  if (!camera) return Refuse(exchange, *lens, camera.error());
  if (exchange->peer() == nullptr) return exchange->Finish("{}");  // oneway: no client could answer
  if (sessions_.size() >= kMostSessions) {
    return Refuse(exchange, *lens,
                  {Code::Busy, "too many autofocus sessions are open: end one, or close its connection"});
  }
  auto session = std::make_shared<FrameSession>();
  session->number = ++last_session_;
  session->lens = lens;
  session->peer = exchange->peer();
  session->begun = exchange;
  session->waiting = exchange;
  sessions_[session->number] = session;
  exchange->AtClose(static_cast<std::uint64_t>(session->number), [this, session] { EndSession(session); });

  request->slopes = lens->users().slope->ForSearches();
  request->lags = lens->users().slope->lags();
  request->outside = *std::move(camera);
  request->outside->wanted = [session](const rig::FrameWanted& wanted) {
    Worker::Later([session, json = FrameWantedJson(wanted)] { TellWish(session, json); });
  };
  auto progress = [lens](const rig::AutofocusProgress& now) {
    Worker::Later([lens, json = AutofocusProgressJson(now)] {
      lens->watchers().TellProgress(*lens, Procedure::Autofocus, json);
    });
  };
  auto run = [request = *std::move(request), progress, ended = session->ended_in_rig](rig::Rig& rig,
                                                                                      auto done) mutable {
    if (request.outside->pixel_um == 0 && rig.camera() != nullptr) request.outside->pixel_um = rig.camera()->pixel_um;
    if (auto busy = rig.WhyNotFocused()) {
      *ended = true;
      return done(PassOn(*std::move(busy)));
    }
    rig.Autofocus(std::move(request), std::move(progress),
                  [ended, done = std::move(done)](Result<rig::AutofocusOutcome> outcome) mutable {
                    *ended = true;
                    done(std::move(outcome));
                  });
  };
  lens->Ask<rig::AutofocusOutcome>(std::move(run), [this, lens, session](const Result<rig::AutofocusOutcome>& outcome) {
    if (outcome) {
      NoteFocusFound(*lens, FramesDoNotComeAgain(), *outcome);
      lens->watchers().Announce(*lens, "autofocus", AutofocusJson(lens->name(), *outcome));
    }
    session->end = outcome;
    // Without the call its connection has closed: no client is left to hear.
    if (!outcome && session->begun) {
      session->end = PassOn(AsAskedOfAutofocus(outcome.error(), session->begun->parameters()));
    }
    session->begun = nullptr;
    if (session->waiting) Conclude(session, std::exchange(session->waiting, nullptr));
  });
}

/// Tells the end of a session, once, and forgets it.
void FrameSessions::Conclude(const FrameSessionPointer& session, const ExchangePointer& exchange) {
  exchange->AtClose(static_cast<std::uint64_t>(session->number), {});
  sessions_.erase(session->number);
  if (!*session->end) return Refuse(exchange, *session->lens, session->end->error());
  exchange->Finish(varlink::WriteJson(Json{{"autofocus", AutofocusJson(session->lens->name(), **session->end)}}));
}

/// The session the call means; else answers the call with why not and returns null.
FrameSessionPointer FrameSessions::FindSession(const ExchangePointer& exchange) {
  const auto number = exchange->parameters()["session"].get<std::int64_t>();
  const auto found = sessions_.find(number);
  if (found != sessions_.end() && found->second->peer == exchange->peer()) return found->second;
  Refuse(exchange, Wrong("this connection has no autofocus session " + std::to_string(number) +
                             ": it has ended, or belongs to another connection",
                         {.parameter = "session"}));
  return nullptr;
}

void FrameSessions::Pixels(const ExchangePointer& exchange) {
  const FrameSessionPointer session = FindSession(exchange);
  if (!session) return;
  auto bytes = varlink::DecodeBase64(exchange->parameters()["data"].get_ref<const std::string&>());
  if (!bytes) return Refuse(exchange, *session->lens, Wrong(bytes.error().message, {.parameter = "data"}));
  const auto offset = exchange->parameters()["offset"].get<std::int64_t>();
  if (offset == 0) session->pixels.clear();
  if (offset != static_cast<std::int64_t>(session->pixels.size())) {
    return Refuse(exchange, *session->lens,
                  Wrong("the next piece begins at offset " + std::to_string(session->pixels.size()) + ", or again at 0",
                        {.parameter = "offset"}));
  }
  if (session->pixels.size() + bytes->size() > kMostBytes) {
    return Refuse(exchange, *session->lens, TooLarge());
  }
  session->pixels.insert(session->pixels.end(), bytes->begin(), bytes->end());
  exchange->Finish(varlink::WriteJson(Json{{"received", session->pixels.size()}}));
}

/// Passes a frame on. If the rig will not have it the call ends with the reason; else with the next wish or the end.
template <class Command>
void FrameSessions::Give(const FrameSessionPointer& session, const ExchangePointer& exchange, Command give) {
  session->waiting = exchange;
  session->lens->Ask<void>(std::move(give), [this, session, exchange](const Result<void>& taken) {
    if (taken || session->waiting != exchange) return;
    if (session->end) return Conclude(session, std::exchange(session->waiting, nullptr));
    session->waiting = nullptr;
    Refuse(exchange, *session->lens, taken.error());
  });
}

void FrameSessions::Frame(const ExchangePointer& exchange) {
  const FrameSessionPointer session = FindSession(exchange);
  if (!session) return;
  if (session->end) return Conclude(session, exchange);
  std::vector<std::uint8_t> bytes = std::exchange(session->pixels, {});
  if (const Json* data = Given(exchange->parameters(), "data")) {
    auto last = varlink::DecodeBase64(data->get_ref<const std::string&>());
    if (!last) return Refuse(exchange, *session->lens, Wrong(last.error().message, {.parameter = "data"}));
    bytes.insert(bytes.end(), last->begin(), last->end());
  }
  if (bytes.size() > kMostBytes) {
    return Refuse(exchange, *session->lens, TooLarge());
  }
  const auto exposure = ExposureOf(exchange->parameters(), service_.clock().Now());
  if (!exposure) return Refuse(exchange, *session->lens, exposure.error());
  auto frame = FrameOf(exchange->parameters(), bytes);
  if (!frame) return Refuse(exchange, *session->lens, About("data", frame.error()));
  std::tie(frame->exposure_start, frame->exposure_end) = *exposure;
  Give(session, exchange, [frame = *std::move(frame)](rig::Rig& rig, auto taken) mutable {
    rig.GiveFrame(std::move(frame), std::move(taken));
  });
}

void FrameSessions::Score(const ExchangePointer& exchange) {
  const FrameSessionPointer session = FindSession(exchange);
  if (!session) return;
  if (session->end) return Conclude(session, exchange);
  rig::OutsideScore score;
  score.sharpness = exchange->parameters()["sharpness"].get<double>();
  score.sigma = kDefaultSigma * score.sharpness;
  if (const Json* sigma = Given(exchange->parameters(), "sigma")) score.sigma = sigma->get<double>();
  if (!(score.sharpness > 0) || !(score.sigma > 0)) {
    return Refuse(
        exchange, *session->lens,
        Wrong("sharpness and sigma must be above 0", {.parameter = score.sharpness > 0 ? "sigma" : "sharpness"}));
  }
  const auto exposure = ExposureOf(exchange->parameters(), service_.clock().Now());
  if (!exposure) return Refuse(exchange, *session->lens, exposure.error());
  std::tie(score.exposure_start, score.exposure_end) = *exposure;
  Give(session, exchange, [score](rig::Rig& rig, auto taken) { rig.GiveScore(score, std::move(taken)); });
}

void FrameSessions::End(const ExchangePointer& exchange) {
  const FrameSessionPointer session = FindSession(exchange);
  if (!session) return;
  exchange->AtClose(static_cast<std::uint64_t>(session->number), {});
  EndSession(session);
  exchange->Finish("{}");
}

/// The client has gone or has had enough: an autofocus that still runs is stopped.
void FrameSessions::EndSession(const FrameSessionPointer& session) {
  session->begun = session->waiting = nullptr;
  sessions_.erase(session->number);
  if (session->end) return;
  StopUnlessEnded(*session->lens, session->ended_in_rig, {drivers::Axis::Focus});
}

}  // namespace

MethodTable SessionMethods(LensService& service) {
  const auto sessions = std::make_shared<FrameSessions>(service);
  const auto serve = [sessions, &service](void (FrameSessions::*method)(const ExchangePointer&)) {
    return service.ForPresent([sessions, method](const ExchangePointer& exchange) { (*sessions.*method)(exchange); });
  };
  return {{"AutofocusBegin", serve(&FrameSessions::Begin)},
          {"AutofocusPixels", serve(&FrameSessions::Pixels)},
          {"AutofocusFrame", serve(&FrameSessions::Frame)},
          {"AutofocusScore", serve(&FrameSessions::Score)},
          {"AutofocusEnd", serve(&FrameSessions::End)}};
}

}  // namespace lensd::daemon
