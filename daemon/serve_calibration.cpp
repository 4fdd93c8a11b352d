// Calibration, Calibrate, Backlash: what is known of a lens, how it comes to be known, and where it is kept.
#include <ctime>
#include <utility>

#include "calibration_store.h"
#include "io/toml.h"
#include "lens_entry.h"
#include "lens_json.h"
#include "lens_service.h"
#include "optics/focus_scale.h"
#include "rig/backlash.h"

namespace lensd::daemon {
namespace {

using drivers::Axis;
using proto::Json;

std::string Today() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[32];
  return {text, std::strftime(text, sizeof text, "%Y-%m-%d", &utc)};
}

Result<optics::FocusScale> ScaleOf(const Json& parameters, optics::FocusScale scale) {
  const Json* from = Given(parameters, "distanceFrom");
  if (from == nullptr) return scale;
  const std::string name = from->get<std::string>();
  if (name == "lens")
    scale.from = optics::DistanceFrom::Lens;
  else if (name == "sensor")
    scale.from = optics::DistanceFrom::Sensor;
  else if (name == "front")
    scale.from = optics::DistanceFrom::Front;
  else
    return Fail(Code::InvalidArgument, "distanceFrom is lens, sensor or front");
  return scale;
}

Result<rig::FocusPoint> PointOf(const Json& json, const optics::FocusScale& scale, Metres focal_length) {
  rig::FocusPoint point{Native{json["steps"].get<double>()}, {}, {}};
  if (const Json* mm = Given(json, "extensionMm")) point.extension = Metres{mm->get<double>() * 1e-3};
  if (const Json* vergence = Given(json, "vergenceD")) point.vergence = Dioptres{vergence->get<double>()};
  if (const Json* metres = Given(json, "distanceM")) {
    if (point.vergence) return Fail(Code::InvalidArgument, "a point has exactly one depth");
    const auto depth = optics::DepthInFocus(scale, focal_length, Metres{metres->get<double>()});
    if (!depth) return std::unexpected(depth.error());
    point.vergence = depth->vergence();
  }
  return point;
}

/// The curve of `points` for the zoom, filter and temperature of this moment, in place of the one that was measured
/// there before at any temperature.
Result<std::optional<rig::Calibration>> WithCurve(rig::Calibration calibration, const rig::Rig& rig,
                                                  const Json& parameters, const rig::RigConfig& config) {
  const rig::Status status = rig.GetStatus();
  if (!rig.optics()) {
    return Fail(Code::Unsupported, "the optics of this lens are not known: give it a [lens.optics] section first");
  }
  if (!rig.lens().axes[Axis::Focus]) return Fail(Code::Unsupported, "this lens has no motorised focus");
  const Metres focal_length = rig.optics()->focal_length();
  const auto scale = ScaleOf(parameters, config.scale);
  if (!scale) return std::unexpected(scale.error());
  std::vector<rig::FocusPoint> points;
  for (const Json& json : *Given(parameters, "points")) {
    const auto point = PointOf(json, *scale, focal_length);
    if (!point) return std::unexpected(point.error());
    points.push_back(*point);
  }
  std::optional<Metres> error;
  if (const Json* um = Given(parameters, "errorUm")) {
    if (!(um->get<double>() >= 0.0)) return Fail(Code::InvalidArgument, "errorUm must not be negative");
    error = Metres{um->get<double>() * 1e-6};
  }
  auto curve = rig::FitFocusCurve(std::move(points), focal_length, error, rig.lens().axes[Axis::Focus]->resolution);
  if (!curve) return PassOn(std::move(curve));
  if (!rig.optics()->has_zoom()) curve->focal_length.reset();
  curve->approach_near = config.axes[Axis::Focus].approach_near;
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

Result<std::optional<rig::Calibration>> FromToml(const std::string& text) {
  const auto settings = io::ParseToml(text, "calibration");
  if (!settings) return Fail(Code::InvalidArgument, settings.error().message);
  auto calibration = rig::ReadCalibration(*settings);
  if (!calibration) return Fail(Code::InvalidArgument, calibration.error().message);
  return *std::move(calibration);
}

Json BacklashJson(const std::string& lens, Axis axis, const rig::BacklashOutcome& outcome) {
  Json result{{"lens", lens},
              {"axis", drivers::AxisName(axis)},
              {"known", outcome.measured},
              {"measured", outcome.measured && outcome.backlash.measured},
              {"frames", outcome.frames},
              {"elapsedMs", std::chrono::duration<double, std::milli>(outcome.elapsed).count()},
              {"reason", outcome.reason}};
  if (outcome.measured) {
    result["steps"] = proto::NumberOrNull(outcome.backlash.steps);
    result["lowSteps"] = proto::NumberOrNull(outcome.backlash.low);
    result["highSteps"] = proto::NumberOrNull(outcome.backlash.high);
  }
  return result;
}

}  // namespace

void LensService::ChangeCalibration(Lens& lens, EditCalibration edit, std::function<void(const Result<void>&)> done) {
  lens.worker->Submit([this, &lens, edit = std::move(edit), done = std::move(done)](rig::Rig& rig) {
    const auto later = [&lens, done](Result<void> answer) {
      lens.worker->Later([done, answer = std::move(answer)] { done(answer); });
    };
    rig::Calibration now = rig.calibration() ? *rig.calibration() : rig::Calibration{};
    if (!rig.calibration()) now.serial = rig.lens().serial;
    auto edited = edit(std::move(now), rig);
    if (!edited) return later(std::unexpected(edited.error()));
    std::shared_ptr<const rig::Calibration> next;
    if (*edited) next = std::make_shared<const rig::Calibration>(**std::move(edited));
    rig.SetCalibration(next, [this, &lens, next, done, later](Result<void> set) {
      if (!set) return later(std::move(set));
      lens.worker->Later([this, &lens, next, done] {
        auto kept = Keep(lens.calibration_file, next ? rig::CalibrationText(*next) : "");
        if (!kept) kept = Fail(Code::Io, "in force, but not kept: " + kept.error().message);
        Replan(lens, [done, kept] { done(kept); });
      });
    });
  });
}

void LensService::TellCalibration(const ExchangePointer& exchange, Lens& lens) {
  auto answer = [exchange, &lens](const rig::Status& status, const std::shared_ptr<const rig::Calibration>& now) {
    const bool known = status.optics != nullptr;
    const auto error = known ? status.optics->error() : std::nullopt;
    Json info{{"lens", lens.name},
              {"grade", GradeName(known ? status.optics->grade() : rig::Grade::Uncalibrated)},
              {"errorUm", error ? proto::NumberOrNull(error->value * 1e6) : Json(nullptr)},
              {"file", lens.calibration_file.empty() ? Json(nullptr) : Json(lens.calibration_file)},
              {"toml", now ? Json(rig::CalibrationText(*now)) : Json(nullptr)}};
    exchange->Finish(proto::WriteJson({{"calibration", std::move(info)}}));
  };
  lens.worker->Submit([&lens, answer](rig::Rig& rig) {
    lens.worker->Later([answer, status = rig.GetStatus(), now = rig.calibration()] { answer(status, now); });
  });
}

void LensService::Calibration(const ExchangePointer& exchange) {
  if (Lens* const lens = FindLens(exchange)) TellCalibration(exchange, *lens);
}

void LensService::Calibrate(const ExchangePointer& exchange) {
  Lens* const lens = FindLens(exchange);
  if (lens == nullptr) return;
  const Json& parameters = exchange->parameters();
  const Json* toml = Given(parameters, "toml");
  const Json* points = Given(parameters, "points");
  const Json* remove = Given(parameters, "remove");
  const bool removes = remove != nullptr && remove->get<bool>();
  if ((toml != nullptr) + (points != nullptr) + removes != 1) {
    return Refuse(exchange, {Code::InvalidArgument, "say exactly one of toml, points and remove"});
  }
  EditCalibration edit;
  if (removes) {
    edit = [](const rig::Calibration&, const rig::Rig&) -> Result<std::optional<rig::Calibration>> {
      return std::nullopt;
    };
  } else if (toml != nullptr) {
    edit = [text = toml->get<std::string>()](const rig::Calibration&, const rig::Rig&) { return FromToml(text); };
  } else {
    edit = [parameters, config = lens->config.rig](rig::Calibration now, const rig::Rig& rig) {
      return WithCurve(std::move(now), rig, parameters, config);
    };
  }
  ChangeCalibration(*lens, std::move(edit), [this, exchange, lens](const Result<void>& changed) {
    if (!changed) return Refuse(exchange, changed.error());
    TellCalibration(exchange, *lens);
  });
}

void LensService::Backlash(const ExchangePointer& exchange) {
  Lens* const lens = FindLens(exchange);
  if (lens == nullptr) return;
  const Json& parameters = exchange->parameters();
  const Json* named = Given(parameters, "axis");
  const Axis axis = named != nullptr ? *drivers::AxisFromName(named->get_ref<const std::string&>()) : Axis::Focus;
  const Json* steps = Given(parameters, "steps");
  if (steps == nullptr) {
    if (axis == Axis::Focus) return MeasureBacklash(exchange, *lens);
    return Refuse(exchange, {Code::Unsupported,
                             "only the backlash of focus can be measured by looking; say how many "
                             "steps it is instead"});
  }
  rig::BacklashOutcome said;
  said.measured = true;
  said.backlash.steps = said.backlash.low = said.backlash.high = steps->get<double>();
  if (!(said.backlash.steps >= 0.0)) return Refuse(exchange, {Code::InvalidArgument, "steps must not be negative"});
  FinishBacklash(exchange, *lens, axis, std::move(said));
}

void LensService::MeasureBacklash(const ExchangePointer& exchange, Lens& lens) {
  const Json& parameters = exchange->parameters();
  rig::BacklashRequest request;
  if (const Json* pairs = Given(parameters, "pairs")) request.pairs = pairs->get<int>();
  if (const Json* region = Given(parameters, "region")) {
    const auto number = [&](const char* key) { return (*region)[key].get<double>(); };
    request.region = drivers::Region{number("x"), number("y"), number("w"), number("h")};
  }
  auto answer = [this, exchange, &lens](const Result<rig::BacklashOutcome>& outcome) {
    if (!outcome) return Refuse(exchange, outcome.error());
    FinishBacklash(exchange, lens, Axis::Focus, *outcome);
  };
  std::function<void(const rig::BacklashProgress&)> progress;
  if (exchange->call().more) {
    progress = [&lens, exchange](const rig::BacklashProgress& now) {
      const Json json{{"sweep", now.sweep}, {"sweepsExpected", now.of}, {"frames", now.frames}};
      lens.worker->Later(
          [exchange, text = "{\"progress\":" + proto::WriteJson(json) + "}"] { exchange->Continue(text); });
    };
  }
  auto ended = std::make_shared<bool>(false);  // the worker's thread
  lens.worker->Submit([this, &lens, request, progress, answer, ended](rig::Rig& rig) {
    rig::MeasureBacklash(rig, clock_, request, progress, [&lens, answer, ended](Result<rig::BacklashOutcome> outcome) {
      *ended = true;
      lens.worker->Later([answer, outcome = std::move(outcome)] { answer(outcome); });
    });
  });
  exchange->OnGone([&lens, ended] {
    lens.worker->Submit([ended](rig::Rig& rig) {
      if (!*ended) rig.Stop({}, [](const Result<void>&) {});
    });
  });
}

void LensService::FinishBacklash(const ExchangePointer& exchange, Lens& lens, Axis axis, rig::BacklashOutcome outcome) {
  const auto tell = [exchange, &lens, axis](const rig::BacklashOutcome& ended) {
    exchange->Finish(proto::WriteJson({{"backlash", BacklashJson(lens.name, axis, ended)}}));
  };
  if (!outcome.measured) return tell(outcome);
  const auto& configured = lens.config.rig.axes[axis].backlash;
  if (configured) {
    outcome.reason = "the configuration says backlash = " + std::to_string(static_cast<long>(*configured)) +
                     ", which stays in force: say \"auto\" there to use this";
  }
  const EditCalibration edit = [axis, backlash = outcome.backlash](
                                   rig::Calibration now,
                                   const rig::Rig& rig) -> Result<std::optional<rig::Calibration>> {
    if (!rig.lens().axes[axis]) {
      return Fail(Code::Unsupported, "this lens has no motorised " + std::string(drivers::AxisName(axis)));
    }
    now.backlash[axis] = backlash;
    return now;
  };
  ChangeCalibration(lens, edit, [this, exchange, tell, outcome](const Result<void>& changed) {
    if (!changed) return Refuse(exchange, changed.error());
    tell(outcome);
  });
}

}  // namespace lensd::daemon
