// The recording is read whole; frames are found by position, so that a replay may ask for any place in any order.
#include "bench/autofocus/recording.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "io/png.h"

namespace lensd::bench {
namespace {

using nlohmann::json;

Result<drivers::Frame> LoadPicture(const std::string& path, const json& about) {
  auto image = io::ReadPng(path);
  if (!image) return PassOn(image);
  if (image->channels != 1) return Fail(Code::BadData, path + ": a recorded frame must be grey");
  drivers::Frame frame;
  frame.width = image->width;
  frame.height = image->height;
  frame.bits = about.at("bits");
  frame.gamma = about.at("gamma");
  if (frame.bits < 1 || frame.bits > 16 || !(frame.gamma > 0)) {
    return Fail(Code::BadData, path + ": 1 to 16 bits a sample, and a gamma above 0");
  }
  if (std::ranges::max(image->samples) >> frame.bits != 0) {
    return Fail(Code::BadData, path + ": samples above the full scale of " + std::to_string(frame.bits) + " bits");
  }
  frame.samples = std::make_shared<const std::vector<std::uint16_t>>(std::move(image->samples));
  return frame;
}

autofocus::Setup SetupFrom(const json& search) {
  autofocus::Setup setup;
  setup.lowest = search.at("lowest");
  setup.highest = search.at("highest");
  setup.resolution = search.at("resolution");
  setup.focal_length = search.value("focalLength", 0.0);
  if (search.at("blurPx").is_number()) setup.blur_px = search.at("blurPx").get<double>();
  if (search.contains("step")) setup.step = search.at("step").get<double>();
  setup.no_stride = "a recording cannot show a lens in motion";
  return setup;
}

Result<RecordedRun> RunFrom(const json& all, const std::string& directory) {
  RecordedRun run;
  const json& search = all.at("search");
  run.setup = SetupFrom(search);
  run.unit = search.at("unit");
  auto policy = autofocus::PolicyFromName(all.at("policy").get<std::string>());
  if (!policy) return PassOn(policy);
  run.policy = *policy;
  for (const json& region : all.at("regions")) {
    run.regions.push_back({region.at("x"), region.at("y"), region.at("w"), region.at("h")});
  }
  run.focused = all.at("result").at("focused");
  run.method = all.at("result").at("method");
  for (const json& taken : all.at("frames")) {
    auto frame = LoadPicture(directory + "/" + taken.at("file").get<std::string>(), taken);
    if (!frame) return PassOn(frame);
    run.frames.push_back({.at = taken.at(search.at("at").get<std::string>()),
                          .backlash_open = taken.at("state") == "backlashOpen",
                          .frame = *std::move(frame)});
  }
  if (run.frames.empty() || run.regions.empty() || !(run.setup.highest > run.setup.lowest) ||
      !(run.setup.resolution > 0.0)) {
    return Fail(Code::BadData, directory + "/run.json: no frames, no regions, or no range to search");
  }
  // On which side the second frame is taken tells the direction that takes the backlash up.
  if (run.frames.size() > 1) run.setup.ascending = run.frames[1].at >= run.frames[0].at;
  return run;
}

/// The nearest one, of those with the backlash as it is wanted where there are such.
const RecordedFrame& NearestTo(const RecordedRun& run, const autofocus::GoAndLook& wanted) {
  const auto cost = [&](const RecordedFrame& frame) {
    return std::pair(frame.backlash_open != wanted.backlash_open, std::abs(frame.at - wanted.position));
  };
  return *std::ranges::min_element(run.frames, {}, cost);
}

}  // namespace

Result<RecordedRun> LoadRun(const std::string& directory) {
  std::ifstream file(directory + "/run.json");
  if (!file) return Fail(Code::Io, "cannot open " + directory + "/run.json");
  try {
    return RunFrom(json::parse(file), directory);
  } catch (const json::exception& error) {
    return Fail(Code::BadData, directory + "/run.json: " + error.what());
  }
}

Result<ReplayedRun> ReplayOf(const RecordedRun& run, const std::string& method) {
  constexpr double kSamePlace = 1.5;  // positions: motors round
  constexpr int kMostFrames = 1000;   // many times what any method takes
  auto session = autofocus::Regions::Create(method, run.setup, run.regions, run.policy);
  if (!session) return PassOn(session);
  ReplayedRun replayed;
  const RecordedFrame* shown = &run.frames.front();
  for (int i = 0; i < kMostFrames; ++i) {
    auto advice = session->Next(shown->at, shown->frame);
    if (!advice) return PassOn(advice);
    if (const auto* go = std::get_if<autofocus::GoAndLook>(&*advice)) {
      shown = &NearestTo(run, *go);
      replayed.elsewhere += std::abs(shown->at - go->position) > kSamePlace * run.setup.resolution;
      continue;
    }
    replayed.verdict = std::get<autofocus::Verdict>(*advice);
    replayed.method = session->method();
    replayed.frames = session->frames();
    replayed.end = shown->at;
    return replayed;
  }
  return Fail(Code::Timeout, "the method '" + method + "' does not come to an end on these frames");
}

}  // namespace lensd::bench
