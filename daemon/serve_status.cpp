// List, Status, Monitor: everything answered from what the workers have published.
#include "lens_entry.h"
#include "lens_service.h"
#include "proto/interfaces.h"

namespace lensd::daemon {
namespace {

std::string StatusEvent(const std::string& text) {
  return "{\"event\":{\"status\":" + text + "}}";
}

bool NamesALens(const ExchangePointer& exchange) {
  return exchange->view().Given("lens").has_value();
}

}  // namespace

void LensService::List(const ExchangePointer& exchange) {
  for (const auto& lens : lenses_) {
    if (Stale(*lens)) return Replan(*lens, [this, exchange] { List(exchange); });
  }
  std::string reply = "{\"lenses\":[";
  for (const auto& lens : lenses_) reply += (lens == lenses_.front() ? "" : ",") + lens->info;
  exchange->Finish(reply + "]}");
}

void LensService::Status(const ExchangePointer& exchange) {
  const Lens* only = nullptr;
  if (NamesALens(exchange) && (only = FindNamed(exchange)) == nullptr) return;
  std::string reply = "{\"lenses\":[";
  bool first = true;
  for (const auto& lens : lenses_) {
    if (only != nullptr && only != lens.get()) continue;
    if (!std::exchange(first, false)) reply += ',';
    reply += lens->text;
  }
  reply += "]}";
  if (!exchange->call().more) return exchange->Finish(reply);
  exchange->Continue(reply);
  const auto tell = [raw = exchange.get()](const Lens& lens) { raw->Continue("{\"lenses\":[" + lens.text + "]}"); };
  Watch({exchange, only, tell, false});
}

void LensService::Monitor(const ExchangePointer& exchange) {
  const Lens* only = nullptr;
  if (NamesALens(exchange) && (only = FindNamed(exchange)) == nullptr) return;
  if (!exchange->call().more) return exchange->Refuse(proto::kExpectedMore, proto::Json::object());
  for (const auto& lens : lenses_) {
    if (only == nullptr || only == lens.get()) exchange->Continue(StatusEvent(lens->text));
  }
  const auto tell = [raw = exchange.get()](const Lens& lens) { raw->Continue(StatusEvent(lens.text)); };
  Watch({exchange, only, tell, true});
}

}  // namespace lensd::daemon
