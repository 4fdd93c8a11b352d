// Many autofocus runs on one scene, each on its own stepped clock, lens, camera and noise; only the rendered pictures
// are shared. Truth is read after the run, for scoring alone.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "autofocus/slope_learner.h"
#include "base/clock.h"
#include "base/result.h"
#include "sim/pictures.h"

namespace lensd::bench {

/// How one run ended and how far from the truth.
struct AutofocusRunResult {
  double start_steps = 0.0;
  double end_steps = 0.0;  ///< as the lens reports it
  bool focused = false;
  int frames = 0;
  int moves = 0;
  Duration elapsed{};                ///< on the simulated clock
  Duration cpu{};                    ///< of the method itself
  Duration known{};                  ///< what one who knew the answer takes: the move there, its settling, two frames
  double error_d = 0.0;              ///< |U - U_true| where the lens stands, against the nearest subject of the region
  double half_dof_d = 0.0;           ///< the vergence step that costs two pixels of blur there
  std::optional<double> log_slope;   ///< that it showed, over the told one
  std::optional<double> uneven;      ///< autofocus::Verdict::uneven
  double end_extension_m = 0.0;      ///< in truth
  std::optional<double> subject_px;  ///< blur diameter that the answer's own place of the subject is off by, signed
  std::optional<double> off_sigmas;  ///< the same over its own standard deviation, where it tells one
  std::size_t candidates = 0;        ///< distances that the answer names
  std::string reason;
  std::vector<double> blurs_px;  ///< signed blur of every frame it took, by where the lens reported to stand

  /// What the user waits for: nothing moves while the method computes.
  Duration waited() const { return elapsed + cpu; }
  double error_px() const { return 2.0 * error_d / half_dof_d; }  ///< diameter of the blur that is left
  double error_dof() const { return error_d / (2.0 * half_dof_d); }
  bool within() const { return focused && error_d <= half_dof_d; }
  bool false_focus() const { return focused && error_d > 2.0 * half_dof_d; }
};

/// Where the subject stands.
enum class SubjectDistance {
  OfTheScene,
  /// Another one each run, even in the extension that focuses on it, a tenth of the travel away from its ends. For
  /// scenes whose surfaces are walls: all move by the same vergence.
  DrawnAnew,
};

/// What the search is asked to do once it has answered; one that will track is told that its subject may move.
enum class AfterAnswer { End, Track };

struct AutofocusRuns {
  std::string method = "auto";
  int runs = 100;
  std::uint64_t seed = 1;
  int threads = 2;
  SubjectDistance distance = SubjectDistance::OfTheScene;
  AfterAnswer after = AfterAnswer::End;             ///< scored is the first answer
  bool whole_frame = false;                         ///< look at all of the frame instead of the scene's region
  std::optional<autofocus::KnownSlope> slope = {};  ///< that earlier runs have shown
  double f_number_error = 1.0;                      ///< what the rig believes of f-numbers, over the truth
  double focal_length_error = 1.0;                  ///< the same of the focal length
  std::optional<double> start = {};                 ///< steps: every run's, instead of one of its own
  Duration patience = std::chrono::seconds(100);    ///< no run may last longer, on the simulated clock
  Duration late{};  ///< readings of the lens are so much older than they say, which the rig is told
};

/// Run i starts at a place and with a noise seed that follow from `seed` and i alone, so that methods are compared on
/// the same starts and the result does not depend on threads. The first error of any run ends them all.
Result<std::vector<AutofocusRunResult>> RunAutofocus(const std::shared_ptr<sim::Pictures>& pictures,
                                                     const AutofocusRuns& wanted);

/// What so many runs like these, with starts and noise of their own, teach of the lens.
Result<std::optional<autofocus::KnownSlope>> LearnedFrom(const std::shared_ptr<sim::Pictures>& pictures,
                                                         AutofocusRuns like, int runs);

}  // namespace lensd::bench
