// The live screen's text: figures at places where the eye finds them again.
#include "cli/online/watch/watch_lines.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "cli/text/text.h"
#include "cli/text/texts.h"

namespace lensd::cli {
namespace {

using varlink::Json;

constexpr int kBarColumns = 30;
constexpr double kSharpPixels = 2.0;  ///< blur that still counts as sharp

std::optional<double> Number(const Json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_number() ? std::optional(found->get<double>()) : std::nullopt;
}

std::string Padded(std::string text, std::size_t columns) {
  if (text.size() < columns) text.resize(columns, ' ');
  return text;
}

/// [####      ], from 0 to 1.
std::string FilledBar(double part) {
  const auto filled = static_cast<std::size_t>(std::lround(std::clamp(part, 0.0, 1.0) * kBarColumns));
  return "[" + std::string(filled, '#') + std::string(kBarColumns - filled, ' ') + "]";
}

/// [---o------], a place from 0 to 1.
std::string PlaceBar(double place) {
  std::string bar(kBarColumns, '-');
  bar[static_cast<std::size_t>(std::lround(std::clamp(place, 0.0, 1.0) * (kBarColumns - 1)))] = 'o';
  return "[" + bar + "]";
}

const Json* InfoOf(const WatchedState& state, const Json& lens) {
  const auto found = state.infos.find(TextOf(lens, "name"));
  return found == state.infos.end() ? nullptr : &found->second;
}

std::string FocusOf(const Json& lens) {
  const auto vergence = Number(lens, "vergenceD");
  if (!vergence) return "";
  return *vergence == 0.0 ? "infinity" : DepthText({*vergence});
}

std::string LeaseOf(const Json& lens) {
  const Json lease = lens.value("lease", Json());
  if (!lease.is_object()) return "";
  std::string holder = "leased by " + TextOf(lease, "holder");
  const Json until = lease.value("untilNs", Json());
  if (!until.is_number()) return holder;
  const auto left =
      std::chrono::nanoseconds(until.get<std::int64_t>()) - std::chrono::steady_clock::now().time_since_epoch();
  return holder + " for " + std::to_string(std::chrono::ceil<std::chrono::seconds>(left).count()) + " s";
}

bool HasFault(const Json& lens) {
  return std::ranges::any_of(lens["axes"], [](const Json& axis) { return !TextOf(axis, "fault").empty(); });
}

Style StyleOf(const Json& lens) {
  if (!lens.value("connected", false) || HasFault(lens)) return Style::Bad;
  return TextOf(lens, "activity") == "idle" ? Style::Good : Style::Busy;
}

StyledLine LensLine(const Json& lens, bool selected) {
  std::string doing = lens.value("connected", false) ? TextOf(lens, "activity") : TextOf(lens, "connection");
  if (lens.value("latched", false)) doing += ", latched";
  std::string line =
      std::string(selected ? "> " : "  ") + Padded(TextOf(lens, "name"), 14) + " " + Padded(doing, 13) + " ";
  line += Padded(FocusOf(lens), 38);
  if (const auto f_number = Number(lens, "fNumber")) line += " f/" + Short(*f_number);
  return {line, StyleOf(lens)};
}

StyledLine AxisLine(const Json& axis, const Json* info) {
  const std::string name = TextOf(axis, "axis");
  std::string line = "    " + Padded(name, 12) + Padded(NumberText(axis, "position", 8, ""), 9);
  for (const Json& can : info != nullptr ? (*info)["axes"] : Json::array()) {
    if (TextOf(can, "axis") != name) continue;
    const double low = can.value("minimum", 0.0), high = can.value("maximum", 0.0);
    if (high > low) line += PlaceBar((axis.value("position", 0.0) - low) / (high - low));
    line += " " + NumberText(can, "minimum", 6, "..") + NumberText(can, "maximum", 6, "");
  }
  if (axis.value("moving", false)) line += " -> " + NumberText(axis, "target", 6, "");
  if (!axis.value("homed", true))
    line += axis.contains("positionUnknown") && axis["positionUnknown"] == true ? ", position unknown" : ", not homed";
  return {line, axis.value("moving", false) ? Style::Busy : Style::Plain};
}

/// U +- c N/(f Z): where blur reaches so many pixels on either side of the focal plane.
std::string DepthOfFieldOf(const Json& lens, const Json* info) {
  const auto vergence = Number(lens, "vergenceD"), f = Number(lens, "focalLengthMm"), n = Number(lens, "fNumber"),
             extension = Number(lens, "extensionMm");
  const Json camera = info != nullptr ? info->value("camera", Json()) : Json();
  const auto pixel = camera.is_object() ? Number(camera, "pixelUm") : std::nullopt;
  if (!vergence || !f || !n || !extension || !pixel) return "";
  const double half = kSharpPixels * *pixel * 1e-6 * *n / (*f * 1e-3 * (*f + *extension) * 1e-3);
  const double far = *vergence - half;
  return DepthText({*vergence + half}) + " to " + (far > 0.0 ? DepthText({far}) : "infinity") + " (blur up to 2 px)";
}

void AddDetails(const WatchedState& state, const Json& lens, std::vector<StyledLine>& lines) {
  const Json* const info = InfoOf(state, lens);
  for (const Json& axis : lens["axes"]) lines.push_back(AxisLine(axis, info));
  const auto add = [&lines](const char* what, const std::string& text, Style style = Style::Plain) {
    if (!text.empty()) lines.push_back({"    " + Padded(what, 12) + text, style});
  };
  add("sharp", DepthOfFieldOf(lens, info));
  if (const auto f = Number(lens, "focalLengthMm")) add("focal", Short(*f, 5) + " mm");
  if (const auto temperature = Number(lens, "temperatureC")) add("temperature", Short(*temperature, 3) + " C");
  add("thermometer", TextOf(lens, "temperatureFault"), Style::Bad);
  add("optics", TextOf(lens, "grade"));
  if (state.sharpness) {
    const double best = std::max(state.best_sharpness, *state.sharpness);
    add("sharpness", FilledBar(best > 0.0 ? *state.sharpness / best : 0.0) + " " + Short(*state.sharpness, 3) +
                         ", best " + Short(best, 3));
  }
  if (lens.value("stepsExpected", 0) > 0) {
    add("step", NumberText(lens, "step", 6, " of about ") + NumberText(lens, "stepsExpected", 6, ""));
  }
  add("lease", LeaseOf(lens));
  add("error", TextOf(lens, "error"), Style::Bad);
  for (const Json& axis : lens["axes"]) {
    if (const std::string fault = TextOf(axis, "fault"); !fault.empty()) {
      add("fault", TextOf(axis, "axis") + ": " + fault, Style::Bad);
    }
  }
  for (const Json& warning : lens.value("warnings", Json::array()))
    add("warning", warning.get<std::string>(), Style::Busy);
}

}  // namespace

std::vector<StyledLine> WatchLines(const WatchedState& state, TerminalScreen::Size size) {
  std::vector<StyledLine> lines;
  const std::size_t count = state.lenses.size();
  lines.push_back(
      {"lensd: " + (count == 0 ? "no lens is configured" : std::to_string(count) + (count == 1 ? " lens" : " lenses")),
       Style::Title});
  for (std::size_t i = 0; i < count; ++i) {
    lines.push_back(LensLine(state.lenses[i], i == state.selected));
    if (i == state.selected) AddDetails(state, state.lenses[i], lines);
  }
  constexpr std::size_t kFooter = 3;
  const auto room = static_cast<std::size_t>(std::max(size.rows, 1));
  if (lines.size() + kFooter > room) lines.resize(room > kFooter ? room - kFooter : 1);
  lines.push_back({state.said, Style::Plain});
  lines.push_back({"left/right: focus nearer/farther by 10 steps, [ ] by 1, { } by 100", Style::Faint});
  lines.push_back({"space: stop   f: autofocus   up/down: lens   q: quit", Style::Faint});
  return lines;
}

}  // namespace lensd::cli
