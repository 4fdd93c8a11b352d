// Shots overlap by nothing: where one row ends the next begins, so that a gap would be seen.
#include "cli/plan/stack_plot.h"

#include <algorithm>

#include "cli/text/text.h"
#include "cli/text/vergence_axis.h"

namespace lensd::cli {

io::Chart StackChart(const varlink::Json& stack, const std::string& lens) {
  constexpr int kRowPx = 44, kFramePx = 150;
  constexpr double kMargin = 0.06;
  const varlink::Json& shots = stack["shots"];
  const auto count = static_cast<int>(shots.size());
  double far = shots[0]["farD"].get<double>(), near = shots[0]["nearD"].get<double>();
  io::Chart chart;
  chart.title = lens + ": sharp from shot to shot of a stack of " + std::to_string(count);
  chart.subtitle = "each bar is what one shot keeps sharp";
  chart.y = {.label = "shot", .low = 0.4, .high = count + 0.6};
  for (int i = 0; i < count; ++i) {
    const varlink::Json& shot = shots[static_cast<std::size_t>(i)];
    const double from = shot["farD"].get<double>(), to = shot["nearD"].get<double>();
    far = std::min(far, from);
    near = std::max(near, to);
    const double row = count - i;
    chart.bars.push_back({.x_low = from,
                          .x_high = to,
                          .y_low = row - 0.36,
                          .y_high = row + 0.36,
                          .colour = io::PaletteColour(0),
                          .opacity = 0.4,
                          .label = "f/" + Short(shot["fNumber"].get<double>(), 3)});
    chart.y.ticks.emplace_back(row, std::to_string(i + 1));
  }
  const double margin = kMargin * std::max(near - far, 1e-6);
  chart.x = VergenceAxis(Dioptres{far - (far > margin ? margin : 0.0)}, Dioptres{near + margin});
  chart.height = std::clamp(kFramePx + kRowPx * count, 260, 1400);
  return chart;
}

}  // namespace lensd::cli
