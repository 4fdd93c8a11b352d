// Truth, Inject, Render: from a call to the simulated world behind a lens, past its rig and worker.
#include "daemon/methods/simulator_service.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <utility>

#include "daemon/pictures/picture_transfer.h"
#include "daemon/wire/lens_json.h"
#include "daemon/wire/refusal.h"
#include "proto/interfaces.h"

namespace lensd::daemon {
namespace {

using varlink::Json;

constexpr Duration kLongestRender = std::chrono::seconds(10);
constexpr double kLongestFaultMs = 1e12;  // as in a scene file

std::optional<double> NumberOf(const ExchangePointer& exchange, std::string_view key) {
  const auto given = exchange->view().Given(key);
  return given ? std::optional(given->number()) : std::nullopt;
}

Json PositionJson(const drivers::SimulatedTruth& truth, drivers::Axis axis) {
  return truth.positions[axis] ? varlink::NumberOrNull(truth.positions[axis]->value) : Json(nullptr);
}

Json TruthJson(const drivers::SimulatedTruth& truth) {
  const Json blur_um = truth.blur_m ? varlink::NumberOrNull(1e6 * *truth.blur_m) : Json(nullptr);
  return {{"atNs", truth.at.time_since_epoch().count()},
          {"focusPosition", PositionJson(truth, drivers::Axis::Focus)},
          {"irisPosition", PositionJson(truth, drivers::Axis::Iris)},
          {"zoomPosition", PositionJson(truth, drivers::Axis::Zoom)},
          {"filterPosition", PositionJson(truth, drivers::Axis::Filter)},
          {"extensionMm", 1e3 * truth.extension_m},
          {"fNumber", truth.f_number},
          {"focalLengthMm", 1e3 * truth.focal_length_m},
          {"focalPlaneD", truth.focal_plane_d},
          {"blurUm", blur_um.is_null() ? blur_um : Json(std::abs(blur_um.get<double>()))},
          {"signedBlurUm", blur_um},
          {"picturesKib", truth.pictures_bytes / 1024}};
}

/// The picture, or why there is none, as the answer.
void AnswerPicture(const ExchangePointer& exchange, const Result<Picture>& png) {
  constexpr std::size_t kMostWholeBytes = std::size_t{640} << 10;  // what one message can carry
  if (!png && png.error().code == Code::Cancelled) {
    return Refuse(exchange, {Code::Timeout, "rendering this scene takes more than 10 s"});
  }
  if (!png) return Refuse(exchange, png.error());
  if (exchange->call().more) return SendPieces(exchange, PiecesOf(*png, Json::object(), {.field = "png"}));
  if (png->bytes().size() > kMostWholeBytes) {
    return Refuse(exchange, {Code::OutOfRange, "the picture is larger than one message: ask for it with `more`"});
  }
  SendPieces(exchange, PiecesOf(*png, Json::object(), {.field = "png", .most_bytes = kMostWholeBytes}));
}

}  // namespace

SimulatorService::SimulatorService(LensService& lenses)
    : lenses_(lenses), definition_(BuiltInDefinition(proto::SimulatorInterfaceText())) {
  methods_ =
      Described(definition_.name(), {Row("Truth", &SimulatorService::Truth), Row("Inject", &SimulatorService::Inject),
                                     Row("Render", &SimulatorService::Render)});
}

SimulatorService::~SimulatorService() {
  ending_.request_stop();
}

bool SimulatorService::Offered() const {
  return std::ranges::any_of(lenses_.lenses(),
                             [](const auto& lens) { return lens->config().device.driver->simulated; });
}

Method SimulatorService::Row(std::string_view name, Serve serve) {
  const auto find_and_serve = [this, serve](const ExchangePointer& exchange) {
    const ServedLens* const lens = lenses_.Find(exchange);
    if (lens == nullptr) return;
    const drivers::Driver& driver = *lens->config().device.driver;
    if (!driver.simulated) {
      return Refuse(exchange,
                    {Code::Unsupported, "lens \"" + lens->name() + "\" is real (driver " + std::string(driver.name) +
                                            "): this is for simulated lenses only"});
    }
    if (lens->simulation() == nullptr) return Refuse(exchange, {Code::Disconnected, lens->status().problem});
    (this->*serve)(*lens->simulation(), exchange);
  };
  return {name, lenses_.ForPresent(find_and_serve)};
}

void SimulatorService::Truth(drivers::Simulation& simulation, const ExchangePointer& exchange) {
  std::optional<Instant> at;
  if (const Json* ns = Given(exchange->parameters(), "atNs")) at = Instant(Duration(ns->get<std::int64_t>()));
  const auto truth = simulation.TruthAt(at, NumberOf(exchange, "vergenceD"));
  if (!truth) return Refuse(exchange, truth.error());
  exchange->Finish(varlink::WriteJson(TruthJson(*truth)));
}

void SimulatorService::Inject(drivers::Simulation& simulation, const ExchangePointer& exchange) {
  drivers::SimulatedFault fault{.kind = std::string(exchange->view().Given("kind")->text()),
                                .axis = {},
                                .lasts = {},
                                .steps = NumberOf(exchange, "steps"),
                                .factor = NumberOf(exchange, "factor"),
                                .by_c = NumberOf(exchange, "byC")};
  if (const auto axis = exchange->view().Given("axis")) fault.axis = drivers::AxisFromName(axis->text());
  const double ms = NumberOf(exchange, "forMs").value_or(0.0);
  if (!(ms >= 0.0 && ms <= kLongestFaultMs)) {
    return Refuse(exchange, Wrong("forMs is from 0 (for good) to 1e12", {.parameter = "forMs"}));
  }
  if (ms > 0.0) fault.lasts = Duration(std::max<std::int64_t>(1, std::llround(1e6 * ms)));
  if (const auto injected = simulation.Inject(fault); !injected) return Refuse(exchange, injected.error());
  exchange->Finish("{}");
}

/// On the thread for pictures; called off when it takes too long or the daemon ends.
void SimulatorService::Render(drivers::Simulation& simulation, const ExchangePointer& exchange) {
  const auto shared = simulation.shared_from_this();
  std::stop_source stop;
  lenses_.loop().After(kLongestRender, [stop]() mutable { stop.request_stop(); });
  auto render = [&loop = lenses_.loop(), ending = ending_.get_token(), shared, call = ExchangePointer(exchange),
                 stop]() mutable {
    const std::stop_callback at_end(ending, [&stop] { stop.request_stop(); });
    const auto frame = shared->Render(stop.get_token());
    auto png = frame ? PictureMaker(PictureWish{}).Make(*frame) : Result<Picture>(PassOn(frame));
    // Moved on: calls are let go of where they live.
    loop.Post([held = std::move(call), png = std::move(png)] { AnswerPicture(held, png); });
  };
  const bool taken = pictures_.Submit(std::move(render));
  if (!taken) Refuse(exchange, {Code::Busy, "too many pictures wait to be rendered; try again"});
}

}  // namespace lensd::daemon
