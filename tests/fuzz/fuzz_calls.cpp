// Calls of the right types, with any values, by several clients against a whole daemon in this process: every call gets
// an answer of its type, in order, whatever a client does a stop is carried out and ends what waits, and the lenses are
// there at the end.
#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "base/clock.h"
#include "checking_client.h"
#include "typed_values.h"
#include "varlink/json_view.h"
#include "whole_daemon.h"

namespace {

using namespace lensd;
using namespace lensd::fuzz;

/// Most of what a client may say in one call excludes the rest of it: such calls would be refused at their door.
void MakeSense(const std::string& method, Json& parameters, Values& values) {
  const unsigned which = values.Byte();
  if (method == "AutofocusBegin" && which % 4 != 0) {
    parameters = parameters.contains("lens") ? Json{{"lens", parameters["lens"]}} : Json::object();
    parameters["scores"] = true;
  }
  if (method != "Calibrate" || which % 16 == 0) return;
  for (const char* source : {"toml", "points", "remove"}) parameters.erase(source);
  if (which % 16 == 1) {
    parameters["remove"] = true;
  } else if (which % 2 == 0) {
    parameters["points"] = values.Points();
  } else {
    parameters["toml"] = values.Toml();
  }
}

/// What a call is of; most that need a session begin one first.
const std::string& MethodFor(const Client& client, Values& values) {
  // Searches the machine for devices, for seconds each time; and what only a configuration has.
  static const std::set<std::string_view> kLeftOut = {"Devices", "Reload"};
  static const std::set<std::string_view> kOfSessions = {"AutofocusScore", "AutofocusFrame", "AutofocusPixels",
                                                         "AutofocusEnd"};
  // What builds on what was before is tried more often.
  static const std::array<std::string, 8> kFavoured = {
      "Move", "Calibrate", "AutofocusBegin", "AutofocusScore", "AutofocusScore", "AutofocusFrame", "TakeLease", "Stop"};
  static const std::vector<std::string> methods = [] {
    std::vector<std::string> names;
    for (const auto& [name, unused] : Interface().methods()) {
      if (!kLeftOut.contains(name)) names.push_back(name);
    }
    return names;
  }();
  const unsigned which = values.Byte();
  const std::string& method =
      which % 2 == 0 ? kFavoured[which / 2 % kFavoured.size()] : methods[which / 2 % methods.size()];
  static const std::string kBegin = "AutofocusBegin";
  return !client.session && kOfSessions.contains(method) && values.Byte() % 8 != 0 ? kBegin : method;
}

void Act(std::vector<std::unique_ptr<Client>>& clients, Values& values) {
  auto& client = clients[values.Byte() % clients.size()];
  const unsigned how = values.Byte();
  if (how == 255) {
    client = std::make_unique<Client>();  // the one before it is gone, whatever it waited for
    return;
  }
  const std::string& method = MethodFor(*client, values);
  values.ChooseShareOfOptional();
  const auto& input = *Interface().methods().find(method)->second.input;
  Json parameters = values.Struct(input, *client, 0);
  parameters.erase("fd");
  MakeSense(method, parameters, values);
  const Client::Flag flag = how % 8 == 0   ? Client::Flag::Oneway
                            : how % 8 == 1 ? Client::Flag::More
                                           : Client::Flag::None;
  client->Send(method, parameters, flag);
  client->Read(milliseconds(how % 8 == 3 ? 10 : 1));
}

/// A reply of the daemon, which must come.
const Json& Answer(Client& client, const std::string& method) {
  client.Send(method, Json::object(), Client::Flag::None);
  client.Read(kNever);
  if (client.Waits()) Found(method + " has no answer");
  return client.last();
}

/// Every lens is open.
void AwaitLenses(Client& client) {
  const auto connected = [](const Json& lens) { return lens["connected"] == true; };
  const Instant deadline = MonotonicClock().Now() + kNever;
  while (!std::ranges::all_of(Answer(client, "Status")["lenses"], connected)) {
    if (MonotonicClock().Now() > deadline) Found("a lens is not there: " + varlink::WriteJson(client.last()));
    std::this_thread::sleep_for(milliseconds(1));
  }
}

/// Behind what a stop ends there may be the next call of the same client.
void StopUntilNothingWaits(Client& stopper, const std::vector<std::unique_ptr<Client>>& clients) {
  const auto waits = [](const auto& client) { return client->Waits(); };
  const Instant deadline = MonotonicClock().Now() + kNever;
  do {
    (void)Answer(stopper, "Stop");
    for (const auto& client : clients) client->Read(milliseconds(client->Waits() ? 20 : 0));
  } while (std::ranges::any_of(clients, waits) && MonotonicClock().Now() < deadline);
  if (const auto left = std::ranges::find_if(clients, waits); left != clients.end()) {
    Found((*left)->first() + " has no answer though everything was stopped");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr int kMostCalls = 40;
  static const Folder folder;
  Daemon daemon(folder);
  Client stopper;
  AwaitLenses(stopper);
  std::vector<std::unique_ptr<Client>> clients;
  constexpr std::size_t kClients = 3;
  clients.reserve(kClients);
  while (clients.size() < kClients) clients.push_back(std::make_unique<Client>());
  Values values({data, size});
  for (int i = 0; i < kMostCalls && !values.empty(); ++i) Act(clients, values);
  StopUntilNothingWaits(stopper, clients);
  for (const Json& lens : Answer(stopper, "Status")["lenses"]) {
    if (lens["connected"] != true) Found("a lens is lost: " + varlink::WriteJson(lens));
  }
  for (const Json& lens : Answer(stopper, "Metrics")["lenses"]) {
    if (lens["failures"] != 0) Found("a call made a lens fail, which had to be opened anew");
  }
  return 0;
}
