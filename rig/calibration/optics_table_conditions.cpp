// Which of a lens' curves count under which conditions: filter, zoom, wavelength, temperature.
#include <functional>
#include <utility>

#include "rig/calibration/optics_table_lens.h"

namespace lensd::rig {

namespace {

/// Where a value lies between the ones there are: the two around it and their weights.
struct Bracket {
  double low = 0.0, high = 0.0;
  double toward_high = 0.0;
  bool outside = false;
};

Bracket Around(std::vector<double> values, std::optional<double> wanted) {
  std::ranges::sort(values);
  if (!wanted) return {values.front(), values.front(), 0.0, values.front() != values.back()};
  const double x = std::clamp(*wanted, values.front(), values.back());
  const auto above = std::ranges::lower_bound(values, x);
  const auto below = *above == x ? above : above - 1;
  // A zoom a millionth away from where a curve was measured is no other zoom.
  Bracket bracket{*below, *above, 0.0, std::abs(x - *wanted) > 1e-6 * std::abs(x)};
  if (*above > *below) bracket.toward_high = (x - *below) / (*above - *below);
  return bracket;
}

}  // namespace

OpticsTable OpticsTable::In(const Conditions& conditions) const {
  OpticsTable table;
  table.lens_ = lens_;
  table.conditions_ = conditions;
  table.focal_length_ = Metres{lens_->nominal.focal_length_m};
  if (has_zoom() && conditions.zoom) table.focal_length_ = FocalLengthFromNative(*conditions.zoom);
  table.ChooseCurves();
  table.SetTemperature();
  return table;
}

/// Curves of the filter in place; then, one key after another, those on either side of the conditions.
void OpticsTable::ChooseCurves() {
  const auto& curves = lens_->curves;
  const auto filter_of = [&](std::size_t i) { return curves[i].measured->filter; };
  const auto here = conditions_.filter ? std::optional(conditions_.filter->value) : std::nullopt;
  std::vector<std::size_t> with_filter, without;
  for (std::size_t i = 0; i < curves.size(); ++i) {
    if (here && filter_of(i) == here) with_filter.push_back(i);
    if (!filter_of(i)) without.push_back(i);
  }
  if (with_filter.empty()) with_filter = without;
  if (with_filter.empty() && !curves.empty()) {
    // Measured through other filters only.
    for (std::size_t i = 0; i < curves.size(); ++i) with_filter.push_back(i);
    outside_ = true;
  }
  for (const std::size_t i : with_filter) parts_.push_back({i, 1.0 / static_cast<double>(with_filter.size())});
  const auto value = [](const auto& key) { return key ? std::optional(key->value) : std::nullopt; };
  const auto narrow = [&](auto key, std::optional<double> wanted, bool counts) {
    const bool inside = Narrow([&](const FocusCurve& curve) { return value(key(curve)); }, wanted);
    outside_ |= counts && !inside;
  };
  narrow([](const FocusCurve& curve) { return curve.focal_length; }, focal_length_.value, has_zoom());
  narrow([](const FocusCurve& curve) { return curve.wavelength; }, value(lens_->wavelength), true);
  narrow([](const FocusCurve& curve) { return curve.temperature; }, value(conditions_.temperature), false);
}

/// Keeps the curves whose key is nearest below and above what is wanted, weighted by how near. False: there is none on
/// one side.
bool OpticsTable::Narrow(const std::function<std::optional<double>(const FocusCurve&)>& key,
                         std::optional<double> wanted) {
  const auto key_of = [&](const Part& part) { return key(*lens_->curves[part.curve].measured); };
  std::vector<double> values;
  for (const Part& part : parts_) {
    if (const auto value = key_of(part)) values.push_back(*value);
  }
  if (values.empty()) return true;
  const Bracket around = Around(std::move(values), wanted);
  double low_weight = 0.0, high_weight = 0.0;
  for (const Part& part : parts_) {
    if (key_of(part) == around.low) low_weight += part.weight;
    if (key_of(part) == around.high) high_weight += part.weight;
  }
  std::vector<Part> chosen;
  for (Part part : parts_) {
    const auto value = key_of(part);
    if (value != around.low && value != around.high) continue;
    part.weight *= value == around.low ? (1.0 - around.toward_high) / low_weight : around.toward_high / high_weight;
    if (part.weight > 0.0) chosen.push_back(part);
  }
  parts_ = std::move(chosen);
  return !around.outside;
}

void OpticsTable::SetTemperature() {
  if (!lens_->temperature) return;
  const TemperatureModel& model = *lens_->temperature;
  double measured_at = parts_.empty() ? model.reference.value : 0.0;
  for (const Part& part : parts_) {
    measured_at += part.weight * lens_->curves[part.curve].measured->temperature.value_or(model.reference).value;
  }
  if (!conditions_.temperature) {
    range_c_ = std::max(std::abs(model.hottest.value - measured_at), std::abs(model.coldest.value - measured_at));
    return;
  }
  const double warmer = conditions_.temperature->value - measured_at;
  range_c_ = std::abs(warmer);
  if (lens_->compensate) offset_m_ = model.per_degree.value * warmer;
}

}  // namespace lensd::rig
