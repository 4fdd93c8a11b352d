// Does one thing with liblensd and prints what came of it as a line of JSON; tests/clients/cpp_test.py judges it. It
// includes what a program outside the house would: the installed headers, and a JSON library of its own.
#include <dirent.h>
#include <lensd/client.h>
#include <poll.h>

#include <atomic>
#include <fstream>
#include <functional>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

namespace {

using Json = nlohmann::json;
using Words = std::vector<std::string>;

Json Told(const lensd::LensdError& error) {
  Json told = Json::parse(error.fields());
  told["error"] = error.name();
  told["code"] = error.code();
  told["exit_status"] = error.exit_status();
  told["message"] = error.what();
  const auto same = [&](const char* field, const std::string& text) {
    const auto found = told.find(field);
    if ((found == told.end() || !found->is_string() ? "" : found->get<std::string>()) != text) told["wrong"] = field;
  };
  same("lens", error.lens());
  same("axis", error.axis());
  same("parameter", error.parameter());
  same("unit", error.unit());
  if (error.minimum()) told["minimum"] = *error.minimum();
  if (error.maximum()) told["maximum"] = *error.maximum();
  return told;
}

int OpenFiles() {
  int count = 0;
  DIR* const folder = opendir("/proc/self/fd");
  if (folder == nullptr) return -1;
  while (readdir(folder) != nullptr) ++count;
  closedir(folder);
  return count;
}

/// Lines of /proc/self/maps that are memfds.
Words Memfds() {
  Words found;
  std::ifstream maps("/proc/self/maps");
  for (std::string line; std::getline(maps, line);) {
    if (line.find("/memfd:") != std::string::npos) found.push_back(line);
  }
  return found;
}

bool Moves(lensd::Client& client, const std::string& lens) {
  return client.Status(lens).axes().front().moving();
}

/// Tells that the lens moves, once it does.
void UntilMoving(lensd::Client& client, const std::string& lens) {
  while (!Moves(client, lens)) std::this_thread::sleep_for(lensd::Milliseconds(2));
}

std::string Far(lensd::Client& client, const std::string& lens) {
  return client.Status(lens).axes().front().position() < 2000 ? "@3900" : "@100";
}

Json Call(const Words& words) {
  return {{"reply", Json::parse(lensd::Client(words[0]).Call(words[1], words[2]))}};
}

Json MoveTo(const Words& words) {
  lensd::Client client(words[0]);
  return {{"reply", Json::parse(client.Focus(words[1], words[2], lensd::Milliseconds(std::stol(words[3]))).json())}};
}

/// What happens to one Client after its call ran out of time.
Json Deadline(const Words& words) {
  lensd::Client client(words[0]);
  Json told;
  try {
    client.Focus(words[1], Far(client, words[1]), lensd::Milliseconds(200));
  } catch (const lensd::LensdError& error) {
    told = Told(error);
    told["isTimeout"] = error.Is("Timeout");
  }
  UntilMoving(client, words[1]);
  client.Stop(words[1]);
  return told;
}

Json Threads(const Words& words) {
  lensd::Client client(words[0]);
  Json told;
  std::atomic<bool> done = false;
  const std::string far = Far(client, words[1]);
  std::thread mover([&] {
    try {
      client.Focus(words[1], far);
    } catch (const lensd::LensdError& error) {
      told = Told(error);
    }
    done = true;
  });
  UntilMoving(client, words[1]);
  std::atomic<int> answers = 0;
  const auto ask = [&] {
    for (int i = 0; i < 20; ++i) answers += client.Status(words[1]).name() == words[1];
  };
  ask();
  const bool still_moving = !done;
  std::thread other(ask);
  ask();
  other.join();
  client.Stop(words[1]);
  mover.join();
  told["answers"] = answers.load();
  told["movedMeanwhile"] = still_moving;
  return told;
}

Json View(const Words& words) {
  Json told;
  lensd::Client client(words[0]);
  client.Status(words[1]);
  told["filesBefore"] = OpenFiles();
  lensd::Picture kept;
  {
    lensd::View view = client.OpenView(lensd::ViewParameters().lens(words[1]).encoding("gray8"));
    kept = view.Next().value();
    for (int i = 0; i < 5; ++i) view.Next();
    told["mappings"] = Memfds();
  }
  std::ostringstream address;
  address << std::hex << reinterpret_cast<std::uintptr_t>(kept.data());
  told["address"] = address.str();
  told["size"] = kept.size();
  told["sharpness"] = kept.info().sharpness().value();
  const std::vector<std::uint8_t> seen(kept.data(), kept.data() + kept.size());
  kept = lensd::Picture();
  told["mappingsAfter"] = Memfds().size();
  const lensd::Picture taken = client.Snapshot(lensd::SnapshotParameters().lens(words[1]).encoding("gray8"));
  told["sameAsSnapshot"] = std::vector<std::uint8_t>(taken.data(), taken.data() + taken.size()) == seen;
  told["filesAfter"] = OpenFiles();
  return told;
}

/// A monitor that another thread cancels, and a stream of states in an event loop.
Json Streams(const Words& words) {
  Json told;
  lensd::Client client(words[0]);
  lensd::Monitor monitor = client.OpenMonitor(words[1]);
  told["first"] = monitor.Next().value().status().value().name();
  std::thread reader([&] {
    while (monitor.Next()) continue;
    told["ended"] = monitor.ended();
  });
  monitor.Cancel();
  reader.join();
  lensd::Stream states = client.Begin("Status", Json{{"lens", words[1]}}.dump(), lensd::Client::Replies::More);
  lensd::Stream move =
      client.Begin("Move", Json{{"lens", words[1]}, {"axis", "focus"}, {"target", {{"relative", 50}}}}.dump(),
                   lensd::Client::Replies::One, lensd::Milliseconds(60'000));
  int changes = 0;
  while (!move.ended()) {
    pollfd waits[] = {{states.fd(), POLLIN, 0}, {move.fd(), POLLIN, 0}};
    poll(waits, 2, static_cast<int>(move.left().count()));
    while (states.Process()) ++changes;
    if (const auto reply = move.Process()) told["reached"] = Json::parse(*reply)["move"]["reached"];
  }
  told["changes"] = changes;
  return told;
}

/// A function that gives no frame ends the search, and what it throws comes through.
Json Grab(const Words& words) {
  lensd::Client client(words[0]);
  Json told;
  try {
    client.Autofocus(lensd::AutofocusBeginParameters().lens(words[1]),
                     [](const lensd::AutofocusStep& step) -> lensd::Frame {
                       throw std::out_of_range(std::to_string(step.frame()));
                     });
  } catch (const std::out_of_range& error) {
    told["thrown"] = error.what();
  }
  while (client.Status(words[1]).activity() != "idle") std::this_thread::sleep_for(lensd::Milliseconds(2));
  std::vector<unsigned char> one(std::size_t{64} * 48);
  client.Autofocus(lensd::AutofocusBeginParameters().lens(words[1]),
                   [&](const lensd::AutofocusStep&) { return lensd::Frame(one.data(), 64, 48).exposure(1, 2); });
  return told;
}

/// What a text means: the parameters of the call it leads to go to a lensd that is none.
Json Text(const Words& words) {
  lensd::Client client(words[0]);
  const std::map<std::string,
                 lensd::MoveResult (lensd::Client::*)(const std::string&, const std::string&, lensd::Milliseconds)>
      axes = {{"focus", &lensd::Client::Focus}, {"iris", &lensd::Client::Aperture}, {"zoom", &lensd::Client::Zoom}};
  (client.*axes.at(words[1]))("a", words[2], lensd::Milliseconds(5000));
  return Json::object();
}

}  // namespace

int main(int argc, char** argv) {
  const std::map<std::string, std::function<Json(const Words&)>> acts = {
      {"call", Call}, {"move", MoveTo},     {"deadline", Deadline}, {"threads", Threads},
      {"view", View}, {"streams", Streams}, {"grab", Grab},         {"text", Text}};
  const Words words(argv + 1, argv + argc);
  Json told;
  try {
    told = acts.at(words.at(0))({words.begin() + 1, words.end()});
  } catch (const lensd::LensdError& error) {
    told = Told(error);
  }
  std::cout << told.dump() << '\n';
}
