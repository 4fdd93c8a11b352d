// The searches of the literature, small and as published, to compare against. All of them look only at how sharp frames
// are, trust every comparison, and claim an answer in the end; what keeps a user from a wrong one is the session's
// check. Each is a pure function from the frames so far to the next position.
//
//   exhaustive      every pixel of blur of the whole range, then the sharpest
//   coarse-fine     every eight, then every one around the sharpest
//   golden-section  Kiefer's interval search, one frame a step; needs a curve with one hill and no noise
//   fibonacci       the same with the fewest frames for a given number of steps
//   hill-climb      after He, Zhou and Hong (2003): climb in large steps, turn back with smaller ones past the top
//   sweep-parabola, sweep-gaussian, sweep-hyperbola
//                   one pass in five-pixel steps, then the vertex of a curve through the five sharpest neighbours
//   contrast-scan   as libcamera does it for the Raspberry Pi: coarse until past the top, back in fine steps
#pragma once

#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "autofocus/method.h"

namespace lensd::autofocus {

/// A frame of a search: where, and its gradient energy over squared brightness.
struct SearchPoint {
  double position = 0.0;
  double value = 0.0;
};

/// `points`: the first frame (where the lens happened to stand), then one for each position asked for, in order.
using Strategy = Advice (*)(const Setup& setup, std::span<const SearchPoint> points);

struct Search {
  std::string_view name;
  Strategy strategy;
  double first_step;  ///< px of blur between frames of its first pass; 0: it has no passes, and takes no step
};
std::span<const Search> Searches();

/// A method that asks its strategy again after every frame.
std::unique_ptr<Method> MakeSearch(const Search& search, const Setup& setup);

}  // namespace lensd::autofocus
