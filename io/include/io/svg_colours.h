// Charts on a light or a dark ground.
#pragma once

#include <string>

namespace lensd::io {

inline constexpr const char* kGridColour = "#e4e4e4";
inline constexpr const char* kMinorGridColour = "#f2f2f2";

/// Viewer: light, and dark where the viewing program prefers that (prefers-color-scheme).
enum class Theme { Viewer, Light, Dark };

/// A document of ChartSvg or ChartsSvg in these colours. Of a colour that no chart has by itself only the light one is
/// known: it stays.
std::string InTheme(const std::string& svg, Theme theme);

/// What Theme::Viewer adds to a document: a style element for a page that shows several charts.
std::string DarkRules();

}  // namespace lensd::io
