// Questions that come at their own rate, whether those before them are answered or not.
#pragma once

#include <vector>

#include "base/result.h"

namespace lensd::bench {

/// Asks a lensd of so many lenses for its status, 1,000 times a second by `clients` in turn, itself on one processor
/// and lensd on the others: how long each answer took from the moment that its question was due, in us. Errors of
/// PrivateDaemon; Protocol: an answer that is none.
Result<std::vector<double>> AskAtRate(int lenses, int clients, int calls);

}  // namespace lensd::bench
