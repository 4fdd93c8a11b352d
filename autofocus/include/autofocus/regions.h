// Autofocus on one region of the frame, or on several of which one policy picks the answer.
//
// The regions are judged one after the other, each by a session of its own, but on one set of frames: what was taken
// for one region tells depth from defocus about the next as well, so that a second region mostly costs no more than the
// frame that proves it.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "autofocus/region_search.h"

namespace lensd::autofocus {

/// What several regions come to.
enum class Policy {
  Nearest,   ///< the one in focus nearest to the camera
  Farthest,  ///< the one farthest from it
  Widest,    ///< where most of them are within half a depth of field of each other
};

/// "nearest", "farthest" or "widest". InvalidArgument.
Result<Policy> PolicyFromName(std::string_view name);

class Regions final : public RegionSearch {
 public:
  /// `regions` must not be empty. InvalidArgument as Session::Create(), or too many regions.
  static Result<Regions> Create(std::string_view method, const Setup& setup, std::vector<drivers::Region> regions,
                                Policy policy);

  Result<Advice> Next(const Place& place, const drivers::Frame& frame) override;
  Result<Advice> NextScore(double position, const Sharpness& sharpness) override;

  const std::vector<drivers::Region>& regions() const override { return regions_; }
  /// Of the region under work.
  std::string_view method() const override { return sessions_.back().method(); }
  double relative_sharpness() const override { return sessions_.back().relative_sharpness(); }
  int frames() const override { return frames_; }
  int frames_expected() const override;
  std::vector<RegionSample> Curves() const override;
  int answered() const override { return static_cast<int>(chosen_region_); }

  static constexpr std::size_t kMost = 16;

 private:
  Regions(std::string_view method, const Setup& setup, std::vector<drivers::Region> regions, Policy policy,
          Session first);
  struct Taken {
    Place place;
    drivers::Frame frame;
    int number = 0;  ///< from 0
  };
  Result<Advice> Show(std::size_t region, const Taken& taken);
  Result<Advice> StartNext();
  Advice Choose(double stands);
  Verdict RefuseAll() const;
  std::vector<std::size_t> Agreeing(std::size_t with) const;

  std::string method_;
  Setup setup_;
  std::vector<drivers::Region> regions_;
  Policy policy_;
  std::vector<Session> sessions_;        ///< of the regions so far
  std::vector<std::vector<int>> shown_;  ///< to each of these: the frames' numbers
  std::vector<Verdict> verdicts_;        ///< of those that are done
  std::vector<Taken> taken_;             ///< the first few frames, for the regions to come
  int frames_ = 0;
  std::optional<Verdict> chosen_;  ///< being checked
  std::size_t chosen_region_ = 0;
};

}  // namespace lensd::autofocus
