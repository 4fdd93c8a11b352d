// Prometheus' text format 0.0.4: tables say which field of lensd's Metrics becomes which metric, with HELP and TYPE.
#include "web/metrics_text.h"

#include <array>
#include <cstdint>
#include <string_view>

namespace lensd::web {
namespace {

using varlink::Json;

struct Counter {
  const char* field;
  const char* name;
  const char* help;
};

constexpr std::array kOfMetrics{
    Counter{"moves", "lensd_moves_total", "Moves and homings that ended by themselves."},
    Counter{"movesReached", "lensd_moves_reached_total", "Moves that arrived."},
    Counter{"movesVerified", "lensd_moves_verified_total", "Moves whose arrival was measured."},
    Counter{"movesMissed", "lensd_moves_missed_total", "Moves that came to rest elsewhere."},
    Counter{"autofocuses", "lensd_autofocuses_total", "Searches for focus that ended by themselves."},
    Counter{"autofocusesFocused", "lensd_autofocuses_focused_total", "Searches for focus that were sure."},
    Counter{"frames", "lensd_frames_total", "Frames that came whole."},
    Counter{"framesFlawed", "lensd_frames_flawed_total",
            "Frames that are shown though they have bytes too many or no end marker."},
    Counter{"refused", "lensd_calls_refused_total", "Calls that were answered with an error because of this lens."},
    Counter{"openings", "lensd_openings_total", "Times that its device was opened."},
    Counter{"failures", "lensd_failures_total", "Times that the lens failed and was opened again."},
};
constexpr std::array kHistograms{
    Counter{"waitMs", "lensd_command_wait_seconds", "How long commands waited for their lens."},
    Counter{"settleMs", "lensd_settle_seconds", "How long moves and homings took until they had settled."},
};
constexpr std::array kOfDaemon{
    Counter{"failuresTold", "lensd_failure_commands_total", "Failures for which a command was run."},
    Counter{"failuresNotTold", "lensd_failure_commands_failed_total", "Those of them for which it failed."},
    Counter{"failuresDropped", "lensd_failure_commands_dropped_total", "Failures for which none was run."},
};
constexpr std::array kDaemonQueues{
    Counter{"filesWaiting", "lensd_files_waiting", "Writes and reads of files that wait for their turn."},
    Counter{"plansWaiting", "lensd_plans_waiting", "Long plans that wait for their turn."},
};
constexpr std::array kOfCounters{
    Counter{"framesLost", "lensd_frames_lost_total", "Frames that were damaged or missing."},
    Counter{"framesLate", "lensd_frames_late_total", "Frames that came more than a frame time late."},
    Counter{"packetsLost", "lensd_packets_lost_total", "Packets of a network camera that never came."},
    Counter{"packetsResent", "lensd_packets_resent_total", "Packets of a network camera that were sent again."},
    Counter{"framesDamaged", "lensd_frames_damaged_total", "Frames that came and could not be used."},
    Counter{"busErrors", "lensd_bus_errors_total", "Questions to a device without a proper answer."},
    Counter{"temperaturesLeftOut", "lensd_temperatures_left_out_total", "Readings of a thermometer that cannot be."},
};

/// A value of a label: backslash, quote and line end are written with a backslash.
std::string Quoted(std::string_view text) {
  std::string quoted;
  for (const char letter : text) {
    if (letter == '\\' || letter == '"') quoted += '\\';
    quoted += letter == '\n' ? std::string("\\n") : std::string(1, letter);
  }
  return quoted;
}

void Describe(std::string& text, const char* name, const char* type, const char* help) {
  text += "# HELP " + std::string(name) + " " + help + "\n# TYPE " + name + " " + type + "\n";
}

void Sample(std::string& text, const char* name, const std::string& labels, const Json& value) {
  if (!value.is_number()) return;
  text += std::string(name) + (labels.empty() ? "" : "{" + labels + "}") + " " + varlink::WriteJson(value) + "\n";
}

std::string LensLabel(const std::string& name) {
  return "lens=\"" + Quoted(name) + "\"";
}

void WriteCounters(std::string& text, const Json& lenses) {
  for (const Counter& counter : kOfMetrics) {
    Describe(text, counter.name, "counter", counter.help);
    for (const Json& lens : lenses) Sample(text, counter.name, LensLabel(lens["lens"]), lens[counter.field]);
  }
  for (const Counter& counter : kOfCounters) {
    Describe(text, counter.name, "counter", counter.help);
    for (const Json& lens : lenses)
      Sample(text, counter.name, LensLabel(lens["lens"]), lens["counters"][counter.field]);
  }
}

/// Buckets count all that is not longer than their end; the last one everything.
void WriteHistogram(std::string& text, const Counter& counter, const std::string& label, const Json& histogram) {
  constexpr double kSecondsPerMs = 1e-3;
  if (!histogram.is_object()) return;
  const std::string name = counter.name;
  const Json& ends = histogram["upToMs"];
  std::uint64_t below = 0;
  for (std::size_t i = 0; i < ends.size(); ++i) {
    below += histogram["counts"].at(i).get<std::uint64_t>();
    const std::string end = varlink::WriteJson(ends[i].get<double>() * kSecondsPerMs);
    Sample(text, (name + "_bucket").c_str(), label + ",le=\"" + end + "\"", below);
  }
  Sample(text, (name + "_bucket").c_str(), label + ",le=\"+Inf\"", histogram["count"]);
  Sample(text, (name + "_sum").c_str(), label, histogram["sumMs"].get<double>() * kSecondsPerMs);
  Sample(text, (name + "_count").c_str(), label, histogram["count"]);
}

void WriteWork(std::string& text, const Json& lenses, const Json& daemon) {
  Describe(text, "lensd_commands_waiting", "gauge", "Commands that wait until the lens takes them.");
  for (const Json& lens : lenses) {
    Sample(text, "lensd_commands_waiting", LensLabel(lens["lens"]), lens["commandsWaiting"]);
  }
  for (const Counter& histogram : kHistograms) {
    Describe(text, histogram.name, "histogram", histogram.help);
    for (const Json& lens : lenses) {
      WriteHistogram(text, histogram, LensLabel(lens["lens"]), lens.value(histogram.field, Json()));
    }
  }
  if (!daemon.is_object()) return;
  for (const Counter& counter : kOfDaemon) {
    Describe(text, counter.name, "counter", counter.help);
    Sample(text, counter.name, "", daemon[counter.field]);
  }
  for (const Counter& queue : kDaemonQueues) {
    Describe(text, queue.name, "gauge", queue.help);
    Sample(text, queue.name, "", daemon[queue.field]);
  }
}

void WriteStates(std::string& text, const Json& lenses) {
  Describe(text, "lensd_lens_connected", "gauge", "1 where the lens answers.");
  for (const Json& lens : lenses) {
    Sample(text, "lensd_lens_connected", LensLabel(lens["name"]), lens["connected"] == true ? 1 : 0);
  }
  const auto each_axis = [&](const char* name, const auto& value) {
    for (const Json& lens : lenses) {
      for (const Json& axis : lens["axes"]) {
        const std::string kind = axis["axis"];
        Sample(text, name, LensLabel(lens["name"]) + ",axis=\"" + Quoted(kind) + "\"", value(axis));
      }
    }
  };
  Describe(text, "lensd_axis_position", "gauge", "Native position.");
  each_axis("lensd_axis_position", [](const Json& axis) { return axis["position"]; });
  Describe(text, "lensd_axis_fault", "gauge", "1 while the device complains of the axis.");
  each_axis("lensd_axis_fault", [](const Json& axis) { return Json(axis.value("fault", Json()).is_null() ? 0 : 1); });
}

}  // namespace

std::string MetricsText(const Json& status, const Json& metrics, const OwnMetrics& own) {
  std::string text;
  const bool up = status.is_object() && metrics.is_object();
  Describe(text, "lensd_up", "gauge", "1 while lensd answers.");
  Sample(text, "lensd_up", "", up ? 1 : 0);
  if (up) {
    WriteCounters(text, metrics.value("lenses", Json::array()));
    WriteWork(text, metrics.value("lenses", Json::array()), metrics.value("daemon", Json()));
    WriteStates(text, status.value("lenses", Json::array()));
  }
  Describe(text, "lens_web_connections", "gauge", "Connections of browsers and programs.");
  Sample(text, "lens_web_connections", "", own.connections);
  Describe(text, "lens_web_streams", "gauge", "Streams of pictures and events.");
  Sample(text, "lens_web_streams", "", own.streams);
  Describe(text, "lens_web_views", "gauge", "Views of lensd that are open.");
  Sample(text, "lens_web_views", "", own.views);
  Describe(text, "lens_web_frames_total", "counter", "Pictures that came from lensd.");
  Sample(text, "lens_web_frames_total", "", own.frames);
  Describe(text, "lens_web_frames_dropped_total", "counter", "Pictures left out for viewers that were too slow.");
  Sample(text, "lens_web_frames_dropped_total", "", own.frames_dropped);
  return text;
}

}  // namespace lensd::web
