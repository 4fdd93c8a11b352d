// Which of the measured shifts count between two conditions, and how they are written down. A pair counts either way
// round; a shift of f-numbers and one of filters add up, for neither moves what the other does.
#include "rig/focus_shift.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "base/quantity_text.h"
#include "rig/common/toml_number.h"

namespace lensd::rig {
namespace {

constexpr double kSame = 0.01;  ///< relative: what a step of an iris makes is more
constexpr double kMetresPerMm = 1e-3, kMetresPerUm = 1e-6;

bool Same(double a, double b) {
  return std::abs(a - b) <= kSame * std::abs(a);
}
bool SameZoom(const std::optional<Metres>& a, const std::optional<Metres>& b) {
  return a.has_value() == b.has_value() && (!a || Same(a->value, b->value));
}
bool SamePlace(Native a, Native b) {
  return std::abs((a - b).value) < 0.5;
}

std::string Name(FNumber f_number) {
  return "f/" + Short(f_number.value);
}
std::string Name(Native filter) {
  return "filter " + Short(filter.value);
}

/// Adds the shift from one to the other, of those that were measured, to `sum`.
template <class Place, class Alike>
Result<void> Add(const std::vector<FocusShift>& measured, std::optional<std::pair<Place, Place>> FocusShift::* pair,
                 const std::optional<Place>& from, const std::optional<Place>& to,
                 const std::optional<Metres>& focal_length, Alike alike, ShiftSize& sum) {
  if (!from || !to || alike(*from, *to)) return {};
  for (const FocusShift& shift : measured) {
    if (!(shift.*pair) || shift.size.native != sum.native || !SameZoom(shift.focal_length, focal_length)) continue;
    const auto& [first, second] = *(shift.*pair);
    const bool forth = alike(first, *from) && alike(second, *to);
    const bool back = alike(first, *to) && alike(second, *from);
    if (!forth && !back) continue;
    sum.value += forth ? shift.size.value : -shift.size.value;
    sum.sigma = std::hypot(sum.sigma, shift.size.sigma);
    return {};
  }
  return Fail(Code::Unsupported, "the shift of focus from " + Name(*from) + " to " + Name(*to) + " is not measured");
}

}  // namespace

bool SameFNumber(FNumber a, FNumber b) {
  return Same(a.value, b.value);
}

bool FocusShift::SamePair(const FocusShift& other) const {
  const auto same = [](const auto& one, const auto& two, auto alike) {
    if (!one || !two) return !one && !two;
    return (alike(one->first, two->first) && alike(one->second, two->second)) ||
           (alike(one->first, two->second) && alike(one->second, two->first));
  };
  return same(f_numbers, other.f_numbers, SameFNumber) && same(filters, other.filters, SamePlace) &&
         SameZoom(focal_length, other.focal_length);
}

Result<ShiftSize> ShiftBetween(const std::vector<FocusShift>& measured, const FocusConditions& from,
                               const FocusConditions& to, bool native) {
  ShiftSize sum{.native = native};
  auto by_opening =
      Add(measured, &FocusShift::f_numbers, from.f_number, to.f_number, to.focal_length, SameFNumber, sum);
  auto by_filter = Add(measured, &FocusShift::filters, from.filter, to.filter, to.focal_length, SamePlace, sum);
  if (!by_opening && !by_filter) {
    return Fail(Code::Unsupported,
                by_opening.error().message + ", nor is that from " + Name(*from.filter) + " to " + Name(*to.filter));
  }
  if (!by_opening) return PassOn(by_opening);
  if (!by_filter) return PassOn(by_filter);
  return sum;
}

std::string PairText(const FocusShift& shift) {
  if (shift.f_numbers) return Name(shift.f_numbers->first) + " to " + Name(shift.f_numbers->second);
  return shift.filters ? Name(shift.filters->first) + " to " + Name(shift.filters->second) : "";
}

Result<FocusShift> ReadFocusShift(const Settings& table) {
  SettingsReader read(table, "[[focus_shift]]");
  FocusShift shift;
  constexpr std::size_t kPair = 2;
  if (const auto pair = read.OptionalNumbers("f_numbers", kPair, kPositive)) {
    shift.f_numbers.emplace(FNumber{pair->front()}, FNumber{pair->back()});
  }
  if (const auto pair = read.OptionalNumbers("filters", kPair)) {
    shift.filters.emplace(Native{pair->front()}, Native{pair->back()});
  }
  if (shift.f_numbers.has_value() == shift.filters.has_value()) {
    read.Reject("", "needs exactly one of f_numbers and filters");
  }
  if (const auto mm = read.OptionalNumber("focal_length_mm", kPositive))
    shift.focal_length = Metres{*mm * kMetresPerMm};
  const auto um = read.OptionalNumber("extension_um");
  const auto steps = read.OptionalNumber("steps");
  if (um.has_value() == steps.has_value()) read.Reject("", "needs exactly one of extension_um and steps");
  shift.size.native = steps.has_value();
  const double unit = steps ? 1.0 : kMetresPerUm;
  shift.size.value = um.value_or(steps.value_or(0.0)) * unit;
  shift.size.sigma = read.Number(steps ? "sigma_steps" : "sigma_um", 0.0, kNonNegative) * unit;
  shift.runs = static_cast<int>(read.Integer("runs", 0, {0, 1e6}));
  shift.made = read.Text("made", "");
  if (auto done = read.Finish(); !done) return PassOn(done);
  return shift;
}

std::string FocusShiftText(const FocusShift& shift) {
  std::string text = "\n[[focus_shift]]\n";
  const auto pair = [&](const char* key, double from, double to) {
    text += std::string(key) + " = [" + NumberText(from) + ", " + NumberText(to) + "]\n";
  };
  const auto line = [&](const char* key, double value) { text += std::string(key) + " = " + NumberText(value) + "\n"; };
  if (shift.f_numbers) pair("f_numbers", shift.f_numbers->first.value, shift.f_numbers->second.value);
  if (shift.filters) pair("filters", shift.filters->first.value, shift.filters->second.value);
  if (shift.focal_length) line("focal_length_mm", shift.focal_length->value / kMetresPerMm);
  const double unit = shift.size.native ? 1.0 : kMetresPerUm;
  line(shift.size.native ? "steps" : "extension_um", shift.size.value / unit);
  line(shift.size.native ? "sigma_steps" : "sigma_um", shift.size.sigma / unit);
  text += "runs = " + std::to_string(shift.runs) + "\n";
  if (!shift.made.empty()) text += "made = \"" + shift.made + "\"\n";
  return text;
}

}  // namespace lensd::rig
