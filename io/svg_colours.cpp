// The colours that the series of a chart take in turn, and what each colour becomes on a dark ground: it has a twin that
// is as far from dark as itself from white. Rules of style win over attributes, so a viewer that prefers dark needs
// nothing but a rule for each.
#include "io/svg_colours.h"

#include <iterator>
#include <string_view>

#include "io/svg.h"

namespace lensd::io {
namespace {

constexpr const char* kPalette[] = {"#0072b2", "#d55e00", "#009e73", "#b0479a",
                                    "#b8860b", "#3a9bd9", "#6b6b6b", "#8c3b2a"};

struct Twin {
  std::string_view light, dark;
};
constexpr Twin kTwins[] = {
    {"#ffffff", "#14181b"},                                                                          // ground, halos
    {"#000000", "#ffffff"}, {"#111111", "#f4f6f8"}, {"#222222", "#e8ecef"}, {"#333333", "#dce1e5"},  // ink
    {"#444444", "#8b969e"}, {"#555555", "#aab4bb"}, {"#777777", "#98a3ab"}, {"#888888", "#8b969e"},
    {"#999999", "#98a3ab"}, {"#9aa0a6", "#9aa0a6"}, {"#bbbbbb", "#4a545b"}, {"#e4e4e4", "#2f373d"},
    {"#f2f2f2", "#21272c"}, {"#0072b2", "#5db7f5"}, {"#d55e00", "#ff9a52"}, {"#009e73", "#3fcfa2"},
    {"#b0479a", "#df8fd0"},  // the palette
    {"#b8860b", "#e0b84a"}, {"#3a9bd9", "#8fd0ff"}, {"#6b6b6b", "#b4bec6"}, {"#8c3b2a", "#e08a76"},
    {"#b3003b", "#ff7d9d"}, {"#b22222", "#ff8a80"}, {"#d1495b", "#ff8a9a"}, {"#e0b030", "#f0cc66"},  // of single charts
    {"#2a9d5c", "#5fd08f"}, {"#2266aa", "#6fb0f0"},
};

std::string InDark(std::string svg) {
  for (std::size_t at = svg.find("\"#"); at != std::string::npos; at = svg.find("\"#", at + 1)) {
    for (const Twin& twin : kTwins) {
      if (svg.compare(at + 1, twin.light.size(), twin.light) != 0) continue;
      svg.replace(at + 1, twin.light.size(), twin.dark);
      break;
    }
  }
  return svg;
}

}  // namespace

std::string PaletteColour(std::size_t index) {
  return kPalette[index % std::size(kPalette)];
}

std::string DarkRules() {
  std::string rules = "<style>@media (prefers-color-scheme: dark) {\n";
  for (const Twin& twin : kTwins) {
    for (const std::string_view property : {"fill", "stroke"}) {
      rules += "[" + std::string(property) + "=\"" + std::string(twin.light) + "\"] { " + std::string(property) + ": " +
               std::string(twin.dark) + "; }\n";
    }
  }
  return rules + "}</style>\n";
}

std::string InTheme(const std::string& svg, Theme theme) {
  if (theme == Theme::Light) return svg;
  if (theme == Theme::Dark) return InDark(svg);
  const std::size_t body = svg.find(">\n");
  if (body == std::string::npos) return svg;
  return svg.substr(0, body + 2) + DarkRules() + svg.substr(body + 2);
}

}  // namespace lensd::io
