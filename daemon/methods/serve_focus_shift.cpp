// MeasureFocusShift, ListFocusShifts, RemoveFocusShift: how focus moves with the f-number and the filter. What is known
// of it is part of the calibration.
#include <ctime>
#include <utility>

#include "daemon/methods/lens_service.h"
#include "daemon/methods/serve.h"
#include "daemon/pictures/picture.h"
#include "daemon/wire/autofocus_request.h"
#include "daemon/wire/lens_json.h"
#include "daemon/wire/search_conditions_json.h"
#include "rig/focus_shift_run.h"

namespace lensd::daemon {
namespace {

using varlink::Json;

constexpr int kFewestShiftPairs = 3, kMostShiftPairs = 20;
constexpr std::size_t kMostShifts = 1000;

std::string ShiftDate() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[32];
  return {text, std::strftime(text, sizeof text, "%Y-%m-%d", &utc)};
}

Result<rig::ShiftRequest> ShiftRequestOf(const Json& parameters) {
  rig::ShiftRequest request;
  auto conditions = SearchConditionsOf(parameters["conditions"], "conditions");
  if (!conditions) return PassOn(conditions);
  request.conditions = *conditions;
  if (const Json* pairs = Given(parameters, "pairs")) {
    const auto count = pairs->get<std::int64_t>();
    if (count < kFewestShiftPairs || count > kMostShiftPairs) {
      return PassOn(Wrong("pairs is from 3 to 20",
                          {.parameter = "pairs", .minimum = kFewestShiftPairs, .maximum = kMostShiftPairs}));
    }
    request.pairs = static_cast<int>(count);
  }
  if (const Json* region = Given(parameters, "region")) {
    const auto part = RegionOf(*region, "region");
    if (!part) return PassOn(part);
    request.region = *part;
  }
  return request;
}

Json ShiftResultJson(const std::string& lens, const rig::ShiftOutcome& outcome) {
  Json json{{"lens", lens},
            {"measured", outcome.measured},
            {"shift", outcome.measured ? FocusShiftJson(outcome.shift) : Json(nullptr)},
            {"frames", outcome.frames},
            {"elapsedMs", std::chrono::duration<double, std::milli>(outcome.elapsed).count()},
            {"cause", nullptr},
            {"reason", TextOrNull(outcome.reason)}};
  if (!outcome.measured) json["cause"] = AutofocusCauseName(outcome.cause);
  return json;
}

/// Keeps what was measured, and answers with it.
void KeepShift(ServedLens& lens, const ExchangePointer& exchange, rig::ShiftOutcome outcome) {
  const auto tell = [&lens, exchange](const rig::ShiftOutcome& ended) {
    exchange->Finish(varlink::WriteJson({{"shift", ShiftResultJson(lens.name(), ended)}}));
  };
  if (!outcome.measured) return tell(outcome);
  outcome.shift.made = ShiftDate();
  const auto put = [shift = outcome.shift](rig::Calibration now,
                                           const rig::Rig&) -> Result<std::optional<rig::Calibration>> {
    now.Put(shift);
    if (now.focus_shifts.size() > kMostShifts) {
      return Fail(Code::OutOfRange, "1000 shifts of focus are known already: remove some");
    }
    return now;
  };
  lens.ChangeCalibration(put, [&lens, exchange, tell, outcome](const Result<void>& kept) {
    if (!kept) return Refuse(exchange, lens, kept.error());
    tell(outcome);
  });
}

std::function<void(const rig::ShiftProgress&)> ShiftProgressTo(std::weak_ptr<Exchange> call) {
  return [call = std::move(call)](const rig::ShiftProgress& now) {
    Json json{{"search", now.search}, {"searchesExpected", now.of}, {"frames", now.frames}};
    Worker::Later([call, progress = std::move(json)] {
      const auto exchange = call.lock();
      if (exchange && exchange->call().more) exchange->Continue(Wrap("progress", varlink::WriteJson(progress)));
    });
  };
}

void MeasureShift(ServedLens& lens, const ExchangePointer& exchange) {
  auto request = ShiftRequestOf(exchange->parameters());
  if (!request) return Refuse(exchange, lens, request.error());
  auto ended = std::make_shared<bool>(false);  // the worker's thread
  auto measure = [request = *std::move(request), progress = ShiftProgressTo(exchange), ended](rig::Rig& rig,
                                                                                              auto done) {
    if (auto busy = rig.WhyNotAtRest()) {
      *ended = true;
      return done(PassOn(*std::move(busy)));
    }
    rig::MeasureFocusShift(rig, request, progress,
                           [ended, done = std::move(done)](Result<rig::ShiftOutcome> outcome) mutable {
                             *ended = true;
                             done(std::move(outcome));
                           });
  };
  lens.Ask<rig::ShiftOutcome>(std::move(measure), [&lens, exchange](const Result<rig::ShiftOutcome>& outcome) {
    if (!outcome) return Refuse(exchange, lens, AsAskedOfAutofocus(outcome.error(), exchange->parameters()));
    KeepShift(lens, exchange, *outcome);
  });
  exchange->OnGone([&lens, ended] { StopUnlessEnded(lens, ended, {drivers::Axis::Focus}); });
}

void ListShifts(ServedLens& lens, const ExchangePointer& exchange) {
  using Shifts = std::vector<rig::FocusShift>;
  const auto ask = [](rig::Rig& rig, auto done) {
    done(rig.calibration() ? rig.calibration()->focus_shifts : Shifts{});
  };
  lens.Ask<Shifts>(ask, [&lens, exchange](const Result<Shifts>& known) {
    if (!known) return Refuse(exchange, lens, known.error());
    Json shifts = Json::array();
    for (const rig::FocusShift& shift : *known) shifts.push_back(FocusShiftJson(shift));
    exchange->Finish(varlink::WriteJson({{"shifts", std::move(shifts)}}));
  });
}

void RemoveShift(ServedLens& lens, const ExchangePointer& exchange) {
  const Json& parameters = exchange->parameters();
  const auto number = [&](const char* key) {
    const Json* const given = Given(parameters, key);
    return given != nullptr ? std::optional(given->get<double>()) : std::nullopt;
  };
  const auto from_opening = number("fromFNumber"), to_opening = number("toFNumber");
  const auto from_filter = number("fromFilter"), to_filter = number("toFilter");
  rig::FocusShift which;
  if (from_opening && to_opening) which.f_numbers.emplace(FNumber{*from_opening}, FNumber{*to_opening});
  if (from_filter && to_filter) which.filters.emplace(Native{*from_filter}, Native{*to_filter});
  const int ends = from_opening.has_value() + to_opening.has_value() + from_filter.has_value() + to_filter.has_value();
  if (ends != 2 || which.f_numbers.has_value() == which.filters.has_value()) {
    return Refuse(
        exchange, lens,
        {Code::InvalidArgument, "say both ends of one pair: fromFNumber and toFNumber, or fromFilter and toFilter"});
  }
  const auto remove = [which](rig::Calibration now, const rig::Rig&) -> Result<std::optional<rig::Calibration>> {
    const auto same = [&](const rig::FocusShift& known) {
      rig::FocusShift at_its_zoom = which;
      at_its_zoom.focal_length = known.focal_length;
      return known.SamePair(at_its_zoom);
    };
    if (std::erase_if(now.focus_shifts, same) == 0) {
      return Fail(Code::InvalidArgument, "no shift of focus from " + rig::PairText(which) + " is known");
    }
    return now;
  };
  lens.ChangeCalibration(remove, [&lens, exchange](const Result<void>& kept) {
    if (!kept) return Refuse(exchange, lens, kept.error());
    exchange->Finish("{}");
  });
}

}  // namespace

MethodTable FocusShiftMethods(LensService& service) {
  return {{"MeasureFocusShift", service.ForLens(MeasureShift)},
          {"ListFocusShifts", service.ForLens(ListShifts)},
          {"RemoveFocusShift", service.ForLens(RemoveShift)}};
}

}  // namespace lensd::daemon
