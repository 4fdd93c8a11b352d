// The methods that are measured, each with its own code.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "bench/plan/problem.h"

namespace lensd::bench {

/// A problem made ready in the form a method takes it; calling it is what is timed.
using Solver = std::function<Answer()>;

struct Method {
  std::string name;
  std::function<Solver(const Problem&)> prepare;
  std::size_t most_limits = 0;  ///< larger problems are left out: the method would take minutes
  std::string missing = {};     ///< the package this build lacks; empty: it is there
  bool ours = false;
  bool plans = true;  ///< else it only reads the numbers: nothing that looks at all of them can be faster
};

/// lensd's planner as lensctl and lensd call it: names, worst blur of every limit, model.
Method Lensd();
/// Reads the numbers of lensd's request once, where they stand.
Method ReadRequestOnce();

/// Textbook depth of field, N = Δv/2c, and the sensor halfway between the two images.
Method TextbookFormula();
/// The sensor halfway between the outermost images, with the f-number that then meets every limit.
Method ImageMidpoint();
/// The best point of a grid of `side` x `side` settings.
Method GridSearch(int side);
/// Bisection on the f-number to the last digit.
Method Bisection();
/// NLopt's SLSQP with the limits as linear constraints and their gradients.
Method NloptSlsqp();
/// Clp's dual simplex on the linear programme.
Method ClpDual();
/// Every pair of facing lines in exact rational arithmetic: the truth for problems of up to a few hundred limits.
Method ExactReference();

/// The truth: exact where ExactReference() is able to, else bisection in long double over every line.
double TrueFNumber(const Problem& problem);

}  // namespace lensd::bench
