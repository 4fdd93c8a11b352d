// One function an option.
#include "cli/online/setup/add_lines.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdio>
#include <filesystem>
#include <string_view>

#include "cli/online/setup/lens_file.h"
#include "cli/text/quantity.h"
#include "cli/text/texts.h"

namespace lensd::cli {
namespace {

std::string MillimetresText(const Decimal& metres) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.12g", metres.Nearest().value_or(0.0) * 1e3);
  return text.data();
}

}  // namespace

std::string NumberTextOf(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.12g", value);
  return text.data();
}

Result<std::string> FocalLengthLine(const std::string& text) {
  auto range = ParseLengthRange(text, "--focal-length");
  if (!range) return PassOn(range);
  if (!(range->low.Nearest().value_or(0.0) > 0.0)) return Wrong("--focal-length", text, "a focal length is above 0");
  const std::string low = MillimetresText(range->low), high = MillimetresText(range->high);
  return "focal_length_mm = " + (low == high ? low : "[" + low + ", " + high + "]") + "\n";
}

Result<std::string> FNumberLine(const std::string& text) {
  if (text.contains(',')) {
    const auto parts = SplitAtCommas(text);
    const auto one = parts.size() == 2 ? ParseFNumber(std::string(parts[0]) + "." + std::string(parts[1]), "")
                                       : Result<Decimal>(Fail(Code::InvalidArgument, ""));
    const auto all = ParseFNumbers(text, "--f-number");
    const auto number = [](const Decimal& decimal) { return NumberTextOf(decimal.Nearest().value_or(0.0)); };
    std::string write = one ? number(*one) : "";
    if (all) write += (one ? " or " : "") + number(all->range.low) + ".." + number(all->range.high);
    return Wrong("--f-number", text,
                 "one number or a range belongs here, and a decimal has a point, not a comma: write " +
                     (write.empty() ? "2.8 or 1.4..16" : write));
  }
  auto openings = ParseFNumbers(text, "--f-number");
  if (!openings) return PassOn(openings);
  return "f_number = [" + openings->range.low.Text() + ", " + openings->range.high.Text() + "]\n";
}

Result<std::string> ClosestLine(const std::string& text, const std::string& from) {
  auto depth = ParseDepth(text, "--closest");
  if (!depth) return PassOn(depth);
  const double vergence = depth->Vergence().value;
  if (!(vergence > 0.0)) return Wrong("--closest", text, "the closest distance in focus is a distance, as in 0.3m");
  const double metres = depth->IsDistance() ? depth->value : 1.0 / vergence;
  return "closest_m = " + NumberTextOf(metres) + "\nclosest_from = \"" + (from.empty() ? "lens" : from) + "\"\n";
}

Result<std::string> PixelLine(const std::string& text) {
  const auto pixel = ParsePositiveLength(text, "--pixel");
  if (!pixel) return PassOn(pixel);
  return "pixel_um = " + NumberTextOf(pixel->Nearest().value_or(0.0) * 1e6) + "\n";
}

std::expected<std::string, Failure> DriveTable(const std::string& text) {
  const auto wrong = [&] {
    return Refuse(Exit::Usage, "--drive '" + text +
                                   "': say axis, unit, profile and range, as in "
                                   "focus=1,oriental-az,0..20000");
  };
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos) return wrong();
  const std::string all = text.substr(equals + 1);
  const auto parts = SplitAtCommas(all);
  const std::string axis = text.substr(0, equals);
  if (parts.size() != 3 || axis.empty() || !std::ranges::all_of(axis, [](unsigned char c) { return islower(c); }))
    return wrong();
  const std::string range(parts[2]);
  const std::size_t dots = range.find("..");
  if (dots == std::string::npos) return wrong();
  const auto unit = ParseNumber(parts[0], "--drive");
  const auto low = ParseNumber(range.substr(0, dots), "--drive"), high = ParseNumber(range.substr(dots + 2), "--drive");
  if (!unit || !low || !high) return wrong();
  std::string profile(parts[1]);
  std::error_code none;
  if (profile.ends_with(".toml")) profile = std::filesystem::absolute(profile, none).string();
  return "[lens.drives." + axis + "]\nunit = " + unit->Text() + "\nprofile = " + QuotedToml(profile) + "\nrange = [" +
         low->Text() + ", " + high->Text() + "]\n";
}

std::expected<std::string, Failure> KeyLine(const std::string& text) {
  const std::size_t equals = text.find('=');
  const std::string key = text.substr(0, equals);
  const bool plain = !key.empty() && std::ranges::all_of(key, [](unsigned char c) { return isalnum(c) || c == '_'; });
  if (equals == std::string::npos || !plain || equals + 1 == text.size()) {
    return Refuse(Exit::Usage, "--set '" + text + "': say a key and its value, as in --set address=10.0.0.12");
  }
  std::string value = text.substr(equals + 1);
  if (key == "command" || key == "on_failure")
    return Refuse(Exit::Usage, "--set " + key +
                                   ": this key names a program; "
                                   "write it into the configuration yourself");
  std::error_code none;
  constexpr std::array<std::string_view, 8> kTexts = {"serial", "id",      "address", "id_path",
                                                      "name",   "product", "sensor",  "chip"};
  const bool number = ParseNumber(value, key).has_value() && std::ranges::find(kTexts, key) == kTexts.end();
  const bool as_it_is = number || value == "true" || value == "false" || value[0] == '[' || value[0] == '"';
  if (as_it_is && value.find('\n') == std::string::npos) return key + " = " + value + "\n";
  if (std::filesystem::is_regular_file(value, none)) value = std::filesystem::absolute(value, none).string();
  return key + " = " + QuotedToml(value) + "\n";
}

}  // namespace lensd::cli
