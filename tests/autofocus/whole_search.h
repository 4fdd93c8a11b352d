// A search from its start to its verdict, on frames that a test makes for every position.
#pragma once

#include <gtest/gtest.h>

#include <string_view>
#include <variant>
#include <vector>

#include "autofocus/session.h"

namespace lensd::autofocus::testing {

struct Ending {
  Verdict verdict;
  int frames = 0;
  std::vector<double> visited;
};

/// `picture`: the whole region at a position, for the n-th frame, from 1. More than `most` frames fail the test.
template <class Picturer>
Ending SearchWith(std::string_view method, const Setup& setup, double start, const Picturer& picture, int most = 100) {
  auto session = Session::Create(method, setup);
  Ending run;
  double position = start;
  while (run.frames < most) {
    run.visited.push_back(position);
    const auto advice = session->Next(position, picture(position, ++run.frames), {0.0, 0.0, 1.0, 1.0});
    if (const auto* verdict = std::get_if<Verdict>(&*advice)) {
      run.verdict = *verdict;
      return run;
    }
    position = std::get<GoAndLook>(*advice).position;
  }
  ADD_FAILURE() << "never came to an end";
  return run;
}

}  // namespace lensd::autofocus::testing
