// Sections, charts in two widths, tables of verdicts and where figures come from.
#include "bench/report/page.h"

#include <algorithm>
#include <map>
#include <set>

#include "io/svg_colours.h"

namespace lensd::bench {
namespace {

constexpr const char* kColours = R"(
:root{--bg:#ffffff;--fg:#1d2226;--soft:#59636b;--grid:#e3e7ea;--link:#0062a3;--met:#00795a;--missed:#b3003b}
@media(prefers-color-scheme:dark){:root{--bg:#14181b;--fg:#e8ecef;--soft:#a3aeb6;--grid:#2c343a;--link:#5db7f5;--met:#3fcfa2;--missed:#ff7d9d}}
)";
constexpr const char* kStyle = R"(
*{box-sizing:border-box}body{margin:0 auto;max-width:1560px;padding:12px 16px 48px;background:var(--bg);color:var(--fg);font:16px/1.5 system-ui,"DejaVu Sans",sans-serif}
h1{font-size:1.7em;line-height:1.2}h2{margin-top:2em;border-bottom:1px solid var(--grid)}a{color:var(--link)}
.charts{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(100%,600px),1fr));gap:20px;align-items:start}
figure{margin:0;padding:14px;border:1px solid var(--grid);border-radius:8px;min-width:0}
figure p{margin:4px 0;font-size:.92em}figure .read{color:var(--soft)}svg{display:block;width:100%;height:auto;margin:8px 0}
.only-narrow{display:none}@media(max-width:640px){.wide{display:none}.only-narrow{display:block}}
.scroll{overflow-x:auto}table{border-collapse:collapse;font-size:.88em;width:100%}td,th{padding:6px 10px;border-bottom:1px solid var(--grid);text-align:left;vertical-align:top}
.verdict{white-space:nowrap;font-weight:bold}.met{color:var(--met)}.missed{color:var(--missed)}.open{color:var(--soft)}
@media(max-width:640px){table,tbody,tr,td{display:block}tr.head{display:none}td{border:0;padding:2px 0}td:first-child{font-weight:bold;padding-top:10px}tr{border-bottom:1px solid var(--grid);padding-bottom:8px}td[data-k]:not(:empty)::before{content:attr(data-k) ": ";color:var(--soft)}td:empty{display:none}}
)";

std::string SvgOf(const Figure& figure, int width) {
  return std::visit([&](const auto& chart) { return io::ChartsSvg(Drawn(chart, figure.title, figure.key, width), 1); },
                    figure.chart);
}

std::string HtmlOf(const Figure& figure) {
  return "<figure id=\"" + figure.id + "\"><div class=\"wide\">" + SvgOf(figure, kWideChart) +
         "</div><div class=\"only-narrow\">" + SvgOf(figure, kNarrowChart) +
         "</div>\n<p class=\"read\"><b>How to read it:</b> " + io::Escaped(figure.read) +
         "</p>\n<p class=\"means\"><b>What it means:</b> " + io::Escaped(figure.means) + "</p>\n<p><a href=\"" +
         figure.id + ".csv\">The marks as CSV</a></p></figure>\n";
}

std::string SectionOf(const std::string& id, const std::string& title, const std::string& about,
                      const std::vector<Figure>& figures) {
  std::string html = "<h2 id=\"" + id + "\">" + title + "</h2>\n<p>" + about + "</p>\n<div class=\"charts\">\n";
  for (const Figure& figure : figures) html += HtmlOf(figure);
  return html + "</div>\n";
}

std::string TableOf(const std::vector<Verdict>& verdicts) {
  const bool floors = std::ranges::any_of(verdicts, [](const Verdict& verdict) { return !verdict.floor.empty(); });
  std::string html =
      "<div class=\"scroll\"><table><tbody><tr "
      "class=\"head\"><th>work</th><th>verdict</th><th>ours</th>" +
      std::string(floors ? "<th>floor</th>" : "") + "<th>best peer</th><th>goal</th></tr>\n";
  for (const Verdict& verdict : verdicts) {
    const bool met = verdict.kind == Verdict::Kind::Met, missed = verdict.kind == Verdict::Kind::Missed;
    html += "<tr><td>" + io::Escaped(verdict.work) + "</td><td><span class=\"verdict " +
            (met      ? "met\">✓ met"
             : missed ? "missed\">✗ missed"
                      : "open\">– open") +
            "</span>" + (verdict.words.empty() ? "" : "<br>" + io::Escaped(verdict.words)) + "</td>";
    for (const auto& [name, cell] : {std::pair{"ours", &verdict.ours},
                                     {"floor", &verdict.floor},
                                     {"best peer", &verdict.peer},
                                     {"goal", &verdict.goal}}) {
      if (!floors && cell == &verdict.floor) continue;
      html += "<td data-k=\"" + std::string(name) + "\">" + io::Escaped(*cell) + "</td>";
    }
    html += "</tr>\n";
  }
  return html + "</tbody></table></div>\n";
}

/// Where and when, with the commands: family by family.
std::string OriginOf(const Evidence& rows) {
  std::map<std::string, std::set<std::string>> where, commands, seeds;
  std::map<std::string, int> counts;
  for (const EvidenceRow& row : rows) {
    where[row.family].insert(row.made.date + ", commit " + row.made.commit + ", " + row.made.machine + ", " +
                             row.made.compiler);
    commands[row.family].insert(row.settings);
    ++counts[row.family];
    if (!row.seed.empty()) seeds[row.family].insert(row.seed);
  }
  std::string html;
  for (const auto& [family, places] : where) {
    html += "<h3>" + io::Escaped(family) + "</h3><ul>";
    for (const std::string& place : places) html += "<li>" + io::Escaped(place) + "</li>";
    html += "</ul><p>" + std::to_string(counts[family]) + " figures of " + std::to_string(commands[family].size()) +
            " commands";
    for (const std::string& seed : seeds[family])
      html += (&seed == &*seeds[family].begin() ? "; seed " : ", ") + io::Escaped(seed);
    html += ".</p><details><summary>commands</summary><ul>";
    for (const std::string& command : commands[family]) html += "<li><code>" + io::Escaped(command) + "</code></li>";
    html += "</ul></details>\n";
  }
  return html;
}

std::string Opening(const Evidence& rows) {
  std::set<std::string> dates;
  for (const EvidenceRow& row : rows) dates.insert(row.made.date);
  std::string when = dates.empty()                       ? "no evidence yet"
                     : *dates.begin() == *dates.rbegin() ? *dates.begin()
                                                         : *dates.begin() + " to " + *dates.rbegin();
  return "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
         "content=\"width=device-width,initial-scale=1\">"
         "<meta name=\"color-scheme\" content=\"light dark\"><title>lensd: speed against accuracy</title>\n<style>" +
         std::string(kColours) + kStyle + "</style>\n" + io::DarkRules() +
         "</head><body>\n<h1>lensd: speed against accuracy</h1>\n<p>" + when +
         ". lensd turns the motors of camera lenses so that pictures are sharp where they must be. This page shows how "
         "fast and how exact its "
         "parts are beside other people's methods, where each of them fails, and how simple a model each case may be "
         "given. Marks tell their "
         "count and, where runs were repeated, their 95 % interval when pointed at; pictures that a renderer makes the "
         "same every "
         "time have none. n counts runs, or processes where time is measured. All figures are in <a "
         "href=\"evidence.csv\">evidence.csv</a> and "
         "<a href=\"evidence.json\">evidence.json</a>, beside this page, with the command that made each.</p>\n"
         "<p><a href=\"#goals\">Goals</a> · <a href=\"#speed\">Speed against accuracy</a> · <a "
         "href=\"#failures\">Where methods fail</a> · "
         "<a href=\"#needs\">What the scene needs</a> · <a href=\"#origin\">Where figures come from</a></p>\n";
}

}  // namespace

std::vector<Figure> AllFigures(const Evidence& rows) {
  std::vector<Figure> all = SpeedFigures(rows);
  for (auto* make : {&FailureFigures, &NeedFigures}) {
    std::vector<Figure> more = (*make)(rows);
    std::ranges::move(more, std::back_inserter(all));
  }
  return all;
}

std::string ChartFileOf(const Figure& figure) {
  return io::InTheme(SvgOf(figure, kWideChart), io::Theme::Viewer);
}

std::string MarksFileOf(const Figure& figure) {
  return std::visit([](const auto& chart) { return MarksCsv(chart); }, figure.chart);
}

std::string PageOf(const Evidence& rows) {
  return Opening(rows) +
         "<h2 id=\"goals\">Goals and regimes</h2>\n<p>Times are of one machine; only ratios to what was measured "
         "beside them carry over. "
         "A goal that was set in microseconds is asked as a ratio to the peer that was measured with "
         "it. Factors are medians of ratios taken side by side, and it is their interval that decides, also where "
         "single "
         "times spread too widely. “auto” is lensd's autofocus (or the renderer that lensd chose), “defocus” its way "
         "of measuring "
         "blur in a few frames, “sweep” its search of the whole range; “fibonacci”, “hill-climb”, “coarse-fine” and "
         "“sweep-parabola” are what others do.</p>\n<h3>Numbers to beat</h3>\n" +
         TableOf(GoalVerdicts(rows)) + "<h3>Regimes of failure</h3>\n" + TableOf(RegimeVerdicts(rows)) +
         SectionOf(
             "speed", "Speed against accuracy",
             "Every method and peer of a family; times of one family in processes that took turns. A floor is what "
             "cannot be spared: a plain reading, a copy, an exchange, the light and one step of the motor. What is "
             "left of a floor of reading reads with wider instructions than that.",
             SpeedFigures(rows)) +
         SectionOf(
             "failures", "Where methods fail",
             "First how runs end in each regime, then one difficulty after the other, turned up until methods fail.",
             FailureFigures(rows)) +
         SectionOf("needs", "What the scene needs",
                   "The simplest renderer or method that is good enough should be taken, and never one that is not.",
                   NeedFigures(rows)) +
         "<h2 id=\"origin\">Where figures come from</h2>\n" + OriginOf(rows) + "</body></html>\n";
}

}  // namespace lensd::bench
