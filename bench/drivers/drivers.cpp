// The table of drivers: what each call costs beside a bare exchange over the same wire, what a move costs beside the
// mechanism's own travel, and how moves end when answers are lost, late, or true of nothing that was done.
#include "bench/drivers/drivers.h"

#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <functional>
#include <future>
#include <iostream>
#include <memory>

#include "bench/command.h"
#include "bench/drivers/moves.h"
#include "bench/outputs.h"

namespace lensd::bench {
namespace {

using nlohmann::ordered_json;

struct DriverRow {
  const char* name;
  std::unique_ptr<DriverStand> (*make)(const Weather& weather);
  bool weather;  ///< its exchanges can be spoilt
};
constexpr DriverRow kDrivers[] = {{"Modbus TCP", MakeModbusTcpStand, true},
                                  {"Modbus RTU", MakeModbusRtuStand, true},
                                  {"LensConnect", MakeLensConnectStand, true},
                                  {"UVC", MakeUvcStand, true},
                                  {"GenICam", MakeGigeStand, false}};

struct Options {
  std::string only;
  std::string driver;  ///< empty: all
  int count = 30;
  int moves = 40;
  Outputs outputs;
};

/// All rows have these keys.
ordered_json EmptyRow(const DriverRow& driver) {
  return {{"driver", driver.name}, {"measure", nullptr}, {"unit", nullptr},  {"floor", false},   {"n", 0},
          {"p50", nullptr},        {"p95", nullptr},     {"sweep", nullptr}, {"value", nullptr}, {"within", nullptr},
          {"verified", nullptr},   {"refused", nullptr}, {"false", nullptr}};
}

void FillQuantiles(ordered_json& row, std::vector<double> values) {
  std::ranges::sort(values);
  const auto at = [&](double part) {
    return values[static_cast<std::size_t>(part * static_cast<double>(values.size() - 1))];
  };
  row["n"] = values.size();
  row["p50"] = at(0.5);
  row["p95"] = at(0.95);
}

Result<void> AddSpeed(const DriverRow& driver, int count, std::vector<ordered_json>& rows) {
  const auto stand = driver.make({});
  if (stand == nullptr) return Fail(Code::Busy, "another process plays a GigE camera at 127.0.0.1");
  const auto times = TimeDriver(*stand, count);
  if (!times) return PassOn(times);
  const auto add = [&](const char* measure, const char* unit, const std::vector<double>& values) {
    ordered_json row = EmptyRow(driver);
    row["measure"] = measure;
    row["unit"] = unit;
    row["floor"] = &values == &times->bare_exchange || &values == &times->travel;
    FillQuantiles(row, values);
    rows.push_back(std::move(row));
  };
  add("bare exchange", "ms", times->bare_exchange);
  add("reading", "ms", times->reading);
  add("command", "ms", times->command);
  add("stop", "ms", times->stop);
  add("travel after a stop", "steps", times->stop_travel);
  add("travel", "ms", times->travel);
  add("move", "ms", times->move);
  add("beyond the travel", "ms", times->beyond);
  add("error", "steps", times->error);
  return {};
}

struct Sweep {
  const char* name;
  std::array<double, 5> values;
  Weather (*weather)(double value);
};
constexpr double kPercent = 0.01;
const Sweep kSweeps[] = {
    {"answers lost [%]", {0, 2, 5, 10, 20}, [](double value) { return Weather{.lost = kPercent * value}; }},
    {"one answer in five late by [ms]",
     {0, 20, 50, 100, 200},
     [](double value) {
       return Weather{.late = value > 0 ? 0.2 : 0.0, .late_by = std::chrono::milliseconds(static_cast<int>(value))};
     }},
    {"commands acknowledged and not obeyed [%]", {0, 2, 5, 10, 20}, [](double value) {
       return Weather{.disobeyed = kPercent * value};
     }}};

Result<ordered_json> WeatherRow(const DriverRow& driver, const Sweep& sweep, double value, int moves) {
  const Weather weather = sweep.weather(value);
  const auto stand = driver.make(weather);
  const auto outcomes = MoveInWeather(*stand, weather, moves);
  if (!outcomes) return PassOn(outcomes);
  ordered_json row = EmptyRow(driver);
  row["measure"] = "moves in weather";
  row["unit"] = "ms";
  row["sweep"] = sweep.name;
  row["value"] = value;
  FillQuantiles(row, outcomes->took);
  row["within"] = outcomes->within;
  row["verified"] = outcomes->verified;
  row["refused"] = outcomes->refused;
  row["false"] = outcomes->false_reached;
  return row;
}

/// The values of a sweep run beside each other, each on a stand and a thread of its own: they wait for answers nearly
/// all the time.
Result<void> AddWeather(const DriverRow& driver, int moves, std::vector<ordered_json>& rows) {
  for (const Sweep& sweep : kSweeps) {
    std::vector<std::future<Result<ordered_json>>> running;
    for (const double value : sweep.values)
      running.push_back(std::async(std::launch::async, WeatherRow, std::cref(driver), std::cref(sweep), value, moves));
    for (auto& one : running) {
      auto row = one.get();
      if (!row) return PassOn(row);
      rows.push_back(*std::move(row));
    }
  }
  return {};
}

int Bench(const Options& options) {
  std::vector<ordered_json> rows;
  std::vector<std::string> missing = {
      "V4L2: no device that moves without a kernel module; its driver's tests script one"};
  for (const DriverRow& driver : kDrivers) {
    if (!options.driver.empty() && options.driver != driver.name) continue;
    Result<void> done;
    if (options.only != "weather") done = AddSpeed(driver, options.count, rows);
    if (!done && done.error().code == Code::Busy) {
      std::cerr << "lens-bench drivers: left out: " << done.error().message << "\n";
      continue;
    }
    if (done && options.only != "speed" && driver.weather) done = AddWeather(driver, options.moves, rows);
    if (done) continue;
    std::cerr << "lens-bench drivers: " << driver.name << ": " << done.error().message << "\n";
    return EX_SOFTWARE;
  }
  return WriteOutputs("drivers", rows, {}, options.outputs, [] { return std::string(); });
}

}  // namespace

int RunDrivers(int argc, char** argv) {
  CLI::App app(
      "Reads, commands, stops and moves by every driver on its simulated device, beside a bare exchange over the same\n"
      "wire and the mechanism's own travel; then moves while answers are lost, late or false, held to the device's "
      "truth.\n"
      "Modbus and GenICam go over real sockets and terminals; LensConnect and UVC on a clock of the wire's own time, "
      "which\n"
      "no processor slows. V4L2 is left out: nothing moves there without a kernel module. Run it from the sources' "
      "folder.");
  Options options;
  app.add_option("--only", options.only, "one part")->check(CLI::IsMember({"speed", "weather"}));
  std::vector<std::string> names;
  for (const DriverRow& driver : kDrivers) names.emplace_back(driver.name);
  app.add_option("--driver", options.driver, "one driver")->check(CLI::IsMember(names));
  app.add_option("--count", options.count, "readings, commands, stops and moves that are timed")
      ->check(CLI::Range(1, 10'000))
      ->capture_default_str();
  app.add_option("--moves", options.moves, "moves a driver, difficulty and value")
      ->check(CLI::Range(1, 100'000))
      ->capture_default_str();
  app.add_option("--csv", options.outputs.csv, "file for the table");
  app.add_flag("--json", options.outputs.as_json, "one line of JSON instead of the table");
  return ParseThen(app, argc, argv, [&] { return Bench(options); });
}

}  // namespace lensd::bench
