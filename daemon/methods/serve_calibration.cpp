// GetCalibration, Calibrate, MeasureBacklash: what is known of a lens, how it comes to be known, and where it is kept.
#include <ctime>
#include <memory>
#include <utility>
#include <vector>

#include "base/guarded.h"
#include "base/missing_optics.h"
#include "base/quantity_text.h"
#include "daemon/methods/lens_service.h"
#include "daemon/methods/serve.h"
#include "daemon/pictures/picture.h"
#include "daemon/wire/autofocus_request.h"
#include "daemon/wire/lens_json.h"
#include "io/toml.h"
#include "optics/focus_scale.h"
#include "rig/backlash.h"

namespace lensd::daemon {
namespace {

using drivers::Axis;
using drivers::Direction;
using varlink::Json;

// What follows from a calibration is worked out between two readings of the lens, and a stop waits for that.
constexpr std::size_t kMostPoints = 1000;
constexpr std::size_t kMostPointsInAll = 10'000;

constexpr int kFewestPairs = 3;
constexpr int kMostPairs = 100;

std::string Today() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[32];
  return {text, std::strftime(text, sizeof text, "%Y-%m-%d", &utc)};
}

Result<rig::FocusPoint> PointOf(const Json& json, const std::string& path, const optics::FocusScale& scale,
                                Metres focal_length) {
  rig::FocusPoint point{Native{json["position"].get<double>()}, {}, {}};
  if (const Json* mm = Given(json, "extensionMm")) point.extension = Metres{mm->get<double>() * 1e-3};
  if (const Json* vergence = Given(json, "vergenceD")) point.vergence = Dioptres{vergence->get<double>()};
  if (const Json* metres = Given(json, "distanceM")) {
    if (point.vergence) return PassOn(Wrong("a point has exactly one depth", {.parameter = path}));
    const auto depth = optics::DepthInFocus(scale, focal_length, Metres{metres->get<double>()});
    if (!depth) return PassOn(About(path + ".distanceM", depth.error()));
    point.vergence = depth->vergence();
  }
  return point;
}

/// A point beyond the ends of focus would bend the curve by a place that the motor never reaches: a slip of the pen.
Result<void> IsOnAxis(Native position, std::size_t index, const drivers::AxisCapabilities& axis) {
  const double low = axis.minimum.value, high = axis.maximum.value;
  if (position.value >= low && position.value <= high) return {};
  const std::string unit(UnitName(axis.unit));
  return Fail(Code::OutOfRange,
              "a calibration point is at position " + Short(position.value, 6) + ", but focus reaches " +
                  Short(low, 6) + " to " + Short(high, 6) + " " + unit,
              {.axis = "focus",
               .parameter = "points[" + std::to_string(index) + "].position",
               .minimum = low,
               .maximum = high,
               .unit = unit});
}

/// The curve of `points` for the zoom, filter and temperature of this moment, in place of the one that was measured
/// there before at any temperature.
Result<std::optional<rig::Calibration>> WithCurve(rig::Calibration calibration, const rig::Rig& rig,
                                                  const Json& parameters, const rig::RigConfig& config) {
  const rig::Status status = rig.GetStatus();
  if (!rig.optics()) {
    return Fail(Code::Unsupported, OpticsMissing("the optics of this lens are"));
  }
  if (!rig.lens().axes[Axis::Focus]) return Fail(Code::Unsupported, "this lens has no motorised focus");
  const Metres focal_length = rig.optics()->focal_length();
  optics::FocusScale scale = config.scale;
  scale.from = OriginOf(parameters).value_or(scale.from);
  scale.centre_shift = rig.optics()->centre_shift();
  std::vector<rig::FocusPoint> points;
  for (const Json& json : *Given(parameters, "points")) {
    const auto point = PointOf(json, "points[" + std::to_string(points.size()) + "]", scale, focal_length);
    if (!point) return PassOn(point);
    if (auto inside = IsOnAxis(point->position, points.size(), *rig.lens().axes[Axis::Focus]); !inside) {
      return PassOn(inside);
    }
    points.push_back(*point);
  }
  std::optional<Metres> error;
  if (const Json* um = Given(parameters, "errorUm")) {
    if (!(um->get<double>() >= 0.0)) {
      return PassOn(Wrong("errorUm must not be negative", {.parameter = "errorUm", .minimum = 0.0, .unit = "um"}));
    }
    error = Metres{um->get<double>() * 1e-6};
  }
  auto curve = rig::FitFocusCurve(std::move(points), focal_length, error, rig.lens().axes[Axis::Focus]->resolution);
  if (!curve) return PassOn(About("points", curve.error()));
  if (!rig.optics()->has_zoom()) curve->focal_length.reset();
  curve->approach_near = rig.approaches_up(Axis::Focus) == (rig::DirectionOf(*curve) != Direction::NearNegative);
  if (status.axes[Axis::Filter]) curve->filter = status.axes[Axis::Filter]->position.value;
  curve->wavelength = config.wavelength;
  curve->temperature = status.temperature;
  std::erase_if(calibration.focus, [&](rig::FocusCurve old) {
    old.temperature = curve->temperature;
    return old.SameConditions(*curve);
  });
  const Json* approximate = Given(parameters, "approximate");
  calibration.grade =
      approximate != nullptr && approximate->get<bool>() ? rig::Grade::Approximate : rig::Grade::Calibrated;
  const Json* made = Given(parameters, "made");
  calibration.made = Today() + (made != nullptr ? " " + made->get<std::string>() : "");
  calibration.Put(*std::move(curve));
  return calibration;
}

std::size_t PointsIn(const rig::Calibration& calibration) {
  std::size_t points = 0;
  for (const rig::FocusCurve& curve : calibration.focus) points += curve.points.size();
  return points;
}

Result<rig::Calibration> FromToml(const std::string& text) {
  const auto settings = io::ParseToml(text, "calibration");
  if (!settings) return Fail(Code::BadData, settings.error().message);
  auto calibration = rig::ReadCalibration(*settings);
  if (!calibration) return Fail(Code::BadData, calibration.error().message);
  if (PointsIn(*calibration) > kMostPointsInAll) {
    return Fail(Code::BadData,
                "calibration: its curves have more than " + std::to_string(kMostPointsInAll) + " points in all");
  }
  return calibration;
}

Json BacklashJson(const std::string& lens, Axis axis, const rig::BacklashOutcome& outcome) {
  Json result{{"lens", lens},
              {"axis", drivers::AxisName(axis)},
              {"known", outcome.measured},
              {"measured", outcome.measured && outcome.backlash.measured},
              {"frames", outcome.frames},
              {"elapsedMs", std::chrono::duration<double, std::milli>(outcome.elapsed).count()},
              {"cause", TextOrNull(std::string(BacklashCauseName(outcome.cause)))},
              {"reason", TextOrNull(outcome.reason)}};
  if (outcome.measured) {
    result["size"] = varlink::NumberOrNull(outcome.backlash.steps);
    result["sizeLow"] = varlink::NumberOrNull(outcome.backlash.low);
    result["sizeHigh"] = varlink::NumberOrNull(outcome.backlash.high);
  }
  return result;
}

/// What positions mean does not change under an axis that moves.
ServedLens::EditCalibration AtRest(ServedLens::EditCalibration edit) {
  return
      [edit = std::move(edit)](rig::Calibration now, const rig::Rig& rig) -> Result<std::optional<rig::Calibration>> {
        if (auto busy = rig.WhyNotAtRest()) return PassOn(*std::move(busy));
        return edit(std::move(now), rig);
      };
}

/// Answers with the calibration in force, and with what else there is to say.
void AnswerWithCalibration(ServedLens& lens, const ExchangePointer& exchange, const Json& more) {
  struct InForce {
    rig::Status status;
    std::shared_ptr<const rig::Calibration> calibration;
  };
  const auto ask = [](rig::Rig& rig, auto done) { done(InForce{rig.GetStatus(), rig.calibration()}); };
  lens.Ask<InForce>(ask, [exchange, &lens, more](const Result<InForce>& now) {
    if (!now) return Refuse(exchange, lens, now.error());
    const auto& optics = now->status.optics;
    const auto error = optics ? optics->error() : std::nullopt;
    const std::string& file = lens.calibration_mark().path;
    Json info{{"lens", lens.name()},
              {"grade", GradeName(optics ? optics->grade() : rig::Grade::Uncalibrated)},
              {"errorUm", error ? varlink::NumberOrNull(error->value * 1e6) : Json(nullptr)},
              {"file", file.empty() ? Json(nullptr) : Json(file)},
              {"toml", now->calibration ? Json(rig::CalibrationText(*now->calibration)) : Json(nullptr)}};
    Json reply{{"calibration", std::move(info)}};
    reply.update(more);
    exchange->Finish(varlink::WriteJson(reply));
  });
}

void Calibration(ServedLens& lens, const ExchangePointer& exchange) {
  AnswerWithCalibration(lens, exchange, Json::object());
}

/// What a calibration holds, in words for people.
std::vector<std::string> CurvesIn(const rig::Calibration& calibration) {
  std::vector<std::string> parts;
  for (const rig::FocusCurve& curve : calibration.focus) {
    parts.push_back("the curve of focus through " + std::to_string(curve.points.size()) + " points" +
                    (calibration.made.empty() ? "" : " (" + calibration.made + ")"));
  }
  if (calibration.iris) parts.emplace_back("the curve of the iris");
  if (calibration.zoom) parts.emplace_back("the curve of the zoom");
  if (!calibration.breathing.empty()) parts.emplace_back("breathing");
  if (calibration.temperature) parts.emplace_back("the drift with temperature");
  return parts;
}

std::vector<std::string> MeasuredIn(const rig::Calibration& calibration) {
  std::vector<std::string> parts;
  for (const Axis axis : drivers::kAxes) {
    const auto& backlash = calibration.backlash[axis];
    if (!backlash) continue;
    parts.push_back("the backlash of " + std::string(drivers::AxisName(axis)) + " (" + Short(backlash->steps) +
                    " steps)");
  }
  const auto count = [&](std::size_t number, const std::string& one, const std::string& many) {
    if (number > 0) parts.push_back(number == 1 ? "1 " + one : std::to_string(number) + " " + many);
  };
  count(calibration.focus_shifts.size(), "focus shift", "focus shifts");
  count(calibration.focus_at ? calibration.focus_at->samples.size() : 0, "sample of focus-at", "samples of focus-at");
  return parts;
}

/// Removes the curves, and what was measured besides unless it is to be kept; answers with what went and what stays.
void RemoveCalibration(ServedLens& lens, const ExchangePointer& exchange, bool keep_measured) {
  struct Parts {
    std::vector<std::string> removed, kept;
  };
  const auto parts = std::make_shared<Parts>();
  const auto edit = [parts, keep_measured](const rig::Calibration& now,
                                           const rig::Rig&) -> Result<std::optional<rig::Calibration>> {
    *parts = {CurvesIn(now), {}};
    std::vector<std::string> measured = MeasuredIn(now);
    if (!keep_measured) parts->removed.insert(parts->removed.end(), measured.begin(), measured.end());
    if (!keep_measured || measured.empty()) return std::nullopt;
    parts->kept = std::move(measured);
    rig::Calibration left;
    left.serial = now.serial;
    left.backlash = now.backlash;
    left.focus_shifts = now.focus_shifts;
    left.focus_at = now.focus_at;
    return left;
  };
  lens.ChangeCalibration(AtRest(edit), [exchange, &lens, parts](const Result<void>& changed) {
    if (!changed) return Refuse(exchange, lens, changed.error());
    AnswerWithCalibration(lens, exchange, {{"removed", parts->removed}, {"kept", parts->kept}});
  });
}

/// Puts it in force, keeps it and answers with it.
void Change(ServedLens& lens, const ExchangePointer& exchange, ServedLens::EditCalibration edit) {
  lens.ChangeCalibration(AtRest(std::move(edit)), [exchange, &lens](const Result<void>& changed) {
    if (!changed) return Refuse(exchange, lens, changed.error());
    Calibration(lens, exchange);
  });
}

/// A megabyte takes longer to read than a stop may wait, for the worker or for the event loop.
void ReadAndChange(ServedLens& lens, const ExchangePointer& exchange, std::string text) {
  auto read_and_post = [&lens, exchange = ExchangePointer(exchange), text = std::move(text)]() mutable {
    Result<rig::Calibration> read = Fail(Code::Internal, "");
    if (const auto thrown = Guarded(lens.name(), [&] { read = FromToml(text); })) read = PassOn(*thrown);
    // The call is let go of where calls live: nothing of it stays on this thread.
    lens.surroundings().loop.Post([&lens, held = std::move(exchange), read = std::move(read)] {
      if (!read) return Refuse(held, lens, read.error());
      Change(lens, held, [read](const rig::Calibration&, const rig::Rig&) -> Result<std::optional<rig::Calibration>> {
        return std::optional(*read);
      });
    });
  };
  const bool taken = lens.surroundings().plans.Submit(std::move(read_and_post));
  if (!taken) Refuse(exchange, lens, {Code::Busy, "too much waits to be worked out; try again"});
}

/// While it moves nothing is read: it would be for nothing.
void CalibrateByFile(ServedLens& lens, const ExchangePointer& exchange, std::string text) {
  const auto ask = [](rig::Rig& rig, auto done) {
    auto busy = rig.WhyNotAtRest();
    busy ? done(PassOn(*std::move(busy))) : done(rig.GetStatus().connected);
  };
  lens.Ask<bool>(ask, [exchange, &lens, text = std::move(text)](const Result<bool>& asked) mutable {
    asked ? ReadAndChange(lens, exchange, std::move(text)) : Refuse(exchange, lens, asked.error());
  });
}

void Calibrate(ServedLens& lens, const ExchangePointer& exchange) {
  const Json& parameters = exchange->parameters();
  const Json* toml = Given(parameters, "toml");
  const Json* points = Given(parameters, "points");
  const Json* remove = Given(parameters, "remove");
  const bool removes = remove != nullptr && remove->get<bool>();
  if ((toml != nullptr) + (points != nullptr) + removes != 1) {
    return Refuse(exchange, lens, {Code::InvalidArgument, "say exactly one of toml, points and remove"});
  }
  if (points != nullptr && points->size() > kMostPoints) {
    return Refuse(
        exchange, lens,
        Wrong("a curve has at most 1000 points", {.parameter = "points", .maximum = static_cast<double>(kMostPoints)}));
  }
  if (toml != nullptr) return CalibrateByFile(lens, exchange, toml->get<std::string>());
  const Json* keep = Given(parameters, "keepMeasured");
  if (removes) return RemoveCalibration(lens, exchange, keep != nullptr && keep->get<bool>());
  Change(lens, exchange, [parameters, config = lens.config().rig](rig::Calibration now, const rig::Rig& rig) {
    return WithCurve(std::move(now), rig, parameters, config);
  });
}

/// How the backlash in an outcome came to be known: what was measured counts though an axis moves again already.
enum class Origin { Measured, Said };

/// A reversal that lost more than a tenth of the travel would be no lens to work with: a slip of the pen.
Result<void> FitsTravel(double backlash, const drivers::AxisCapabilities& axis) {
  const double most = 0.1 * (axis.maximum.value - axis.minimum.value);
  if (backlash <= most) return {};
  const std::string unit(UnitName(axis.unit));
  return Fail(Code::OutOfRange,
              "a backlash of more than a tenth of the travel is refused: " + std::to_string(std::lround(most)) + " " +
                  unit + " at most",
              {.parameter = "size", .minimum = 0.0, .maximum = most, .unit = unit});
}

/// Keeps what is known now, and answers with it.
void FinishBacklash(ServedLens& lens, const ExchangePointer& exchange, Axis axis, rig::BacklashOutcome outcome,
                    Origin origin) {
  const auto tell = [exchange, &lens, axis](const rig::BacklashOutcome& ended) {
    const Json result = BacklashJson(lens.name(), axis, ended);
    exchange->Finish(varlink::WriteJson({{"backlash", result}}));
    lens.watchers().Announce(lens, "backlash", result);
  };
  if (!outcome.measured) return tell(outcome);
  const auto& configured = lens.config().rig.axes[axis].backlash;
  if (configured) {
    outcome.cause = rig::BacklashCause::Configured;
    outcome.reason = "the configuration says backlash = " + std::to_string(static_cast<long>(*configured)) +
                     ", which stays in force: say \"auto\" there to use this";
  }
  const ServedLens::EditCalibration edit = [axis, backlash = outcome.backlash](
                                               rig::Calibration now,
                                               const rig::Rig& rig) -> Result<std::optional<rig::Calibration>> {
    if (!rig.lens().axes[axis]) {
      return Fail(Code::Unsupported, "this lens has no motorised " + std::string(drivers::AxisName(axis)));
    }
    if (!(backlash.steps >= 0.0)) {
      return PassOn(
          Wrong("size must not be negative",
                {.parameter = "size", .minimum = 0.0, .unit = std::string(UnitName(rig.lens().axes[axis]->unit))}));
    }
    if (auto fits = FitsTravel(backlash.steps, *rig.lens().axes[axis]); !fits) return PassOn(fits);
    now.backlash[axis] = backlash;
    return now;
  };
  const auto kept = [&lens, exchange, tell, outcome](const Result<void>& changed) {
    if (!changed) return Refuse(exchange, lens, changed.error());
    tell(outcome);
  };
  lens.ChangeCalibration(origin == Origin::Said ? AtRest(edit) : edit, kept);
}

std::function<void(const rig::BacklashProgress&)> BacklashProgressTo(ServedLens& lens, std::weak_ptr<Exchange> call) {
  return [&lens, call = std::move(call)](const rig::BacklashProgress& now) {
    Json json{{"sweep", now.sweep}, {"sweepsExpected", now.of}, {"frames", now.frames}};
    Worker::Later([&lens, call, progress = std::move(json)] {
      const auto exchange = call.lock();
      if (exchange && exchange->call().more) exchange->Continue(Wrap("progress", varlink::WriteJson(progress)));
      lens.watchers().TellProgress(lens, Procedure::Backlash, progress);
    });
  };
}

void MeasureBacklash(ServedLens& lens, const ExchangePointer& exchange) {
  const Json& parameters = exchange->parameters();
  rig::BacklashRequest request;
  if (const Json* pairs = Given(parameters, "pairs")) {
    const auto count = pairs->get<std::int64_t>();
    if (count < kFewestPairs || count > kMostPairs) {
      return Refuse(
          exchange, lens,
          Wrong("pairs is from 3 to 100", {.parameter = "pairs", .minimum = kFewestPairs, .maximum = kMostPairs}));
    }
    request.pairs = static_cast<int>(count);
  }
  if (const Json* region = Given(parameters, "region")) {
    const auto part = RegionOf(*region, "region");
    if (!part) return Refuse(exchange, lens, part.error());
    request.region = *part;
  }
  auto ended = std::make_shared<bool>(false);  // the worker's thread
  const auto measure = [request, progress = BacklashProgressTo(lens, exchange), ended](rig::Rig& rig, auto done) {
    if (auto busy = rig.WhyNotAtRest()) {
      *ended = true;
      return done(PassOn(*std::move(busy)));
    }
    rig::MeasureBacklash(rig, request, progress,
                         [ended, done = std::move(done)](Result<rig::BacklashOutcome> outcome) mutable {
                           *ended = true;
                           done(std::move(outcome));
                         });
  };
  lens.Ask<rig::BacklashOutcome>(measure, [exchange, &lens](const Result<rig::BacklashOutcome>& outcome) {
    if (!outcome) return Refuse(exchange, lens, AsAskedOfAutofocus(outcome.error(), exchange->parameters()));
    FinishBacklash(lens, exchange, Axis::Focus, *outcome, Origin::Measured);
  });
  exchange->OnGone([&lens, ended] { StopUnlessEnded(lens, ended, {}); });
}

void Backlash(ServedLens& lens, const ExchangePointer& exchange) {
  const Json& parameters = exchange->parameters();
  const Json* named = Given(parameters, "axis");
  const Axis axis = named != nullptr ? *drivers::AxisFromName(named->get_ref<const std::string&>()) : Axis::Focus;
  const Json* size = Given(parameters, "size");
  if (size == nullptr) {
    if (axis == Axis::Focus) return MeasureBacklash(lens, exchange);
    return Refuse(exchange, lens,
                  {Code::Unsupported,
                   "only the backlash of focus can be measured by looking; say how many "
                   "steps it is instead"});
  }
  rig::BacklashOutcome said;
  said.measured = true;
  said.backlash.steps = said.backlash.low = said.backlash.high = size->get<double>();
  FinishBacklash(lens, exchange, axis, std::move(said), Origin::Said);
}

}  // namespace

MethodTable CalibrationMethods(LensService& service) {
  return {{"GetCalibration", service.ForLens(Calibration)},
          {"Calibrate", service.ForLens(Calibrate)},
          {"MeasureBacklash", service.ForLens(Backlash)}};
}

}  // namespace lensd::daemon
