// --plot FILE of every command: a chart as SVG, or as PNG by the program rsvg-convert.
#pragma once

#include <expected>
#include <string>

#include "cli/terminal/session.h"
#include "io/svg.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace lensd::cli {

/// The options as written.
struct PlotText {
  std::string file;  ///< empty: no chart is wanted
  std::string theme;
  std::string option = "--plot";

  bool wanted() const { return !file.empty(); }
};

/// --plot and --plot-theme. `what` says what is drawn. Returns --plot, to be put into a group.
void AddPlotOptions(CLI::App& command, PlotText& text, const std::string& what, const std::string& group = "");

/// --rays: the light's way as a second drawing of a command that has --plot already, whose --plot-theme counts for
/// both.
void AddRaysOption(CLI::App& command, PlotText& rays, const std::string& group = "");

/// Whether a chart can be written there at all: before any lens moves for it. Usage: another ending than .svg and .png.
/// CannotWrite: the program that makes PNG is not installed.
std::expected<void, Failure> CheckPlot(const PlotText& text);
/// The same of a command with --rays.
std::expected<void, Failure> CheckPlots(const PlotText& plot, const PlotText& rays);

/// `rays` with the theme of `plot`.
PlotText RaysInTheme(const PlotText& plot, const PlotText& rays);

/// Writes a document of io::ChartSvg or io::ChartsSvg, whole or not at all; nothing where none is wanted. An SVG is
/// light or dark as its viewer prefers, a PNG light and twice as large, unless --plot-theme says otherwise.
/// CannotWrite, and Timeout where rsvg-convert takes more than 60 s.
std::expected<void, Failure> WritePlot(const PlotText& text, const std::string& svg);

}  // namespace lensd::cli
