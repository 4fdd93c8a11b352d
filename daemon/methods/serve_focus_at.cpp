// FocusAt, FocusAtAdd, FocusAtGet, FocusAtForget: the surface of focus over coordinates of the client's. Its samples
// are part of the calibration; it is fitted anew, by the conditions of the moment, whenever it is asked.
#include <algorithm>
#include <cmath>
#include <ctime>
#include <memory>
#include <utility>

#include "daemon/methods/lens_service.h"
#include "daemon/methods/serve.h"
#include "daemon/wire/autofocus_request.h"
#include "daemon/wire/json_values.h"
#include "daemon/wire/lens_json.h"
#include "rig/focus_at.h"

namespace lensd::daemon {
namespace {

using drivers::Axis;
using varlink::Json;

constexpr double kMostValue = 1e9;  ///< of a coordinate; squares of squares of it are still numbers

/// A place as a call has it.
struct Place {
  std::vector<rig::FocusAtCoordinate> coordinates;
  std::vector<double> at;
};

Result<Place> PlaceOf(const Json& values) {
  Place place;
  if (values.empty() || values.size() > rig::FocusAtSamples::kMostCoordinates) {
    return PassOn(Wrong("a place has one to three coordinates", {.parameter = "at"}));
  }
  for (const Json& value : values) {
    const std::string path = "at[" + std::to_string(place.at.size()) + "]";
    const Json* const unit = Given(value, "unit");
    rig::FocusAtCoordinate coordinate{value["name"].get<std::string>(), unit ? unit->get<std::string>() : ""};
    if (!rig::IsFocusAtCoordinate(coordinate)) {
      return PassOn(Wrong("name and unit are words of at most 32 plain characters", {.parameter = path}));
    }
    const auto same = [&](const rig::FocusAtCoordinate& other) { return other.name == coordinate.name; };
    if (std::ranges::any_of(place.coordinates, same)) {
      return PassOn(Wrong(coordinate.name + " is there twice", {.parameter = path}));
    }
    place.coordinates.push_back(std::move(coordinate));
    place.at.push_back(value["value"].get<double>());
    if (!(std::abs(place.at.back()) <= kMostValue)) {
      return PassOn(Wrong("a coordinate is from -1e9 to 1e9: say it in a larger unit",
                          {.parameter = path + ".value", .minimum = -kMostValue, .maximum = kMostValue}));
    }
  }
  return place;
}

Json PlaceJson(const std::vector<rig::FocusAtCoordinate>& coordinates, const std::vector<double>& at) {
  Json json = Json::array();
  for (std::size_t i = 0; i < at.size(); ++i) {
    json.push_back({{"name", coordinates[i].name}, {"value", at[i]}, {"unit", TextOrNull(coordinates[i].unit)}});
  }
  return json;
}

std::string NowText() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[32];
  return {text, std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc)};
}

rig::FocusAtSamples Known(const rig::Rig& rig) {
  const auto calibration = rig.calibration();
  return calibration && calibration->focus_at ? *calibration->focus_at : rig::FocusAtSamples{};
}

Result<rig::FocusAtFit> FitNow(const rig::Rig& rig, std::optional<Metres> wavelength) {
  return rig::FitFocusAt(Known(rig), rig, rig::FocusAtConditionsOf(rig.GetStatus(), wavelength));
}

Json SampleJson(const rig::FocusAtSamples& known, std::size_t index, const rig::FocusAtFit* fit) {
  const rig::FocusAtSample& sample = known.samples[index];
  return {{"at", PlaceJson(known.coordinates, sample.at)},
          {"position", NativeJson(sample.position.value)},
          {"sigma", sample.sigma.value},
          {"off", fit ? Json(fit->samples[index].off) : Json(nullptr)},
          {"outlier", fit != nullptr && fit->samples[index].outlier},
          {"temperatureC", Optional(sample.under.temperature)},
          {"zoomPosition", sample.under.zoom ? NativeJson(sample.under.zoom->value) : Json(nullptr)},
          {"filterPosition", sample.under.filter ? NativeJson(sample.under.filter->value) : Json(nullptr)},
          {"fNumber", Optional(sample.under.f_number)},
          {"made", sample.made}};
}

Json SurfaceJson(const std::string& lens, const rig::FocusAtSamples& known, const Result<rig::FocusAtFit>& tried) {
  const rig::FocusAtFit* const fit = tried && tried->surface ? &*tried : nullptr;
  Json samples = Json::array();
  for (std::size_t i = 0; i < known.samples.size(); ++i) samples.push_back(SampleJson(known, i, fit));
  Json json{{"lens", lens}, {"samples", std::move(samples)}, {"fitted", fit != nullptr}, {"reason", nullptr}};
  for (const char* key : {"low", "high", "curved", "scatter", "correction", "next", "note"}) json[key] = nullptr;
  if (fit == nullptr) {
    json["reason"] = tried ? tried->why_none : tried.error().message;
    return json;
  }
  json["low"] = PlaceJson(known.coordinates, fit->surface->low);
  json["high"] = PlaceJson(known.coordinates, fit->surface->high);
  json["curved"] = fit->surface->curved;
  json["scatter"] = fit->surface->scatter;
  json["correction"] = fit->correction.value;
  json["note"] = TextOrNull(fit->remark);
  if (fit->next) json["next"] = PlaceJson(known.coordinates, *fit->next);
  return json;
}

/// Where focus lies at a place, and that as FocusAtPlace.
struct Predicted {
  Native position;
  Json json;
};

Result<Predicted> Predict(const rig::Rig& rig, const Place& place, std::optional<Metres> wavelength) {
  const auto fit = FitNow(rig, wavelength);
  if (!fit) return PassOn(fit);
  if (!fit->coordinates.empty() && fit->coordinates != place.coordinates) {
    return PassOn(Wrong(rig::OtherCoordinates(fit->coordinates, place.coordinates), {.parameter = "at"}));
  }
  const auto there = fit->At(place.at);
  if (!there) return PassOn(there);
  Json json{{"at", PlaceJson(place.coordinates, place.at)},
            {"position", there->focus},
            {"sigma", there->sigma},
            {"vergenceD", nullptr},
            {"sigmaD", nullptr},
            {"note", TextOrNull(fit->remark)}};
  if (const rig::OpticsTable* optics = rig.optics(); optics != nullptr && optics->has_focus()) {
    const auto vergence = [&](double native) {
      return optics->VergenceFromExtension(optics->ExtensionFromNative(Native{native})).value;
    };
    json["vergenceD"] = vergence(there->focus);
    json["sigmaD"] = std::abs(vergence(there->focus + there->sigma) - vergence(there->focus - there->sigma)) / 2.0;
  }
  return Predicted{Native{there->focus}, std::move(json)};
}

/// What the surface is now, with what else the call is answered with.
void TellSurface(ServedLens& lens, const ExchangePointer& exchange, Json answer) {
  const auto ask = [name = lens.name(), wavelength = lens.config().rig.wavelength](rig::Rig& rig, auto done) {
    done(SurfaceJson(name, Known(rig), FitNow(rig, wavelength)));
  };
  lens.Ask<Json>(ask, [&lens, exchange, answer = std::move(answer)](const Result<Json>& surface) mutable {
    if (!surface) return Refuse(exchange, lens, surface.error());
    answer["surface"] = *surface;
    exchange->Finish(varlink::WriteJson(answer));
  });
}

/// The sample a call means: the newest autofocus, once, or what it says itself.
Result<FocusFound> FoundBy(ServedLens& lens, const Json& parameters) {
  const Json* const position = Given(parameters, "position");
  if (position == nullptr) {
    if (lens.users().found) return *lens.users().found;
    return PassOn(
        Wrong("there is no autofocus that was sure and is no sample yet: focus there first, or give position and sigma",
              {.parameter = "position"}));
  }
  return FocusFound{Native{position->get<double>()}, std::nullopt,
                    rig::FocusAtConditionsOf(lens.status(), lens.config().rig.wavelength)};
}

void Add(ServedLens& lens, const ExchangePointer& exchange) {
  const Json& parameters = exchange->parameters();
  const auto place = PlaceOf(parameters["at"]);
  if (!place) return Refuse(exchange, lens, place.error());
  const auto found = FoundBy(lens, parameters);
  if (!found) return Refuse(exchange, lens, found.error());
  std::optional<Native> told;
  if (const Json* sigma = Given(parameters, "sigma")) told = Native{sigma->get<double>()};
  if (told && !(told->value >= rig::FocusAtSamples::kLeastSigma && told->value <= rig::FocusAtSamples::kMostSigma)) {
    return Refuse(
        exchange, lens,
        Wrong("sigma is from 1e-6 to 1e9, in native units of focus", {.parameter = "sigma",
                                                                      .minimum = rig::FocusAtSamples::kLeastSigma,
                                                                      .maximum = rig::FocusAtSamples::kMostSigma}));
  }
  const auto add = [place = *place, found = *found, told](
                       rig::Calibration now, const rig::Rig& rig) -> Result<std::optional<rig::Calibration>> {
    if (auto busy = rig.WhyNotAtRest()) return PassOn(*std::move(busy));
    auto sigma = told;
    if (!sigma && found.sigma) sigma = rig::NativeSigma(rig, found.position, *found.sigma);
    if (!sigma) return PassOn(Wrong("say how sure that is: sigma, in native units of focus", {.parameter = "sigma"}));
    auto known = now.focus_at.value_or(rig::FocusAtSamples{});
    auto added =
        rig::AddFocusAt(known, place.coordinates, {place.at, found.position, *sigma, found.under, NowText()}, rig);
    if (!added) return PassOn(added);
    now.focus_at = std::move(known);
    return now;
  };
  const bool by_autofocus = Given(parameters, "position") == nullptr;
  lens.ChangeCalibration(add, [&lens, exchange, by_autofocus](const Result<void>& kept) {
    if (by_autofocus && (kept || kept.error().code == Code::NotKept)) lens.users().found.reset();
    if (!kept) return Refuse(exchange, lens, kept.error());
    TellSurface(lens, exchange, Json::object());
  });
}

void Get(ServedLens& lens, const ExchangePointer& exchange) {
  const Json* const at = Given(exchange->parameters(), "at");
  if (at == nullptr) return TellSurface(lens, exchange, {{"place", nullptr}});
  const auto place = PlaceOf(*at);
  if (!place) return Refuse(exchange, lens, place.error());
  const auto ask = [place = *place, wavelength = lens.config().rig.wavelength](rig::Rig& rig, auto done) {
    auto predicted = Predict(rig, place, wavelength);
    done(predicted ? Result<Json>(std::move(predicted->json)) : Result<Json>(PassOn(predicted)));
  };
  lens.Ask<Json>(ask, [&lens, exchange](const Result<Json>& there) {
    if (!there) return Refuse(exchange, lens, there.error());
    TellSurface(lens, exchange, {{"place", *there}});
  });
}

void Go(ServedLens& lens, const ExchangePointer& exchange) {
  const auto place = PlaceOf(exchange->parameters()["at"]);
  if (!place) return Refuse(exchange, lens, place.error());
  const auto go = [place = *place, wavelength = lens.config().rig.wavelength, name = lens.name()](rig::Rig& rig,
                                                                                                  auto done) {
    const rig::Status now = rig.GetStatus();
    for (const Axis axis : {Axis::Focus, Axis::Zoom, Axis::Filter}) {
      if (auto lost = rig::WhyLost(axis, now.axes[axis])) return done(PassOn(*std::move(lost)));
    }
    auto predicted = Predict(rig, place, wavelength);
    if (!predicted) return done(PassOn(predicted));
    const rig::Target target{.kind = rig::Target::Kind::Native, .value = predicted->position.value, .from = {}};
    rig.Move(Axis::Focus, target,
             [name, json = std::move(predicted->json), done = std::move(done)](Result<rig::MoveOutcome> moved) mutable {
               if (!moved) return done(PassOn(moved));
               done(Json{{"place", std::move(json)}, {"move", MoveJson(name, *moved)}});
             });
  };
  lens.Ask<Json>(go, [&lens, exchange](const Result<Json>& went) {
    if (!went) return Refuse(exchange, lens, went.error());
    lens.watchers().Announce(lens, "move", (*went)["move"]);
    exchange->Finish(varlink::WriteJson(*went));
  });
}

void Forget(ServedLens& lens, const ExchangePointer& exchange) {
  std::optional<std::int64_t> which;
  if (const Json* number = Given(exchange->parameters(), "sample")) which = number->get<std::int64_t>();
  const auto removed = std::make_shared<bool>(false);
  const auto forget = [which, removed](rig::Calibration now,
                                       const rig::Rig&) -> Result<std::optional<rig::Calibration>> {
    const auto count = now.focus_at ? static_cast<std::int64_t>(now.focus_at->samples.size()) : 0;
    if (which && (*which < 1 || *which > count)) {
      return PassOn(Wrong("there is no sample " + std::to_string(*which) + ": there are " + std::to_string(count),
                          {.parameter = "sample"}));
    }
    if (which) now.focus_at->samples.erase(now.focus_at->samples.begin() + (*which - 1));
    *removed = count > 0;
    if (!which || count == 1) now.focus_at.reset();
    return now;
  };
  lens.ChangeCalibration(forget, [&lens, exchange, removed](const Result<void>& kept) {
    if (!kept) return Refuse(exchange, lens, kept.error());
    exchange->Finish(varlink::WriteJson(Json{{"removed", *removed}}));
  });
}

}  // namespace

void NoteFocusFound(ServedLens& lens, const rig::AutofocusRequest& request, const rig::AutofocusOutcome& outcome) {
  lens.users().refocus->Found(request, outcome);
  NoteFocusTracked(lens, outcome);
}

void NoteFocusTracked(ServedLens& lens, const rig::AutofocusOutcome& outcome) {
  if (!outcome.focused) return;
  lens.users().slope->Found(outcome);
  lens.users().found = FocusFound{outcome.position, outcome.sigma,
                                  rig::FocusAtConditionsOf(lens.status(), lens.config().rig.wavelength)};
}

MethodTable FocusAtMethods(LensService& service) {
  return {{"FocusAt", service.ForLens(Go)},
          {"FocusAtAdd", service.ForLens(Add)},
          {"FocusAtGet", service.ForLens(Get)},
          {"FocusAtForget", service.ForLens(Forget)}};
}

}  // namespace lensd::daemon
