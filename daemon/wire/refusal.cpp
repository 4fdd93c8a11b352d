// What an error of the rig, the planner or a handler becomes on the wire. Which fields an error has is the interface
// file's to say.
#include "daemon/wire/refusal.h"

#include <algorithm>
#include <cmath>

#include "daemon/events/event_log.h"
#include "daemon/lens/served_lens.h"
#include "daemon/wire/lens_json.h"
#include "proto/errors_and_methods.h"

namespace lensd::daemon {

using varlink::Json;

namespace {

const ErrorFacts& KnownOf(const Error& error) {
  static const ErrorFacts kNone;
  return error.facts ? *error.facts : kNone;
}

/// Of the errors that concern an axis: the one it names, else the one the call was about.
std::optional<std::string> AxisOf(const ExchangePointer& exchange, const Error& error) {
  if (const std::string& axis = KnownOf(error).axis; !axis.empty()) return axis;
  const auto asked = exchange->view().Given("axis");
  return asked ? std::optional<std::string>(asked->text()) : std::nullopt;
}

bool ConcernsAnAxis(Code code) {
  return code != Code::BadData && code != Code::NotKept && code != Code::Internal;
}

bool ConcernsAParameter(Code code) {
  return code == Code::InvalidArgument || code == Code::OutOfRange || code == Code::Unsupported;
}

/// Null and absent mean the same; what is not known is left out.
Json FactsOf(const ExchangePointer& exchange, const Error& error) {
  const ErrorFacts& known = KnownOf(error);
  Json facts{{"message", error.message}};
  if (ConcernsAnAxis(error.code)) {
    if (auto axis = AxisOf(exchange, error)) facts["axis"] = *std::move(axis);
  }
  if (error.code == Code::Busy && !known.activity.empty()) facts["activity"] = known.activity;
  if (!ConcernsAParameter(error.code)) return facts;
  if (!known.parameter.empty()) facts["parameter"] = known.parameter;
  if (error.code == Code::Unsupported) return facts;
  if (known.minimum) facts["minimum"] = *known.minimum;
  if (known.maximum) facts["maximum"] = *known.maximum;
  if (!known.unit.empty() && (known.minimum || known.maximum)) facts["unit"] = known.unit;
  return facts;
}

std::optional<std::string_view> FirstNotHomed(const rig::Status& status) {
  const auto* const found = std::ranges::find_if(
      drivers::kAxes, [&](drivers::Axis axis) { return status.axes[axis] && !status.axes[axis]->homed; });
  return found == drivers::kAxes.end() ? std::nullopt : std::optional(drivers::AxisName(*found));
}

}  // namespace

Error About(std::string parameter, const Error& error) {
  if (!KnownOf(error).parameter.empty() || parameter.empty()) return error;
  return Renamed(std::move(parameter), error);
}

Error Renamed(std::string parameter, const Error& error) {
  ErrorFacts facts = KnownOf(error);
  facts.parameter = std::move(parameter);
  return Fail(error.code, error.message, std::move(facts)).error();
}

void Refuse(const ExchangePointer& exchange, const Error& error) {
  Json facts = FactsOf(exchange, error);
  if (const auto lens = exchange->view().Given("lens")) facts["lens"] = lens->text();
  exchange->Refuse(proto::ErrorOf(error.code).name, std::move(facts));
}

void Refuse(const ExchangePointer& exchange, const ServedLens& lens, const Error& error) {
  Json facts = FactsOf(exchange, error);
  facts["lens"] = lens.name();
  if (error.code == Code::NotHomed && !facts.contains("axis")) {
    if (const auto unhomed = FirstNotHomed(lens.status())) facts["axis"] = *unhomed;
  }
  const auto driver =
      error.code == Code::Busy && facts.contains("activity") ? lens.users().driving.But(*exchange) : std::nullopt;
  if (driver) {
    const std::chrono::duration<double> since = lens.surroundings().clock.Now() - driver->since;
    facts["holder"] = driver->caller;
    facts["sinceMs"] = 1e3 * since.count();
    facts["message"] = error.message + " (begun by " + driver->caller + " " +
                       std::to_string(std::lround(std::floor(since.count()))) + " s ago)";
  }
  ++lens.users().work.refused;
  const auto axis = AxisOf(exchange, error);
  LogFailedCall(lens.name(), axis.value_or(""), exchange->call().method, error);
  exchange->Refuse(proto::ErrorOf(error.code).name, std::move(facts));
}

}  // namespace lensd::daemon
