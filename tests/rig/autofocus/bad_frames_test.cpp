// Searches with frames from outside in which one frame is bad, or every frame is one move late, on recorded stacks of
// real lenses: the picture of where the lens stands is looked up, so the truth knows nothing of how frames are judged.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <deque>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>

#include "io/png.h"
#include "rig/rig.h"
#include "rig_on_sim.h"
#include "sim/scene.h"
#include "sim/world.h"
#include "test_level.h"

namespace lensd::rig {
namespace {

using namespace std::chrono_literals;
using Samples = std::vector<std::uint16_t>;

constexpr double kFNumber = 2.8, kPixelUm = 3.45;

/// Bad: the one frame. Late: all of them, the first one of where the lens stands or of where it was before.
enum class Kind {
  Healthy,
  Black,
  DarkNoise,
  White,
  Truncated,
  GreyRows,
  Torn,
  Stale,
  StaleWithNoise,
  Late,
  LateFromBefore
};
constexpr Kind kSingle[] = {Kind::Black,    Kind::DarkNoise, Kind::White, Kind::Truncated,
                            Kind::GreyRows, Kind::Torn,      Kind::Stale, Kind::StaleWithNoise};
constexpr const char* kNames[] = {"healthy", "black", "dark noise",       "white", "truncated",       "grey rows",
                                  "torn",    "stale", "stale with noise", "late",  "late from before"};

/// A part of the stack's pictures at one depth, and where it is in focus, in frames with decimals.
struct StackRegion {
  drivers::Region region;
  double best = 0.0;
};

struct Stack {
  std::string name;
  double blur_px_per_frame = 1.0;
  std::vector<drivers::Frame> frames;
  std::vector<StackRegion> regions;
};

Stack LoadStack(const std::string& folder, const std::string& name, const nlohmann::json& content) {
  Stack stack{.name = name, .blur_px_per_frame = content.at("blur_px_per_frame"), .frames = {}, .regions = {}};
  for (int i = 0; i < content.at("frames").get<int>(); ++i) {
    std::string path = folder;
    path.append("/").append(name).append(i < 10 ? "/0" : "/").append(std::to_string(i)).append(".png");
    auto image = io::ReadPng(path);
    if (!image) throw std::runtime_error(image.error().message);
    drivers::Frame frame;
    frame.width = image->width;
    frame.height = image->height;
    frame.bits = image->bits;
    frame.gamma = 2.2;
    frame.samples = std::make_shared<const Samples>(std::move(image->samples));
    stack.frames.push_back(std::move(frame));
  }
  for (const auto& region : content.at("regions")) {
    const auto& roi = region.at("roi");
    if (region.at("kind") != "one depth" || region.value("clipped", 0.0) > 0.01) continue;
    stack.regions.push_back({{roi.at(0), roi.at(1), roi.at(2), roi.at(3)}, region.at("best")});
  }
  return stack;
}

enum class SearchEnd { Within, Off, False, Refused };

struct Search {
  const Stack* stack = nullptr;
  const StackRegion* region = nullptr;
  std::string method;
  int start = 0;
  Kind kind = Kind::Healthy;
  int bad = 0;          ///< number of the frame, from 1
  std::size_t lag = 1;  ///< frames, of a late camera
  unsigned seed = 0;
};

struct Ended {
  SearchEnd how = SearchEnd::Refused;
  int asked = 0;  ///< frames
  rig::AutofocusOutcome outcome;
};

/// A lens with one step a frame, whose blur a step is that of the stack.
class StackLens {
 public:
  explicit StackLens(const Stack& stack) {
    const double reach_mm =
        (static_cast<double>(stack.frames.size()) - 1.0) * stack.blur_px_per_frame * kFNumber * kPixelUm * 1e-3;
    std::ostringstream text;
    text << "version = 1\n[camera]\nwidth = 64\nheight = 48\npixel_um = 3.45\nframe_rate_hz = 500\nexposure_ms = 1\n"
            "[lens]\nfocal_length_mm = 50\nf_number = 2.8\nextension_mm = [0.0, "
         << reach_mm << "]\nsteps = " << stack.frames.size()
         << "\nspeed_steps_per_s = 20000\nacceleration_steps_per_s2 = 20000000\nsettle_ms = 0\n[[surface]]\n"
            "kind = \"wall\"\ndistance_m = 1.0\nconstant = 0.5\n[truth]\nregion = [0.2, 0.2, 0.6, 0.6]\n";
    scene_ = testing::SceneFromText(text.str());
  }
  sim::World Open(const Clock& clock, int start) const {
    auto world = sim::OpenWorld(scene_, clock, {.focus_start = Native{static_cast<double>(start)}});
    EXPECT_TRUE(world) << world.error().message;
    world->device.camera.reset();
    return *std::move(world);
  }

 private:
  std::shared_ptr<const sim::Scene> scene_;
};

/// What a camera before such a lens sends.
class BadCamera {
 public:
  BadCamera(const Search& search) : search_(search), random_(search.seed) {}

  drivers::Frame Take(int place) {
    ++number_;
    drivers::Frame frame = search_.stack->frames.front();
    auto samples = std::make_shared<Samples>(Seen(ShownPlace(place)));
    if (number_ == search_.bad) Spoil(frame, *samples);
    before_ = samples;
    place_before_ = place;
    frame.samples = samples;
    return frame;
  }
  int number() const { return number_; }

 private:
  int ShownPlace(int place) {
    const bool from_before = search_.kind == Kind::LateFromBefore;
    if (search_.kind == Kind::Late || from_before) {
      while (number_ == 1 && waiting_.size() < search_.lag) {
        waiting_.push_back(from_before ? static_cast<int>(random_() % search_.stack->frames.size()) : place);
      }
      waiting_.push_back(place);
      const int shown = waiting_.front();
      waiting_.pop_front();
      return shown;
    }
    const bool stale = search_.kind == Kind::StaleWithNoise && number_ == search_.bad;
    return stale && number_ > 1 ? place_before_ : place;
  }
  Samples Seen(int place) {
    Samples seen = *search_.stack->frames[static_cast<std::size_t>(place)].samples;
    for (auto& sample : seen) {
      const int noisy = sample + static_cast<int>(random_() % 3) - 1;
      sample = static_cast<std::uint16_t>(std::clamp(noisy, 0, 255));
    }
    return seen;
  }
  /// A row inside the region, so that the damage counts.
  std::size_t RowInRegion(const drivers::Frame& frame) {
    const auto& region = search_.region->region;
    const double part = region.y + region.height * (0.1 + 0.8 * static_cast<double>(random_() % 1000) / 1000.0);
    return static_cast<std::size_t>(part * frame.height) * static_cast<std::size_t>(frame.width);
  }
  void Spoil(const drivers::Frame& frame, Samples& samples) {
    switch (search_.kind) {
      case Kind::Black:
        std::ranges::fill(samples, 0);
        break;
      case Kind::DarkNoise:
        for (auto& sample : samples) sample = static_cast<std::uint16_t>(random_() % 4);
        break;
      case Kind::White:
        std::ranges::fill(samples, 255);
        break;
      case Kind::Truncated:
        std::fill(samples.begin() + static_cast<std::ptrdiff_t>(RowInRegion(frame)), samples.end(), 0);
        break;
      case Kind::GreyRows:
        std::fill(samples.begin() + static_cast<std::ptrdiff_t>(RowInRegion(frame)), samples.end(), 128);
        break;
      case Kind::Torn:
        if (before_) {
          const auto from = static_cast<std::ptrdiff_t>(RowInRegion(frame));
          std::copy(before_->begin() + from, before_->end(), samples.begin() + from);
        }
        break;
      case Kind::Stale:
        if (before_) samples = *before_;
        break;
      default:
        break;
    }
  }

  const Search& search_;
  std::mt19937 random_;
  int number_ = 0;
  int place_before_ = 0;
  std::deque<int> waiting_;  ///< places that later frames will show
  std::shared_ptr<const Samples> before_;
};

/// Every frame of a search was used or left out, and none of them both.
void ExpectEachFrameOnce(const rig::AutofocusOutcome& outcome) {
  std::vector<int> numbers, all;
  for (const AutofocusSample& used : outcome.samples) numbers.push_back(used.frame);
  for (const LeftOutFrame& left_out : outcome.left_out) numbers.push_back(left_out.frame);
  std::ranges::sort(numbers);
  for (int number = 0; number < outcome.frames; ++number) all.push_back(number);
  EXPECT_EQ(numbers, all) << outcome.reason;
}

/// A lens and its camera, for as many searches as one likes.
class Setting {
 public:
  Setting(const Search& first, const StackLens& lens) : camera_(first) {
    auto world = lens.Open(clock_, first.start);
    rig_ = *rig::Rig::Create({}, std::move(world.device), clock_);
  }
  int taken() const { return camera_.number(); }
  void MoveTo(int place) {
    std::optional<Result<rig::MoveOutcome>> moved;
    rig_->Move(drivers::Axis::Focus,
               {.kind = rig::Target::Kind::Native, .value = static_cast<double>(place), .from = {}, .take_up = {}},
               [&](Result<rig::MoveOutcome> end) { moved = std::move(end); });
    const Instant latest = clock_.Now() + 100s;
    while (!moved && clock_.Now() < latest) clock_.AdvanceTo(std::max(rig_->Step(clock_.Now()), Soon()));
    EXPECT_TRUE(moved && *moved && (*moved)->reached);
  }
  Ended Go(const Search& search) {
    std::optional<rig::FrameWanted> wanted;
    std::optional<Result<rig::AutofocusOutcome>> answer;
    rig::AutofocusRequest request;
    request.method = search.method;
    request.regions = {search.region->region};
    request.outside = rig::OutsideCamera{
        .pixel_um = kPixelUm, .scores_only = false, .wanted = [&](const rig::FrameWanted& now) { wanted = now; }};
    rig_->Autofocus(std::move(request), nullptr, [&](Result<rig::AutofocusOutcome> end) { answer = std::move(end); });
    const int before = camera_.number();
    const Instant latest = clock_.Now() + 1000s;
    while (!answer && clock_.Now() < latest) {
      const Instant next = rig_->Step(clock_.Now());
      if (wanted) {
        drivers::Frame frame = camera_.Take(static_cast<int>(std::lround(wanted->position.value)));
        frame.exposure_start = std::max(clock_.Now(), wanted->since);
        frame.exposure_end = frame.exposure_start + 1ms;
        clock_.AdvanceTo(frame.exposure_end);
        wanted.reset();
        rig_->GiveFrame(std::move(frame),
                        [](const Result<void>& taken) { EXPECT_TRUE(taken) << taken.error().message; });
      } else {
        clock_.AdvanceTo(std::max(next, Soon()));
      }
    }
    Ended ended;
    EXPECT_TRUE(answer && *answer) << (answer ? (*answer).error().message : "did not end");
    if (!answer || !*answer) return ended;
    ended.asked = camera_.number() - before;
    ended.outcome = **answer;
    ExpectEachFrameOnce(ended.outcome);
    if (!ended.outcome.focused) return ended;
    const double px = search.stack->blur_px_per_frame;
    const double off = std::abs(ended.outcome.position.value - search.region->best);
    ended.how = off <= std::max(1.0, 2.0 / px)  ? SearchEnd::Within
                : off > std::max(2.0, 4.0 / px) ? SearchEnd::False
                                                : SearchEnd::Off;
    return ended;
  }

 private:
  Instant Soon() const { return clock_.Now() + 100us; }

  SteppedClock clock_;
  std::unique_ptr<rig::Rig> rig_;
  BadCamera camera_;
};

std::string Told(const Search& search, const Ended& ended) {
  return search.stack->name + " best " + std::to_string(search.region->best) + " start " +
         std::to_string(search.start) + " " + search.method + " " + kNames[static_cast<std::size_t>(search.kind)] +
         " frame " + std::to_string(search.bad) + " seed " + std::to_string(search.seed) + ": ended at " +
         std::to_string(ended.outcome.position.value) + " " + ended.outcome.reason;
}

class BadFrames : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const std::string folder = std::string(LENSD_SOURCE_DIR) + "/tests/bench/stacks";
    std::ifstream file(folder + "/stacks.json");
    const auto all = nlohmann::json::parse(file);
    for (const auto& [name, content] : all.items()) {
      Stack stack = LoadStack(folder, name, content);
      if (!stack.regions.empty()) stacks_.push_back(std::move(stack));
    }
    for (const Stack& stack : stacks_) lenses_.emplace_back(stack);
  }
  static void TearDownTestSuite() {
    stacks_.clear();
    lenses_.clear();
  }
  /// A search of a region at one depth.
  static Search Draw(std::mt19937& random) {
    constexpr const char* kMethods[] = {"auto", "auto", "sweep", "hill-climb"};
    Search search;
    search.stack = &stacks_[random() % stacks_.size()];
    search.region = &search.stack->regions[random() % search.stack->regions.size()];
    search.method = kMethods[random() % std::size(kMethods)];
    search.start = static_cast<int>(random() % search.stack->frames.size());
    search.seed = random();
    return search;
  }
  static Ended Go(const Search& search) { return Setting(search, LensOf(search)).Go(search); }
  static const StackLens& LensOf(const Search& search) {
    return lenses_[static_cast<std::size_t>(search.stack - stacks_.data())];
  }

  static std::vector<Stack> stacks_;
  static std::vector<StackLens> lenses_;
};
std::vector<Stack> BadFrames::stacks_;
std::vector<StackLens> BadFrames::lenses_;

TEST_F(BadFrames, OneIsTakenAgainAndTheAnswerStands) {
  std::mt19937 random(38);
  struct Count {
    int runs = 0, within = 0, refused = 0, off = 0, wrong = 0, named = 0;
  };
  std::map<Kind, Count> counts;
  std::vector<int> more_frames;  ///< of a healthy camera
  const int runs = static_cast<int>(testing::ByLevel(12, 240, 4000));
  for (int i = 0; i < runs; ++i) {
    Search search = Draw(random);
    const Ended healthy = Go(search);
    more_frames.push_back(static_cast<int>(healthy.outcome.left_out.size()));
    EXPECT_EQ(healthy.asked, healthy.outcome.frames);
    if (healthy.how != SearchEnd::Within) continue;
    search.kind = kSingle[random() % std::size(kSingle)];
    search.bad = 1 + static_cast<int>(random() % static_cast<unsigned>(healthy.asked));
    const bool needs_one_before =
        search.kind == Kind::Torn || search.kind == Kind::Stale || search.kind == Kind::StaleWithNoise;
    if (needs_one_before && search.bad == 1) continue;
    const Ended ended = Go(search);
    Count& count = counts[search.kind];
    ++count.runs;
    count.within += ended.how == SearchEnd::Within;
    count.refused += ended.how == SearchEnd::Refused;
    count.off += ended.how == SearchEnd::Off;
    count.wrong += ended.how == SearchEnd::False;
    count.named += !ended.outcome.left_out.empty();
    EXPECT_NE(ended.how, SearchEnd::False) << Told(search, ended);
    if (ended.how != SearchEnd::Within && std::getenv("TELL") != nullptr)
      std::printf("%s\n", Told(search, ended).c_str());
  }
  int all = 0, within = 0;
  for (const auto& [kind, count] : counts) {
    all += count.runs;
    within += count.within;
    std::printf("%-17s %4d runs: %4d within, %d off, %d refused, %d false; named in %d\n",
                kNames[static_cast<std::size_t>(kind)], count.runs, count.within, count.off, count.refused, count.wrong,
                count.named);
  }
  // One after its first long move, and one at its answer.
  std::ranges::sort(more_frames);
  EXPECT_LE(more_frames[more_frames.size() / 2], 2);
  EXPECT_GE(within, 0.95 * all - 3.0 * std::sqrt(0.95 * 0.05 * all));  // less three standard deviations
}

struct Late {
  int runs = 0, within = 0, off = 0, refused = 0, wrong = 0;
};

TEST_F(BadFrames, ALateCameraIsNotBelieved) {
  std::mt19937 random(39);
  std::map<Kind, Late> ends;
  for (long i = 0; i < testing::ByLevel(12, 120, 2000); ++i) {
    Search search = Draw(random);
    search.kind = i % 2 == 0 ? Kind::Late : Kind::LateFromBefore;
    const Ended ended = Go(search);
    Late& late = ends[search.kind];
    ++late.runs;
    late.within += ended.how == SearchEnd::Within;
    late.off += ended.how == SearchEnd::Off;
    late.refused += ended.how == SearchEnd::Refused;
    late.wrong += ended.how == SearchEnd::False;
    if (ended.how == SearchEnd::False) std::printf("%s\n", Told(search, ended).c_str());
  }
  for (const auto& [kind, late] : ends) {
    std::printf("%-17s %d runs: %d within, %d off, %d refused, %d false\n", kNames[static_cast<std::size_t>(kind)],
                late.runs, late.within, late.off, late.refused, late.wrong);
  }
  EXPECT_EQ(ends[Kind::Late].wrong, 0);
  EXPECT_LE(ends[Kind::LateFromBefore].wrong, ends[Kind::LateFromBefore].runs / 500);
  EXPECT_GE(ends[Kind::LateFromBefore].within, 0.8 * ends[Kind::LateFromBefore].runs);
}

/// Three searches in a row with one camera, which is 0, 1 or 2 frames late from a place before the first one on, or in
/// time but for one frame of each search.
TEST_F(BadFrames, ThreeSearchesInARowAreNeverLedAstrayByLateFrames) {
  constexpr int kSearches = 3, kCameras = 4, kOneLate = 3, kUsualFrames = 7;
  std::mt19937 random(40);
  Late ends[kCameras][kSearches];
  std::vector<int> frames[kSearches];  ///< of the camera in time
  for (long i = 0; i < testing::ByLevel(12, 40, 1600); ++i) {
    Search search = Draw(random);
    const long camera = i % kCameras;
    search.lag = camera == kOneLate ? 0 : static_cast<std::size_t>(camera);
    search.kind = camera == kOneLate ? Kind::StaleWithNoise : Kind::LateFromBefore;
    Setting setting(search, LensOf(search));
    for (int nth = 0; nth < kSearches; ++nth) {
      if (camera == kOneLate) search.bad = setting.taken() + 1 + static_cast<int>(random() % kUsualFrames);
      const Ended ended = setting.Go(search);
      Late& late = ends[camera][nth];
      ++late.runs;
      late.within += ended.how == SearchEnd::Within;
      late.off += ended.how == SearchEnd::Off;
      late.refused += ended.how == SearchEnd::Refused;
      late.wrong += ended.how == SearchEnd::False;
      if (ended.how == SearchEnd::False || (std::getenv("TELL") != nullptr && ended.how == SearchEnd::Refused)) {
        std::printf("camera %ld, search %d, %s\n", camera, nth, Told(search, ended).c_str());
      }
      if (camera == 0) frames[nth].push_back(static_cast<int>(ended.outcome.left_out.size()));
      search.start = static_cast<int>(random() % search.stack->frames.size());
      setting.MoveTo(search.start);
    }
  }
  constexpr const char* kCamera[] = {"in time", "1 late", "2 late", "one frame late"};
  for (int camera = 0; camera < kCameras; ++camera) {
    for (const Late& late : ends[camera]) {
      std::printf("%s: %d runs: %d within, %d off, %d refused, %d false\n", kCamera[camera], late.runs, late.within,
                  late.off, late.refused, late.wrong);
      EXPECT_LE(late.wrong, late.runs / 500);
    }
  }
  // A frame more at the answer; the first search takes one more after its first long move.
  for (int nth = 0; nth < kSearches; ++nth) {
    std::ranges::sort(frames[nth]);
    const int median = frames[nth][frames[nth].size() / 2];
    std::printf("in time, search %d: %d frames left out in the median\n", nth + 1, median);
    EXPECT_LE(median, nth == 0 ? 2 : 1);
  }
}

/// The first frame of a second search shows where the first search ended, as from a buffer that was not thrown away;
/// each is compared with a second search whose camera is in time.
TEST_F(BadFrames, AFirstFrameOfWhereTheSearchBeforeEndedIsTakenAgain) {
  std::mt19937 random(41);
  Late ends[2];
  std::vector<int> more_frames;  ///< of a camera in time
  for (long i = 0; i < testing::ByLevel(4, 16, 400); ++i) {
    Search search = Draw(random);
    const int start = static_cast<int>(random() % search.stack->frames.size());
    for (const bool late : {false, true}) {
      search.kind = late ? Kind::StaleWithNoise : Kind::Healthy;
      search.bad = 0;
      Setting setting(search, LensOf(search));
      setting.Go(search);
      setting.MoveTo(start);
      search.bad = setting.taken() + 1;
      const Ended ended = setting.Go(search);
      Late& count = ends[late ? 1 : 0];
      ++count.runs;
      count.within += ended.how == SearchEnd::Within;
      count.off += ended.how == SearchEnd::Off;
      count.refused += ended.how == SearchEnd::Refused;
      count.wrong += ended.how == SearchEnd::False;
      if (!late) more_frames.push_back(static_cast<int>(ended.outcome.left_out.size()));
      if (ended.how == SearchEnd::False || (std::getenv("TELL") != nullptr && ended.how == SearchEnd::Refused)) {
        std::printf("second start %d, %s\n", start, Told(search, ended).c_str());
      }
    }
  }
  for (const Late& count : ends) {
    std::printf("first frame %s: %d runs: %d within, %d off, %d refused, %d false\n",
                &count == ends ? "in time" : "late", count.runs, count.within, count.off, count.refused, count.wrong);
    EXPECT_LE(count.wrong, count.runs / 500);
  }
  const Late &in_time = ends[0], &late = ends[1];
  EXPECT_LE(late.refused, in_time.refused + 1 + late.runs / 50);
  EXPECT_GE(late.within, in_time.within - 1 - late.runs / 50);
  std::ranges::sort(more_frames);
  std::printf("in time: %d frames left out in the median, %d at most\n", more_frames[more_frames.size() / 2],
              more_frames.back());
  EXPECT_LE(more_frames[more_frames.size() / 2], 1);  // at the answer
}

}  // namespace
}  // namespace lensd::rig
