// add: a lens of one's own, from what is plugged in to a picture, without a file to edit.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <numeric>
#include <thread>
#include <vector>

#include "cli/link/daemon_client.h"
#include "cli/link/lens_info.h"
#include "cli/online/commands.h"
#include "cli/online/setup/devices.h"
#include "cli/online/setup/lens_file.h"
#include "cli/text/quantity.h"
#include "cli/text/texts.h"
#include "varlink/base64.h"
#include "varlink/json.h"

namespace lensd::cli {
namespace {

using varlink::Json;

struct AddOptions {
  int number = 0;  ///< of the device, from 1; 0: left out
  int camera = 0;  ///< of the device that takes the pictures
  std::string name, driver, bus, model, focal_length, f_number, closest, closest_from, pixel, direction;
  std::vector<std::string> keys, drives;
};

constexpr const char* kUnknown = "unknown";

/// What a script gives by options a person is asked for.
bool SomebodyIsThere(const Session& session) {
  return !session.json() && isatty(STDIN_FILENO) == 1 && isatty(STDERR_FILENO) == 1;
}

/// The option's text; where it was left out the person's answer. Empty: not known.
std::expected<std::string, Failure> Answer(const Session& session, const std::string& given, const std::string& option,
                                           const std::string& question, const std::string& example) {
  std::string text = given;
  if (text.empty() && !SomebodyIsThere(session)) {
    return Refuse(Exit::Usage, question + " of this lens: say " + option + " " + example + ", or " + option + " " +
                                   kUnknown + "; --model MODEL names a lens of docs/lenses.md");
  }
  if (text.empty()) {
    std::fprintf(stderr, "%s, as in %s, or %s: ", question.c_str(), example.c_str(), kUnknown);
    if (!std::getline(std::cin, text)) return Refuse(Exit::Usage, "the answers ended; nothing was added");
  }
  return text == kUnknown ? std::string() : text;
}

std::string MillimetresText(const Decimal& metres) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.12g", metres.Nearest().value_or(0.0) * 1e3);
  return text.data();
}

std::string NumberTextOf(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.12g", value);
  return text.data();
}

Result<std::string> FocalLengthLine(const std::string& text) {
  auto range = ParseLengthRange(text, "--focal-length");
  if (!range) return PassOn(range);
  if (!(range->low.Nearest().value_or(0.0) > 0.0)) return Wrong("--focal-length", text, "a focal length is above 0");
  const std::string low = MillimetresText(range->low), high = MillimetresText(range->high);
  return "focal_length_mm = " + (low == high ? low : "[" + low + ", " + high + "]") + "\n";
}

Result<std::string> FNumberLine(const std::string& text) {
  auto openings = ParseFNumbers(text, "--f-number");
  if (!openings) return PassOn(openings);
  return "f_number = [" + openings->range.low.Text() + ", " + openings->range.high.Text() + "]\n";
}

Result<std::string> ClosestLine(const std::string& text, const std::string& from) {
  auto depth = ParseDepth(text, "--closest");
  if (!depth) return PassOn(depth);
  const double vergence = depth->Vergence().value;
  if (!(vergence > 0.0)) return Wrong("--closest", text, "the closest distance in focus is a distance, as in 0.3m");
  const double metres = depth->IsDistance() ? depth->value : 1.0 / vergence;
  return "closest_m = " + NumberTextOf(metres) + "\nclosest_from = \"" + (from.empty() ? "lens" : from) + "\"\n";
}

/// Focal length, f-numbers and closest distance belong together: with one of them unknown the others stay as a comment.
std::expected<void, Failure> AskOptics(const Session& session, const AddOptions& options, NewLens& lens) {
  if (!options.model.empty()) {
    if (options.model != kUnknown) lens.keys += "optics = " + QuotedToml(options.model) + "\n";
    return {};
  }
  bool all = true;
  std::string lines;
  const auto add = [&](const std::string& given, const char* option, const char* question, const char* example,
                       const auto& line_of) -> std::expected<void, Failure> {
    const auto text = Answer(session, given, option, question, example);
    if (!text) return PassOn(text);
    all = all && !text->empty();
    if (text->empty()) return {};
    auto line = line_of(*text);
    if (!line) return PassOn(line);
    lines += *line;
    return {};
  };
  if (auto done = add(options.focal_length, "--focal-length", "focal length", "25mm", FocalLengthLine); !done) {
    return done;
  }
  if (auto done = add(options.f_number, "--f-number", "f-numbers", "1.4..16", FNumberLine); !done) return done;
  const auto closest = [&](const std::string& text) { return ClosestLine(text, options.closest_from); };
  if (auto done = add(options.closest, "--closest", "closest distance", "0.3m", closest); !done) return done;
  if (all) {
    lens.optics = lines;
    return {};
  }
  for (std::size_t at = 0; at < lines.size(); at = lines.find('\n', at) + 1) {
    lens.tables += "# [lens.optics] " + lines.substr(at, lines.find('\n', at) + 1 - at);
  }
  return {};
}

/// `AXIS=UNIT,PROFILE,LOW..HIGH`
std::expected<std::string, Failure> DriveTable(const std::string& text) {
  const auto wrong = [&] {
    return Refuse(Exit::Usage, "--drive '" + text +
                                   "': say axis, unit, profile and range, as in "
                                   "focus=1,oriental-az,0..20000");
  };
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos) return wrong();
  const std::string all = text.substr(equals + 1);
  const auto parts = SplitAtCommas(all);
  const std::string axis = text.substr(0, equals);
  if (parts.size() != 3 || axis.empty() || !std::ranges::all_of(axis, [](unsigned char c) { return islower(c); }))
    return wrong();
  const std::string range(parts[2]);
  const std::size_t dots = range.find("..");
  if (dots == std::string::npos) return wrong();
  const auto unit = ParseNumber(parts[0], "--drive");
  const auto low = ParseNumber(range.substr(0, dots), "--drive"), high = ParseNumber(range.substr(dots + 2), "--drive");
  if (!unit || !low || !high) return wrong();
  std::string profile(parts[1]);
  std::error_code none;
  if (profile.ends_with(".toml")) profile = std::filesystem::absolute(profile, none).string();
  return "[lens.drives." + axis + "]\nunit = " + unit->Text() + "\nprofile = " + QuotedToml(profile) + "\nrange = [" +
         low->Text() + ", " + high->Text() + "]\n";
}

/// `KEY=VALUE` as a line of TOML: numbers, true, false, arrays and what is in quotes as they are, all else as a string.
/// A file is named from here and not from the configuration.
std::expected<std::string, Failure> KeyLine(const std::string& text) {
  const std::size_t equals = text.find('=');
  const std::string key = text.substr(0, equals);
  const bool plain = !key.empty() && std::ranges::all_of(key, [](unsigned char c) { return isalnum(c) || c == '_'; });
  if (equals == std::string::npos || !plain || equals + 1 == text.size()) {
    return Refuse(Exit::Usage, "--set '" + text + "': say a key and its value, as in --set address=10.0.0.12");
  }
  std::string value = text.substr(equals + 1);
  if (key == "command" || key == "on_failure")
    return Refuse(Exit::Usage, "--set " + key +
                                   ": this key names a program; "
                                   "write it into the configuration yourself");
  std::error_code none;
  const bool as_it_is =
      ParseNumber(value, key) || value == "true" || value == "false" || value[0] == '[' || value[0] == '"';
  if (as_it_is && value.find('\n') == std::string::npos) return key + " = " + value + "\n";
  if (std::filesystem::is_regular_file(value, none)) value = std::filesystem::absolute(value, none).string();
  return key + " = " + QuotedToml(value) + "\n";
}

/// The keys of a found device, without the head that `devices` proposes.
std::string KeysOf(const Json& device) {
  const std::string config = TextOf(device, "config");
  const std::size_t driver = config.find("driver = ");
  std::string keys = driver == std::string::npos ? "" : config.substr(driver);
  if (!keys.empty() && keys.back() != '\n') keys += '\n';
  return keys;
}

std::string ProposedName(const std::string& model) {
  std::string name;
  for (const unsigned char letter : model) {
    if (isalnum(letter) != 0)
      name += static_cast<char>(tolower(letter));
    else if (!name.empty() && name.back() != '-')
      name += '-';
  }
  while (!name.empty() && name.back() == '-') name.pop_back();
  return name.empty() || isalpha(static_cast<unsigned char>(name[0])) == 0 ? "lens" : name;
}

std::string ListText(const Json& devices) {
  std::string text;
  int number = 0;
  for (const Json& device : devices) text += std::to_string(++number) + "  " + DeviceLine(device) + "\n";
  return text;
}

/// The found device of this number, to be had.
std::expected<Json, Failure> DeviceOf(const Json& devices, int number, const char* what) {
  if (number < 1 || static_cast<std::size_t>(number) > devices.size()) {
    return Refuse(Exit::NotFound, "there is no " + std::string(what) + " " + std::to_string(number) + ": " +
                                      std::to_string(devices.size()) + " found\n" + ListText(devices));
  }
  Json device = devices[static_cast<std::size_t>(number) - 1];
  if (device["usedBy"].is_string()) {
    return Refuse(Exit::Usage, TextOf(device, "model") + " is in use already, by " + TextOf(device, "usedBy"));
  }
  if (device["problem"].is_string()) {
    return Refuse(Exit::Unavailable, TextOf(device, "model") + " cannot be opened: " + TextOf(device, "problem"));
  }
  return device;
}

/// The device that is meant: by its number, the only lens that is not in use, or by asking.
std::expected<Json, Failure> ChooseDevice(const Session& session, const Json& devices, int number) {
  if (number != 0) return DeviceOf(devices, number, "device");
  std::vector<int> lenses;
  for (std::size_t i = 0; i < devices.size(); ++i) {
    if (devices[i].value("lens", false) && !devices[i]["usedBy"].is_string()) lenses.push_back(static_cast<int>(i) + 1);
  }
  const std::string list = ListText(devices);
  if (SomebodyIsThere(session) && !devices.empty()) {
    std::fprintf(stderr, "%snumber of the device: ", list.c_str());
    std::string text;
    if (!std::getline(std::cin, text)) return Refuse(Exit::Usage, "no device was chosen; nothing was added");
    return DeviceOf(devices, std::atoi(text.c_str()), "device");
  }
  if (lenses.size() == 1) return DeviceOf(devices, lenses[0], "device");
  if (lenses.empty()) {
    return Refuse(Exit::NotFound,
                  "no lens is found that is not in use; --driver and --set name one that no search "
                  "finds (docs/drivers), --bus and --drive one on Modbus\n" +
                      list);
  }
  return Refuse(Exit::Usage, "which one? say its number, as in lensctl add " + std::to_string(lenses[0]) + "\n" + list);
}

/// Device, bus, drives and camera of the lens. Returns the name to propose.
std::expected<std::string, Failure> AddDevice(const Session& session, const AddOptions& options, const Json& devices,
                                              NewLens& lens) {
  std::string model = options.driver, bus = options.bus;
  bool takes_pictures = options.driver == "aravis" || options.driver == "v4l2" || options.driver == "uvc";
  if (options.driver.empty() && (bus.empty() || options.number != 0)) {
    auto device = ChooseDevice(session, devices, options.number);
    if (!device) return PassOn(device);
    model = TextOf(*device, "model");
    takes_pictures = device->value("camera", false);
    if (TextOf(*device, "driver") == "modbus")
      bus = TextOf(*device, "node");
    else
      lens.keys = KeysOf(*device);
  } else if (!options.driver.empty() && options.driver != "modbus") {
    lens.keys = "driver = " + QuotedToml(options.driver) + "\n";
  }
  if (!bus.empty() || options.driver == "modbus") {
    if (bus.empty() || options.drives.empty()) {
      return Refuse(Exit::Usage,
                    "a lens on Modbus needs --bus (a serial port, or HOST:PORT) and a --drive for each axis, "
                    "as in --drive focus=1,oriental-az,0..20000");
    }
    model = "ring";
    lens.keys = "driver = \"modbus\"\nbus = @\n";
  }
  if (!bus.empty()) lens.bus = std::string(bus[0] == '/' ? "device" : "host") + " = " + QuotedToml(bus) + "\n";
  for (const std::string& one : options.keys) {
    auto line = KeyLine(one);
    if (!line) return PassOn(line);
    (bus.empty() ? lens.keys : lens.bus) += *line;
  }
  for (const std::string& one : options.drives) {
    if (bus.empty()) return Refuse(Exit::Usage, "--drive is for lenses on Modbus: say --bus too");
    auto table = DriveTable(one);
    if (!table) return PassOn(table);
    lens.tables += *table;
  }
  if (options.camera != 0) {
    auto camera = DeviceOf(devices, options.camera, "camera");
    if (!camera) return PassOn(camera);
    if (!camera->value("camera", false)) return Refuse(Exit::Usage, TextOf(*camera, "model") + " takes no pictures");
    lens.camera = KeysOf(*camera);
  }
  if (!options.pixel.empty() && options.pixel != kUnknown) {
    auto pixel = ParsePositiveLength(options.pixel, "--pixel");
    if (!pixel) return PassOn(pixel);
    if (!takes_pictures && lens.camera.empty()) return Refuse(Exit::Usage, "--pixel: this lens has no camera");
    const double um = pixel->Nearest().value_or(0.0) * 1e6;
    (lens.camera.empty() ? lens.keys : lens.camera) += "pixel_um = " + NumberTextOf(um) + "\n";
  }
  return ProposedName(model);
}

/// What is wrong with the options, before devices are searched and questions asked.
std::expected<void, Failure> CheckOptions(const AddOptions& options) {
  const auto given = [](const std::string& text) { return !text.empty() && text != kUnknown; };
  std::vector<Result<std::string>> lines;
  if (given(options.focal_length)) lines.push_back(FocalLengthLine(options.focal_length));
  if (given(options.f_number)) lines.push_back(FNumberLine(options.f_number));
  if (given(options.closest)) lines.push_back(ClosestLine(options.closest, options.closest_from));
  for (const auto& line : lines) {
    if (!line) return PassOn(line);
  }
  for (const std::string& key : options.keys) {
    if (auto line = KeyLine(key); !line) return PassOn(line);
  }
  for (const std::string& drive : options.drives) {
    if (auto table = DriveTable(drive); !table) return PassOn(table);
  }
  const bool plain = std::ranges::all_of(
      options.name, [](unsigned char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '-'; });
  if (!plain || (!options.name.empty() && options.name[0] < 'a')) {
    return Refuse(Exit::Usage, "--name '" + options.name +
                                   "': a name has small letters, digits and -, and begins with "
                                   "a letter");
  }
  return {};
}

std::expected<NewLens, Failure> Describe(const Session& session, const AddOptions& options, const Json& devices) {
  NewLens lens;
  auto proposed = AddDevice(session, options, devices, lens);
  if (!proposed) return PassOn(proposed);
  lens.name = options.name.empty() ? *proposed : options.name;
  const std::string bus_name = QuotedToml("bus-" + lens.name);
  if (const std::size_t at = lens.keys.find("bus = @"); at != std::string::npos)
    lens.keys.replace(at, 7, "bus = " + bus_name);
  if (!lens.bus.empty()) lens.bus = "[[bus]]\nname = " + bus_name + "\ndriver = \"modbus\"\n" + lens.bus;
  if (!options.direction.empty() && options.direction != kUnknown) {
    lens.tables += "[lens.focus]\ndirection = " + QuotedToml(options.direction) + "\n";
  }
  if (options.driver == "sim") return lens;  // its scene knows its optics
  if (auto asked = AskOptics(session, options, lens); !asked) return PassOn(asked);
  return lens;
}

/// The lens' state, once it is known whether its device is there.
std::expected<Json, Failure> Opened(DaemonClient& link, const std::string& lens) {
  constexpr Duration kAtMost = std::chrono::seconds(30), kAskEvery = std::chrono::milliseconds(50);
  const Instant deadline = MonotonicClock().Now() + kAtMost;
  for (;;) {
    auto reply = link.Ask(MethodOfLens("Status"), {{"lens", lens}});
    if (!reply) return PassOn(reply);
    Json status = (*reply)["lenses"][0];
    if (status["connection"] == "connected") return status;
    if (status["connection"] != "connecting" || MonotonicClock().Now() >= deadline) {
      const std::string why = TextOf(status, "error");
      return Refuse(Exit::Unavailable, why.empty() ? "lensd could not open it within 30 s" : why);
    }
    std::this_thread::sleep_for(kAskEvery);
  }
}

/// Mean of 0 to 255 and sharpness of one frame.
std::expected<Json, Failure> PictureNumbers(const Session& session, const std::string& lens) {
  Globals globals = session.globals();
  if (!globals.timeout) globals.timeout = std::chrono::seconds(15);
  auto link = DaemonClient::Open(Session(globals));
  if (!link) return PassOn(link);
  Json picture;
  std::optional<Error> wrong;
  std::vector<std::uint8_t> bytes;
  const auto take = [&](const Json& piece) {
    if (piece.contains("picture") && piece["picture"].is_object()) picture = piece["picture"];
    auto part = varlink::DecodeBase64(piece.value("data", ""));
    if (!part) wrong = part.error();
    if (part) bytes.insert(bytes.end(), part->begin(), part->end());
    return part && bytes.size() < piece.value("size", std::size_t{0});
  };
  Json view{{"lens", lens}, {"encoding", "gray8"}, {"scaleTo", {{"widthPx", 64}, {"heightPx", 64}}}};
  auto ended = link->Follow(MethodOfLens("View"), std::move(view), take);
  if (!ended) return PassOn(ended);
  if (wrong) return std::unexpected(Failure(*wrong));
  if (bytes.empty() || !picture.is_object()) return Refuse(Exit::Protocol, "lensd sent no picture");
  const double mean = std::accumulate(bytes.begin(), bytes.end(), 0.0) / static_cast<double>(bytes.size());
  return Json{{"mean", mean}, {"sharpness", picture.value("sharpness", Json())}};
}

/// Has lensd read the file and open the lens. The file is taken away again where that fails.
std::expected<Json, Failure> Start(DaemonClient& link, const Session& session, LensFile& file,
                                   const std::string& lens) {
  if (auto placed = file.Place(); !placed) return PassOn(placed);
  auto reloaded = link.Ask(MethodOfLens("Reload"), Json::object(), std::chrono::seconds(30));
  if (!reloaded) {
    file.TakeAway();
    return Refuse(reloaded.error().status,
                  "nothing was added: lensd refused the configuration: " + reloaded.error().message);
  }
  auto opened = Opened(link, lens);
  if (opened) return opened;
  file.TakeAway();
  std::string message = "nothing was added: " + opened.error().message;
  auto again = DaemonClient::Open(session);
  const auto removed = again ? again->Ask(MethodOfLens("Reload"), Json::object(), std::chrono::seconds(30))
                             : std::expected<Json, Failure>(PassOn(again));
  if (!removed) message += "; lensd has still read the file that is gone: lensctl reload";
  return Refuse(opened.error().status, message);
}

Outcome Report(Session& session, const LensFile& file, const NewLens& lens, DaemonClient& link) {
  auto info = FindInfo(link, lens.name);
  if (!info) return PassOn(info);
  const bool camera = info->contains("camera") && (*info)["camera"].is_object();
  auto numbers = camera ? PictureNumbers(session, lens.name)
                        : std::expected<Json, Failure>(Refuse(Exit::Done, "it has no camera"));
  const bool optics = info->contains("optics") && (*info)["optics"].is_object();
  if (session.json()) {
    session.PrintJson({{"name", lens.name},
                       {"file", file.path()},
                       {"optics", optics},
                       {"picture", numbers ? *numbers : Json()},
                       {"reason", numbers ? Json() : Json(numbers.error().message)}});
  } else {
    session.PrintText("added " + lens.name + ": " + file.path());
    session.PrintText(InfoText(*info));
    if (!optics) {
      session.PrintText(
          "its optics are not known: it moves in steps only; add [lens.optics] to this file "
          "(docs/lenses.md), then: lensctl reload");
    }
    session.PrintText(numbers ? "picture: mean " + NumberText(*numbers, "mean", 3, " of 255, sharpness ") +
                                    NumberText(*numbers, "sharpness", 3, "")
                              : "no picture: " + numbers.error().message);
  }
  return numbers || !camera ? Exit::Done : Exit::No;
}

Outcome Add(Session& session, const AddOptions& options) {
  if (auto fine = CheckOptions(options); !fine) return PassOn(fine);
  auto link = DaemonClient::Open(session);
  if (!link) return PassOn(link);
  auto found = link->Ask(MethodOfLens("Devices"), Json::object(), kDeviceSearch);
  if (!found) return PassOn(found);
  const std::string configuration = TextOf(*found, "configuration");
  if (configuration.empty()) {
    return Refuse(Exit::Config,
                  "this lensd runs without a configuration, so that no lens can be added: sudo mkdir -p "
                  "/etc/lensd/lensd.toml.d, then restart lensd");
  }
  const std::string folder = DropInFolder(configuration);
  if (auto may = MayWriteInto(folder); !may) return PassOn(may);
  auto lens = Describe(session, options, (*found)["devices"]);
  if (!lens) return PassOn(lens);
  if (IsLens(session, lens->name)) {
    return Refuse(Exit::Usage, "there is a lens \"" + lens->name + "\" already: choose another name with --name");
  }
  auto file = LensFile::Prepare(folder, lens->name, LensFileText(*lens));
  if (!file) return PassOn(file);
  link->WatchSignals({});  // from here on Control-C ends a call, and what was begun is undone
  auto started = Start(*link, session, *file, lens->name);
  if (!started) return PassOn(started);
  file->Keep();
  return Report(session, *file, *lens, *link);
}

}  // namespace

void AddAdd(CLI::App& root, Run& run) {
  auto options = std::make_shared<AddOptions>();
  auto* command =
      root.add_subcommand(
              "add",
              "add a lens that is plugged in: write a file for it beside the configuration, have lensd read "
              "it, and look at a picture; asks at a terminal for what is left out")
          ->group(kOnline);
  command->add_option("N", options->number, "the number of the device in the list; the only lens when left out")
      ->check(CLI::PositiveNumber);
  const auto text = [&](const char* option, std::string& into, const char* help, const char* type) {
    command->add_option(option, into, help)->type_name(type);
  };
  text("--name", options->name, "the name of the lens; after its model when left out", "NAME");
  text("--model", options->model, "its optics by the name of a model (docs/lenses.md)", "MODEL");
  text("--focal-length", options->focal_length, "of its data sheet, as in 25mm or 8mm..48mm; or unknown", "LENGTH");
  text("--f-number", options->f_number, "widest and smallest opening, as in 1.4..16 or 1.8; or unknown", "F");
  text("--closest", options->closest, "closest distance in focus, as in 0.3m; or unknown", "DEPTH");
  command
      ->add_option("--closest-from", options->closest_from, "where its maker measures that from: lens, sensor, front")
      ->check(CLI::IsMember(std::vector<std::string>(kFromNames.begin(), kFromNames.end())));
  text("--pixel", options->pixel, "the size of a pixel where the camera does not report it; or unknown", "LENGTH");
  command->add_option("--direction", options->direction, "which way focus counts; lensctl setup --at finds it out")
      ->check(CLI::IsMember({"near-positive", "near-negative", kUnknown}));
  command
      ->add_option("--camera", options->camera,
                   "the number of the device that takes the pictures, if it is another one")
      ->check(CLI::PositiveNumber);
  text("--driver", options->driver, "the driver of a device that no search finds; with --set", "DRIVER");
  text("--bus", options->bus, "Modbus: the serial port, or HOST:PORT", "PORT");
  const auto list = [&](const char* option, std::vector<std::string>& into, const char* help, const char* type) {
    command->add_option(option, into, help)->type_name(type)->take_all()->allow_extra_args(false);
  };
  list("--set", options->keys,
       "a key of the driver (docs/drivers), as in address=10.0.0.12; on Modbus of the bus, as in baud=9600",
       "KEY=VALUE");
  list("--drive", options->drives, "Modbus: axis, unit, profile and range, as in focus=1,oriental-az,0..20000",
       "DRIVE");
  command->callback([&run, options] { run = [options](Session& session) { return Add(session, *options); }; });
}

}  // namespace lensd::cli
