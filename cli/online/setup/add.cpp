// add: a lens of one's own, from what is plugged in to a picture, without a file to edit.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "cli/link/daemon_client.h"
#include "cli/link/lens_info.h"
#include "cli/online/commands.h"
#include "cli/online/setup/add_device.h"
#include "cli/online/setup/add_lines.h"
#include "cli/online/setup/add_proof.h"
#include "cli/online/setup/devices.h"
#include "cli/online/setup/lens_file.h"
#include "cli/text/texts.h"

namespace lensd::cli {
namespace {

using varlink::Json;

constexpr Duration kOthersAtMost = std::chrono::minutes(2);  ///< that another program is waited for, which adds a lens

bool IsGiven(const std::string& text) {
  return !text.empty() && text != kUnknown;
}

/// Focal length, f-numbers and closest distance belong together: with one of them unknown the others stay as a comment.
std::expected<void, Failure> AskOptics(const Session& session, const AddOptions& options, NewLens& lens) {
  if (IsGiven(options.model)) {
    lens.keys += "optics = " + QuotedToml(options.model) + "\n";
    return {};
  }
  const bool left_out = options.focal_length.empty() && options.f_number.empty() && options.closest.empty();
  if (!options.model.empty() && left_out) return {};
  bool all = true;
  std::string lines;
  const auto add = [&](const std::string& given, const Question& question,
                       const auto& line_of) -> std::expected<void, Failure> {
    const auto line = AnsweredLine(session, given, question, line_of);
    if (!line) return PassOn(line);
    all = all && !line->empty();
    lines += *line;
    return {};
  };
  const auto closest = [&](const std::string& text) { return ClosestLine(text, options.closest_from); };
  if (auto done = add(options.focal_length, {"--focal-length", "focal length", "25mm"}, FocalLengthLine); !done)
    return done;
  if (auto done = add(options.f_number, {"--f-number", "f-numbers", "1.4..16"}, FNumberLine); !done) return done;
  if (auto done = add(options.closest, {"--closest", "closest distance", "0.3m"}, closest); !done) return done;
  if (all) {
    lens.optics = lines;
    return {};
  }
  for (std::size_t at = 0; at < lines.size(); at = lines.find('\n', at) + 1) {
    lens.tables += "# [lens.optics] " + lines.substr(at, lines.find('\n', at) + 1 - at);
  }
  return {};
}

/// Options of the optics that would have no effect beside the others.
std::expected<void, Failure> CheckOptics(const AddOptions& options) {
  const bool simulated = options.driver == "sim";
  const std::pair<const char*, const std::string*> optics[] = {
      {"--focal-length", &options.focal_length}, {"--f-number", &options.f_number}, {"--closest", &options.closest},
      {"--closest-from", &options.closest_from}, {"--pixel", &options.pixel},       {"--model", &options.model}};
  for (const auto& [option, text] : optics) {
    if (text->empty()) continue;
    if (simulated && IsGiven(*text)) {
      return Refuse(Exit::Usage, std::string(option) +
                                     ": a simulated lens takes its optics and its pixels from its scene: leave this "
                                     "option out, or change the scene");
    }
    if (IsGiven(options.model) && text != &options.model && text != &options.pixel) {
      return Refuse(Exit::Usage, std::string(option) + ": --model names the optics already: give one of the two");
    }
  }
  if (!options.closest_from.empty() && options.closest == kUnknown) {
    return Refuse(Exit::Usage,
                  "--closest-from says where --closest starts, and that is unknown: leave one of them out");
  }
  return {};
}

/// What is wrong with the options, before devices are searched and questions asked.
std::expected<void, Failure> CheckOptions(const AddOptions& options) {
  std::vector<Result<std::string>> lines;
  if (IsGiven(options.focal_length)) lines.push_back(FocalLengthLine(options.focal_length));
  if (IsGiven(options.f_number)) lines.push_back(FNumberLine(options.f_number));
  if (IsGiven(options.closest)) lines.push_back(ClosestLine(options.closest, options.closest_from));
  if (IsGiven(options.pixel)) lines.push_back(PixelLine(options.pixel));
  for (const auto& line : lines) {
    if (!line) return PassOn(line);
  }
  for (const std::string& key : options.keys) {
    if (auto line = KeyLine(key); !line) return PassOn(line);
  }
  for (const std::string& drive : options.drives) {
    if (auto table = DriveTable(drive); !table) return PassOn(table);
  }
  if (auto fine = CheckOptics(options); !fine) return fine;
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
  const auto device = AddDevice(session, options, devices, lens);
  if (!device) return PassOn(device);
  lens.name = options.name.empty() ? device->name : options.name;
  const std::string bus_name = QuotedToml("bus-" + lens.name);
  if (const std::size_t at = lens.keys.find("bus = @"); at != std::string::npos)
    lens.keys.replace(at, 7, "bus = " + bus_name);
  if (!lens.bus.empty()) lens.bus = "[[bus]]\nname = " + bus_name + "\ndriver = \"modbus\"\n" + lens.bus;
  if (!options.direction.empty() && options.direction != kUnknown) {
    lens.tables += "[lens.focus]\ndirection = " + QuotedToml(options.direction) + "\n";
  }
  if (options.driver == "sim") return lens;  // its scene knows its optics
  if (auto asked = AskOptics(session, options, lens); !asked) return PassOn(asked);
  if (auto asked = AddPixel(session, options, *device, lens); !asked) return PassOn(asked);
  return lens;
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
  auto file = LensFile::Prepare(folder, lens->name, LensFileText(*lens), kOthersAtMost);
  if (!file) return PassOn(file);
  if (IsLens(session, lens->name)) {  // another program has added it meanwhile
    return Refuse(Exit::Usage, "there is a lens \"" + lens->name + "\" by now: choose another name with --name");
  }
  link->WatchSignals({});  // from here on Control-C ends a call, and what was begun is undone
  if (auto started = StartAdded(*link, session, *file, lens->name); !started) return PassOn(started);
  file->Keep();
  return ReportAdded(session, *file, lens->name, *link);
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
