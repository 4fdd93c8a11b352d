// What all figures need: picking rows, pooling them, saying them.
#include "bench/report/figures.h"

#include <algorithm>
#include <cmath>

namespace lensd::bench {

std::string Short(double value, int digits) {
  if (!std::isfinite(value)) return value < 0 ? "-∞" : "∞";
  if (value == 0.0) return "0";
  const double size = std::abs(value);
  char text[64];
  if (size >= 1e7 || size < 1e-4) {
    std::snprintf(text, sizeof text, "%.*g", digits, value);
    return text;
  }
  const int decimals = std::max(0, digits - 1 - static_cast<int>(std::floor(std::log10(size))));
  std::snprintf(text, sizeof text, "%.*f", decimals, value);
  std::string number = text;
  if (number.find('.') != std::string::npos) {
    while (number.ends_with('0')) number.pop_back();
    if (number.ends_with('.')) number.pop_back();
  }
  return number;
}

const EvidenceRow* RowOf(const Evidence& rows, std::string_view family, std::string_view scene, std::string_view method,
                         std::string_view measure, std::optional<double> value) {
  const auto found = std::ranges::find_if(rows, [&](const EvidenceRow& row) {
    return row.family == family && row.scene == scene && row.method == method && row.measure == measure &&
           (!value || row.value == value);
  });
  return found == rows.end() ? nullptr : &*found;
}

Evidence Selected(const Evidence& rows, const std::function<bool(const EvidenceRow&)>& wanted) {
  Evidence some;
  std::ranges::copy_if(rows, std::back_inserter(some), wanted);
  return some;
}

std::vector<std::string> Names(const Evidence& rows, std::string EvidenceRow::* column) {
  std::vector<std::string> names;
  for (const EvidenceRow& row : rows) {
    if (std::ranges::find(names, row.*column) == names.end()) names.push_back(row.*column);
  }
  return names;
}

Estimate Pooled(const Evidence& rows, int* count) {
  std::vector<double> all;
  for (const EvidenceRow& row : rows) all.insert(all.end(), row.samples.begin(), row.samples.end());
  if (count != nullptr) *count = static_cast<int>(all.size());
  return all.empty() ? Estimate{} : MedianOf(all);
}

std::pair<int, int> Counted(const Evidence& rows) {
  int hits = 0, runs = 0;
  for (const EvidenceRow& row : rows) {
    hits += static_cast<int>(std::lround(row.estimate.middle * row.n));
    runs += row.n;
  }
  return {hits, runs};
}

std::string ShareInWords(int hits, int runs) {
  if (runs == 0) return "not run";
  const Estimate share = ShareOf(hits, runs);
  return Short(100 * share.middle, 4) + " % (" + Short(100 * share.low, 3) + " to " + Short(100 * share.high, 3) +
         ", n = " + std::to_string(runs) + ")";
}

std::string InWords(const EvidenceRow& row) {
  if (row.unit == "share") return ShareInWords(static_cast<int>(std::lround(row.estimate.middle * row.n)), row.n);
  std::string text = Short(row.estimate.middle) + " " + row.unit;
  if (row.samples.empty()) return text;
  text += " (" + Short(row.estimate.low) + " to " + Short(row.estimate.high) + ", n = " + std::to_string(row.n);
  const bool timed = row.unit == "us" || row.unit == "ms";
  if (timed && row.family != "autofocus" && TooWide(row.estimate, row.n)) text += ", spread too wide to judge";
  return text + ")";
}

Estimate RatioOf(const EvidenceRow& over, const EvidenceRow& under) {
  std::vector<double> ratios;
  for (std::size_t i = 0; i < std::min(over.samples.size(), under.samples.size()); ++i) {
    ratios.push_back(over.samples[i] / under.samples[i]);
  }
  return ratios.empty() ? Estimate{} : MedianOf(ratios);
}

int SeriesOf(const EvidenceRow& row) {
  return row.role == "ours" ? 0 : 1;
}

ChartLine FrontOf(const std::vector<ChartMark>& marks) {
  std::vector<ChartMark> sorted = marks, front;
  std::ranges::sort(sorted,
                    [](const ChartMark& a, const ChartMark& b) { return std::pair(a.x, a.y) < std::pair(b.x, b.y); });
  for (const ChartMark& mark : sorted) {
    if (front.empty() || mark.y < front.back().y) front.push_back(mark);
  }
  return {.marks = std::move(front), .steps = true};
}

}  // namespace lensd::bench
