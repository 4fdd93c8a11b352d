// Sections, charts in two widths, tables of verdicts and the legend of where figures come from.
#include "bench/report/page.h"

#include <algorithm>
#include <map>
#include <set>

namespace lensd::bench {
namespace {

// Okabe and Ito's colours, told apart by nearly all readers, darker or lighter for the ground they stand on.
constexpr const char* kColours = R"(
:root{--bg:#ffffff;--fg:#1d2226;--soft:#59636b;--grid:#e3e7ea;--card:#f6f8f9;--s0:#0062a3;--s1:#c24e00;--s2:#5f6870;--s3:#00795a;--s4:#8a5a9e;--s5:#b3003b;--halo:#ffffff}
@media(prefers-color-scheme:dark){:root{--bg:#14181b;--fg:#e8ecef;--soft:#a3aeb6;--grid:#2c343a;--card:#1c2226;--s0:#5db7f5;--s1:#f2a03d;--s2:#b4bec6;--s3:#3fcfa2;--s4:#d3a0e6;--s5:#ff7d9d;--halo:#14181b}}
)";
// Of the charts.
constexpr const char* kShapes = R"(
text{font:12px system-ui,"DejaVu Sans",sans-serif;fill:var(--soft)}text.d,text.h{fill:var(--fg)}text.h{font-weight:bold}text.d{paint-order:stroke;stroke:var(--card);stroke-width:3px}
.grid{stroke:var(--grid)}.axis{stroke:var(--soft)}.floor{stroke:var(--fg);stroke-dasharray:5 4}.leader{stroke:var(--soft);stroke-width:.7}.interval{stroke:var(--fg);stroke-width:2}
.front{fill:none;stroke:var(--soft);stroke-width:1.2}.l{fill:none;stroke-width:1.8}.dashed{stroke-dasharray:6 4}.i{stroke-width:1.6}.m{stroke:var(--card);stroke-width:.8}
.s0{fill:var(--s0)}.s1{fill:var(--s1)}.s2{fill:var(--s2)}.s3{fill:var(--s3)}.s4{fill:var(--s4)}.s5{fill:var(--s5)}
.l0{stroke:var(--s0)}.l1{stroke:var(--s1)}.l2{stroke:var(--s2)}.l3{stroke:var(--s3)}.l4{stroke:var(--s4)}.l5{stroke:var(--s5)}
.within{fill:var(--s0)}.off{fill:var(--s1)}.refused{fill:none;stroke:var(--soft)}.false{fill:var(--s5)}
)";
constexpr const char* kStyle = R"(
*{box-sizing:border-box}body{margin:0 auto;max-width:1560px;padding:12px 16px 48px;background:var(--bg);color:var(--fg);font:16px/1.5 system-ui,"DejaVu Sans",sans-serif}
h1{font-size:1.7em;line-height:1.2}h2{margin-top:2em;border-bottom:1px solid var(--grid)}a{color:var(--s0)}
.charts{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(100%,600px),1fr));gap:20px;align-items:start}
figure{margin:0;padding:14px;background:var(--card);border-radius:8px;min-width:0}figure h3{margin:0 0 4px;font-size:1.05em;line-height:1.3}
figure p{margin:4px 0;font-size:.92em}figure .read{color:var(--soft)}svg{display:block;width:100%;height:auto;margin:8px 0}
svg.narrow,.only-narrow{display:none}@media(max-width:640px){.wide{display:none}.only-narrow{display:block}}
.key{display:flex;flex-wrap:wrap;gap:4px 16px;font-size:.88em}.key svg{display:inline;width:14px;height:14px;margin:0 4px 0 0;vertical-align:-2px}
.scroll{overflow-x:auto}table{border-collapse:collapse;font-size:.88em;width:100%}td,th{padding:6px 10px;border-bottom:1px solid var(--grid);text-align:left;vertical-align:top}
.verdict{white-space:nowrap;font-weight:bold}.met{color:var(--s3)}.missed{color:var(--s5)}.open{color:var(--soft)}
@media(max-width:640px){table,tbody,tr,td{display:block}tr.head{display:none}td{border:0;padding:2px 0}td:first-child{font-weight:bold;padding-top:10px}tr{border-bottom:1px solid var(--grid);padding-bottom:8px}td[data-k]:not(:empty)::before{content:attr(data-k) ": ";color:var(--soft)}td:empty{display:none}}
)";

std::string SvgOf(const Figure& figure, double width) {
  return std::visit([&](const auto& chart) { return Draw(chart, width).Svg(figure.title); }, figure.chart);
}

std::string KeyOf(const Figure& figure) {
  std::string html;
  const auto add = [&](const std::string& sample, const std::string& name) {
    html += "<span>" + sample + Escaped(name) + "</span>";
  };
  for (const auto& [series, name] : figure.key) {
    Drawing mark(14);
    mark.SetHeight(14);
    mark.Mark(7, 7, series, name);
    add(mark.Svg(name), name);
  }
  if (std::holds_alternative<OutcomeChart>(figure.chart)) {
    for (const auto& [style, name] :
         {std::pair{"within", "within"}, {"off", "off by more"}, {"refused", "refused"}, {"false", "false"}}) {
      Drawing box(14);
      box.SetHeight(14);
      box.Rect({1, 2, 12, 10}, style, name);
      add(box.Svg(name), name);
    }
  }
  return html.empty() ? "" : "<div class=\"key\">" + html + "</div>\n";
}

std::string HtmlOf(const Figure& figure) {
  return "<figure id=\"" + figure.id + "\"><h3>" + Escaped(figure.title) +
         "</h3>\n<p class=\"read\"><b>How to read it:</b> " + Escaped(figure.read) + "</p>\n" + KeyOf(figure) +
         "<div class=\"wide\">" + SvgOf(figure, kWideChart) + "</div><div class=\"only-narrow\">" +
         SvgOf(figure, kNarrowChart) + "</div>\n<p class=\"means\"><b>What it means:</b> " + Escaped(figure.means) +
         "</p></figure>\n";
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
    html += "<tr><td>" + Escaped(verdict.work) + "</td><td><span class=\"verdict " +
            (met      ? "met\">✓ met"
             : missed ? "missed\">✗ missed"
                      : "open\">– open") +
            "</span>" + (verdict.words.empty() ? "" : "<br>" + Escaped(verdict.words)) + "</td>";
    for (const auto& [name, cell] : {std::pair{"ours", &verdict.ours},
                                     {"floor", &verdict.floor},
                                     {"best peer", &verdict.peer},
                                     {"goal", &verdict.goal}}) {
      if (!floors && cell == &verdict.floor) continue;
      html += "<td data-k=\"" + std::string(name) + "\">" + Escaped(*cell) + "</td>";
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
    html += "<h3>" + Escaped(family) + "</h3><ul>";
    for (const std::string& place : places) html += "<li>" + Escaped(place) + "</li>";
    html += "</ul><p>" + std::to_string(counts[family]) + " figures of " + std::to_string(commands[family].size()) +
            " commands";
    for (const std::string& seed : seeds[family])
      html += (&seed == &*seeds[family].begin() ? "; seed " : ", ") + Escaped(seed);
    html += ".</p><details><summary>commands</summary><ul>";
    for (const std::string& command : commands[family]) html += "<li><code>" + Escaped(command) + "</code></li>";
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
         std::string(kColours) + kShapes + kStyle +
         "</style></head><body>\n<h1>lensd: speed against accuracy</h1>\n<p>" + when +
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
  std::string svg = SvgOf(figure, kWideChart);
  const std::size_t end = svg.find('>');
  // A document's ground is not known: the chart brings its own.
  return svg.substr(0, end) + " xmlns=\"http://www.w3.org/2000/svg\"><style>" + kColours + kShapes +
         "svg{background:var(--card)}</style>" + svg.substr(end + 1);
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
