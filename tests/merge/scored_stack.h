// Stacks rendered by the simulator, whose depth and sharp picture are known.
#pragma once

#include <string>
#include <vector>

#include "merge/depth.h"
#include "merge/picture.h"
#include "sim/scene.h"

namespace lensd::testing {

struct StackPlan {
  int frames = 16;
  double far_d = 0.5, near_d = 1.1;  ///< focused at, evenly between
  double f_number = 2.0;
  double breathing = 0.08;  ///< growth of focal length and picture from the first frame to the last
  double full_well_e = 10000.0, read_noise_e = 3.0;
  double white = 0.9;
};

struct ScoredStack {
  std::vector<merge::Picture> frames;
  std::vector<merge::Station> stations;
  std::vector<float> truth_d;  ///< vergence of what each pixel of the merged picture shows
  merge::Picture sharp;        ///< without blur or noise, of the light of the first frame
  double half_depth_d = 0.0;   ///< two pixels of blur
  double frame_step_d = 0.0;
};

ScoredStack RenderStack(const sim::Scene& scene, const StackPlan& plan);

/// How well places fit.
struct DepthScore {
  double within = 0.0;  ///< share of the pixels with a place that are off by half a depth of field at most
  double known = 0.0;   ///< share of the textured pixels that have a place
  double rmse_d = 0.0;
  double within_2_sigma = 0.0;
  double pixels = 0.0;
};
/// Of pixels with texture in the sharp picture: away from steps of depth (`edges` false) or within 5 px of one.
enum class Part { Inside, Edges };
DepthScore ScoreDepth(const ScoredStack& stack, const std::vector<float>& place, const std::vector<float>& sigma,
                      Part part);

/// Peak signal to noise ratio in dB against the sharp picture, brightness fitted; pixels at the border left out.
double ScorePicture(const ScoredStack& stack, const merge::Picture& picture);

/// As most tools do it: per pixel the frame with the largest variance of the Laplacian, frames laid over each other as
/// they are. The picture is of that frame's pixels.
struct Peer {
  std::vector<float> place;
  merge::Picture picture;
};
Peer LaplacianPeer(const ScoredStack& stack);

/// Writes planes as grey PNGs to $LENSD_TEST_PICTURES/NAME.png for eyes; nothing where that is not set.
void ShowPlane(const std::string& name, const std::vector<float>& plane, int width, float low, float high);

sim::Scene TiltedScene();
sim::Scene WallsScene();
sim::Scene MotorcycleScene();

}  // namespace lensd::testing
