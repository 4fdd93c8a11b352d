// A search for focus over regions of one frame, as the driver of the lens sees it.
#pragma once

#include <string_view>
#include <vector>

#include "autofocus/session.h"

namespace lensd::autofocus {

struct FocusMap;

/// A frame as one region saw it.
struct RegionSample {
  int frame = 0;  ///< of the run, from 0
  int region = 0;
  double score = 0.0;  ///< sharpness: gradient energy free of noise over squared brightness, or what a client said
  double sigma = 0.0;  ///< standard deviation of that
};

class RegionSearch {
 public:
  virtual ~RegionSearch() = default;

  /// As Session::Next(), for all regions together. A refusal says what became of each of them.
  virtual Result<Advice> Next(const Place& place, const drivers::Frame& frame) = 0;
  /// As Session::NextScore(); only where there is one region. InvalidArgument otherwise.
  virtual Result<Advice> NextScore(double position, const Sharpness& sharpness) = 0;

  virtual const std::vector<drivers::Region>& regions() const = 0;
  virtual std::string_view method() const = 0;
  /// Of the last frame against the first.
  virtual double relative_sharpness() const = 0;
  /// Frames taken so far, and how many it will be in all as far as can be told.
  virtual int frames() const = 0;
  virtual int frames_expected() const = 0;
  /// Every region's curve so far, region by region, frames in the order they were taken; none of a map.
  virtual std::vector<RegionSample> Curves() const = 0;
  /// The region that gave the answer.
  virtual int answered() const = 0;
  /// What it found of every region, once it has judged them; nullptr: it makes no map.
  virtual const FocusMap* map() const { return nullptr; }
};

}  // namespace lensd::autofocus
