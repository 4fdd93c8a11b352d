// The daemon's answers for people.
#pragma once

#include <string>

#include "varlink/json.h"

namespace lensd::cli {

/// A string; empty where it is null or absent.
std::string TextOf(const varlink::Json& object, const char* key);
/// One line for each camera whose lag LensInfo or LearnedState gives, each with a line feed before it.
std::string LagsText(const varlink::Json& learned);
/// A number with at most `digits` significant digits and its unit; "?" where it is null or absent.
std::string NumberText(const varlink::Json& object, const char* key, int digits, const char* unit);
/// A number of milliseconds: "254 ms", "5.84 s", "?" where there is none.
std::string TimeText(const varlink::Json& object, const char* key);
/// Which way focus counts and who says so, of its AxisInfo: "near-positive, by the V4L2 standard".
std::string FocusDirectionText(const varlink::Json& axis);
/// One line of LensInfo.
std::string InfoText(const varlink::Json& info);
/// One line of LensStatus.
std::string StatusText(const varlink::Json& status);
/// The same while something goes on: what is under way, and where it has come to.
std::string ActivityText(const varlink::Json& status);
/// The same of a lens that was stopped: where every axis and the focus stand, with their bounds.
std::string StandsText(const varlink::Json& status);
std::string MetricsText(const varlink::Json& metrics);
/// One line of MoveResult.
std::string MoveText(const varlink::Json& move);
/// One line of AutofocusProgress, and of AutofocusStep, while it goes on.
std::string AutofocusProgressText(const varlink::Json& progress);
std::string AutofocusStepText(const varlink::Json& step);
/// One line of AutofocusResult, and one for each candidate.
std::string AutofocusText(const varlink::Json& result);
/// One line of Refocus.
std::string RefocusText(const varlink::Json& refocus);
/// " for another 12 s", to an instant on this machine's CLOCK_MONOTONIC.
std::string UntilText(const varlink::Json& until_ns);
/// "12.3 um of extension, sigma 0.8 um", of ShiftSize.
std::string ShiftSizeText(const varlink::Json& size);
/// One line of BacklashResult.
std::string BacklashLine(const varlink::Json& result);

}  // namespace lensd::cli
