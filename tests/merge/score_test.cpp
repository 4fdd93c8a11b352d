// Depth and sharp picture against the simulator's, with a lens that breathes by 8 %; beside them what they are without
// alignment, and what plain tools do.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <string>

#include "merge/compose.h"
#include "scored_stack.h"

namespace lensd::testing {
namespace {

struct Merged {
  merge::DepthMap map;
  merge::Picture picture;
};

Merged MergeAll(const ScoredStack& stack, const std::vector<merge::Station>& stations) {
  auto finder = merge::DepthFinder::Create(stations).value();
  for (const auto& frame : stack.frames) EXPECT_TRUE(finder.Add(frame));
  Merged merged{finder.Finish().value(), {}};
  merge::Composer composer(stations, merged.map);
  for (const auto& frame : stack.frames) EXPECT_TRUE(composer.Add(frame));
  merged.picture = composer.Finish();
  return merged;
}

struct Row {
  DepthScore inside, edges;
  double psnr = 0.0;
};

Row Scored(const std::string& what, const ScoredStack& stack, const std::vector<float>& place,
           const std::vector<float>& sigma, const merge::Picture& picture) {
  const Row row{ScoreDepth(stack, place, sigma, Part::Inside), ScoreDepth(stack, place, sigma, Part::Edges),
                ScorePicture(stack, picture)};
  std::printf("%-22s %.3f within half a depth of field of %.3f known, rmse %.4f D", what.c_str(), row.inside.within,
              row.inside.known, row.inside.rmse_d);
  if (!sigma.empty()) std::printf(", %.3f in 2 sigma", row.inside.within_2_sigma);
  if (row.edges.pixels > 0) std::printf("; near edges %.3f of %.3f", row.edges.within, row.edges.known);
  std::printf("; %.1f dB\n", row.psnr);
  return row;
}

struct Scores {
  Row merged, unaligned, peer;
  double single = 0.0;  ///< dB of the best frame
};

/// Merged, merged as if the lens did not breathe, and the peer, of the same frames.
Scores ScoreAll(const std::string& name, const sim::Scene& scene, const StackPlan& plan) {
  const auto stack = RenderStack(scene, plan);
  Scores scores;
  const auto merged = MergeAll(stack, stack.stations);
  scores.merged = Scored(name, stack, merged.map.place, merged.map.sigma, merged.picture);
  auto same_size = stack.stations;
  for (auto& station : same_size) station.scale = 1.0;
  const auto plain = MergeAll(stack, same_size);
  scores.unaligned = Scored(name + ", unaligned", stack, plain.map.place, plain.map.sigma, plain.picture);
  const auto peer = LaplacianPeer(stack);
  scores.peer = Scored(name + ", peer", stack, peer.place, {}, peer.picture);
  for (const auto& frame : stack.frames) scores.single = std::max(scores.single, ScorePicture(stack, frame));
  std::printf("%-22s %.1f dB; frames %.2f half depths of field apart\n", (name + ", best frame").c_str(), scores.single,
              stack.frame_step_d / stack.half_depth_d);
  const int width = stack.sharp.width;
  const auto low = static_cast<float>(plan.far_d), high = static_cast<float>(plan.near_d);
  ShowPlane(name + "-depth", merged.map.place, width, low, high);
  ShowPlane(name + "-everywhere", merged.map.everywhere, width, low, high);
  ShowPlane(name + "-truth", stack.truth_d, width, low, high);
  ShowPlane(name + "-merged", merged.picture.samples, width, 0, 1023);
  ShowPlane(name + "-sharp", stack.sharp.samples, width, 0, 1023);
  ShowPlane(name + "-peer", peer.picture.samples, width, 0, 1023);
  return scores;
}

TEST(Score, TiltedPlane) {
  const auto scores = ScoreAll("tilted", TiltedScene(), {.frames = 16, .far_d = 0.5, .near_d = 1.1});
  EXPECT_GT(scores.merged.inside.within, 0.99);
  EXPECT_GT(scores.merged.inside.known, 0.9);
  EXPECT_GT(scores.merged.inside.within_2_sigma, 0.95);
  EXPECT_GT(scores.merged.psnr, scores.single + 8.0);
  EXPECT_GT(scores.merged.psnr, scores.unaligned.psnr + 8.0);
  EXPECT_LT(scores.merged.inside.rmse_d, scores.peer.inside.rmse_d);
}

TEST(Score, WallBeforeAWall) {
  const auto scores = ScoreAll("walls", WallsScene(), {.frames = 16, .far_d = 0.5, .near_d = 1.1});
  EXPECT_GT(scores.merged.inside.within, 0.99);
  EXPECT_GT(scores.merged.inside.known, 0.8);
  EXPECT_GT(scores.merged.edges.within, 0.95);
  EXPECT_GT(scores.merged.psnr, scores.single + 6.0);
  EXPECT_GT(scores.merged.psnr, scores.unaligned.psnr + 6.0);
}

TEST(Score, Motorcycle) {
  const auto scores =
      ScoreAll("motorcycle", MotorcycleScene(), {.frames = 9, .far_d = 0.19, .near_d = 0.49, .f_number = 1.4});
  EXPECT_GT(scores.merged.inside.within, 0.98);
  EXPECT_GT(scores.merged.edges.within, 0.87);
  EXPECT_GT(scores.merged.inside.within, scores.unaligned.inside.within + 0.05);
  EXPECT_GT(scores.merged.psnr, scores.single + 6.0);
  EXPECT_GT(scores.merged.psnr, scores.unaligned.psnr + 6.0);
}

}  // namespace
}  // namespace lensd::testing
