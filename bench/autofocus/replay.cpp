// Recorded focal stacks through the session. One step of the lens is one frame, so that every picture shown is a real
// one. Positions are frame numbers; the blur a frame adds is told as the stack's file says, or wrong on purpose.
#include "bench/autofocus/replay.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>

#include "autofocus/regions.h"
#include "io/png.h"

namespace lensd::bench {
namespace {

constexpr Duration kFrameTime = std::chrono::milliseconds(100);  ///< from one frame to the next, moves included

using nlohmann::json;

Result<drivers::Frame> LoadFrame(const std::string& path, double gamma) {
  auto image = io::ReadPng(path);
  if (!image) return PassOn(image);
  if (image->channels != 1) return Fail(Code::BadData, path + ": a stack's pictures must be grey");
  drivers::Frame frame;
  frame.width = image->width;
  frame.height = image->height;
  frame.bits = image->bits;
  frame.gamma = gamma;
  frame.samples = std::make_shared<const std::vector<std::uint16_t>>(std::move(image->samples));
  return frame;
}

StackRegion RegionFrom(const json& from) {
  StackRegion region;
  const json& roi = from.at("roi");
  region.region = {roi.at(0), roi.at(1), roi.at(2), roi.at(3)};
  region.kind = from.at("kind");
  region.best = from.at("best");
  region.lowest = from.at("lowest");
  region.highest = from.at("highest");
  return region;
}

drivers::Frame Cropped(const drivers::Frame& frame, const autofocus::Window& window) {
  drivers::Frame part = frame;
  part.width = window.width;
  part.height = window.height;
  std::vector<std::uint16_t> samples;
  for (int y = window.y; y < window.y + window.height; ++y) {
    const auto row = frame.samples->begin() + static_cast<std::ptrdiff_t>(y) * frame.width + window.x;
    samples.insert(samples.end(), row, row + window.width);
  }
  part.samples = std::make_shared<const std::vector<std::uint16_t>>(std::move(samples));
  return part;
}

ReplayEnd Judge(const ReplayRun& run, double off, double px) {
  if (off <= std::max(1.0, 2.0 / px)) return ReplayEnd::Within;
  return off > std::max(2.0, 4.0 / px) || run.region.kind == "outside" ? ReplayEnd::False : ReplayEnd::Off;
}

Result<ReplayRun> RunOnce(const Stack& stack, const std::vector<drivers::Frame>& frames, const StackRegion& region,
                          int start, const ReplayOptions& options, const std::optional<autofocus::KnownSlope>& slope) {
  ReplayRun run{.stack = stack.name, .region = region, .start = start, .method = {}, .reason = {}};
  autofocus::Setup setup;
  setup.highest = static_cast<double>(frames.size()) - 1.0;
  setup.resolution = 1.0;
  setup.blur_px = 1.0 / (stack.blur_px_per_frame * options.slope_error);
  if (slope) autofocus::GoBy(*slope, setup);
  const drivers::Region shown = options.crop ? drivers::Region{0.0, 0.0, 1.0, 1.0} : region.region;
  auto session = autofocus::Regions::Create(options.method, setup, {shown}, autofocus::Policy::Nearest);
  if (!session) return PassOn(session);
  double at = start;
  for (Instant shown_at{};; shown_at += kFrameTime) {
    drivers::Frame frame = frames[static_cast<std::size_t>(at)];
    frame.exposure_start = frame.exposure_end = shown_at;
    auto advice = session->Next(at, frame);
    if (!advice) return PassOn(advice);
    if (const auto* go = std::get_if<autofocus::GoAndLook>(&*advice)) {
      at = std::clamp(std::round(go->position), setup.lowest, setup.highest);
      continue;
    }
    const auto& verdict = std::get<autofocus::Verdict>(*advice);
    run.end = at;
    run.frames = session->frames();
    run.sigma = verdict.sigma;
    run.method = session->method();
    run.reason = verdict.reason;
    if (verdict.focused && verdict.log_slope) run.log_slope = *verdict.log_slope + (slope ? slope->log_factor : 0.0);
    run.uneven = verdict.uneven;
    const double off = region.kind == "several depths" ? std::max({region.lowest - at, at - region.highest, 0.0})
                                                       : std::abs(at - region.best);
    run.off_px = off * stack.blur_px_per_frame;
    run.how = verdict.focused ? Judge(run, off, stack.blur_px_per_frame) : ReplayEnd::Refused;
    return run;
  }
}

}  // namespace

Result<std::vector<Stack>> LoadStacks(const std::string& directory, double gamma) {
  std::ifstream file(directory + "/stacks.json");
  if (!file) return Fail(Code::Io, "cannot open " + directory + "/stacks.json");
  std::vector<Stack> stacks;
  try {
    const json all = json::parse(file);
    for (const auto& [name, content] : all.items()) {
      std::string folder = directory;
      folder.append("/").append(name);
      Stack stack{.name = name, .blur_px_per_frame = content.at("blur_px_per_frame"), .frames = {}, .regions = {}};
      for (int i = 0; i < content.at("frames").get<int>(); ++i) {
        char number[16];
        std::snprintf(number, sizeof number, "/%02d.png", i);
        auto frame = LoadFrame(folder + number, gamma);
        if (!frame) return PassOn(frame);
        stack.frames.push_back(*std::move(frame));
      }
      for (const json& region : content.at("regions")) stack.regions.push_back(RegionFrom(region));
      stacks.push_back(std::move(stack));
    }
  } catch (const json::exception& error) {
    return Fail(Code::BadData, directory + "/stacks.json: " + error.what());
  }
  return stacks;
}

namespace {

/// What the answers in other regions of one stack have shown, one from each region in turn.
std::optional<autofocus::KnownSlope> TaughtElsewhere(const std::vector<ReplayRun>& runs, std::size_t region,
                                                     std::size_t starts) {
  autofocus::SlopeLearner learner;
  std::optional<double> last_focus;
  for (std::size_t start = 0; start < starts; ++start) {
    for (std::size_t other = 0; other * starts < runs.size(); ++other) {
      const ReplayRun& run = runs[other * starts + start];
      if (other == region || !run.log_slope) continue;
      learner.Add({*run.log_slope, run.uneven});
      last_focus = run.end;
    }
  }
  auto known = learner.Known();
  if (known) known->last_focus = last_focus;
  return known;
}

/// Every region of one stack from every start; `taught` by earlier runs of the same, where not empty.
Result<std::vector<ReplayRun>> ReplayStack(const Stack& stack, const ReplayOptions& options,
                                           const std::vector<ReplayRun>& taught) {
  std::vector<ReplayRun> runs;
  for (std::size_t at = 0; at < stack.regions.size(); ++at) {
    const StackRegion& region = stack.regions[at];
    auto slope = TaughtElsewhere(taught, at, static_cast<std::size_t>(options.starts));
    if (slope) slope->log_factor += std::log(options.other_lens);
    std::vector<drivers::Frame> frames = stack.frames;
    if (options.crop) {
      auto window = autofocus::WindowOf(region.region, frames.front().width, frames.front().height);
      if (!window) return PassOn(window);
      for (drivers::Frame& frame : frames) frame = Cropped(frame, *window);
    }
    for (int i = 0; i < options.starts; ++i) {
      const auto last = static_cast<double>(frames.size()) - 1.0;
      const int start = static_cast<int>(std::lround(last * (i + 0.5) / options.starts));
      auto run = RunOnce(stack, frames, region, start, options, slope);
      if (!run) return PassOn(run);
      runs.push_back(*std::move(run));
    }
  }
  return runs;
}

}  // namespace

Result<std::vector<ReplayRun>> Replay(const std::vector<Stack>& stacks, const ReplayOptions& options) {
  std::vector<ReplayRun> all;
  for (const Stack& stack : stacks) {
    auto runs = ReplayStack(stack, options, {});
    if (runs && options.learn) runs = ReplayStack(stack, options, *runs);
    if (!runs) return PassOn(runs);
    all.insert(all.end(), runs->begin(), runs->end());
  }
  return all;
}

}  // namespace lensd::bench
