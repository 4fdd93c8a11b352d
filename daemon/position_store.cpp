#include "position_store.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <system_error>

#include "io/atomic_file.h"
#include "proto/json.h"

namespace lensd::daemon {
namespace {

using drivers::Axis;
using proto::Json;
using rig::AxisMemory;

/// A serial number may have any character; a file name may not.
std::string ForFileName(std::string text) {
  const auto harmless = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-';
  };
  std::ranges::replace_if(text, [&](char c) { return !harmless(c); }, '_');
  return text;
}

Json JsonOf(const AxisMemory& axis) {
  Json json{
      {"position", axis.position.value}, {"inMotion", axis.in_motion}, {"known", axis.known}, {"slack", axis.slack},
      {"travel", axis.travel},           {"doubt", axis.doubt}};
  if (axis.in_motion) {
    json["lowest"] = axis.lowest.value;
    json["highest"] = axis.highest.value;
  }
  return json;
}

AxisMemory AxisMemoryOf(const Json& json) {
  AxisMemory axis;
  axis.position = Native{json.at("position").get<double>()};
  axis.in_motion = json.at("inMotion").get<bool>();
  axis.lowest = axis.in_motion ? Native{json.at("lowest").get<double>()} : axis.position;
  axis.highest = axis.in_motion ? Native{json.at("highest").get<double>()} : axis.position;
  axis.known = json.at("known").get<bool>();
  axis.slack = json.at("slack").get<double>();
  axis.travel = json.at("travel").get<double>();
  axis.doubt = json.at("doubt").get<double>();
  return axis;
}

}  // namespace

PositionStore::PositionStore(const std::string& folder, const std::string& lens, const std::string& serial)
    : lens_(lens),
      serial_(serial),
      path_((std::filesystem::path(folder) /
             (lens + (serial.empty() ? "" : "-" + ForFileName(serial)) + ".position.json"))
                .string()) {}

Result<rig::PositionMemory::Axes> PositionStore::Load() {
  Axes axes;
  std::error_code error;
  if (!std::filesystem::exists(path_, error) && !error) return axes;
  const auto text = io::ReadWholeFile(path_);
  if (!text) return std::unexpected(text.error());
  const auto json = proto::ParseJson(*text);
  if (!json) return Fail(Code::BadData, path_ + ": " + json.error().message);
  try {
    if (json->at("version") != 1) return Fail(Code::BadData, path_ + ": is not version 1");
    if (json->at("serial") != serial_) return axes;
    for (const auto& [name, axis] : json->at("axes").items()) {
      const auto known = drivers::AxisFromName(name);
      if (!known) return Fail(Code::BadData, path_ + ": there is no axis \"" + name + "\"");
      axes[*known] = AxisMemoryOf(axis);
    }
  } catch (const Json::exception&) {
    return Fail(Code::BadData, path_ + ": something is missing or of the wrong type");
  }
  return axes;
}

Result<void> PositionStore::Save(const Axes& axes) {
  Json all = Json::object();
  for (const Axis axis : drivers::kAxes) {
    if (axes[axis]) all[std::string(AxisName(axis))] = JsonOf(*axes[axis]);
  }
  const Json file{{"version", 1}, {"lens", lens_}, {"serial", serial_}, {"axes", std::move(all)}};
  return io::WriteFileAtomically(path_, proto::WriteJson(file) + "\n");
}

}  // namespace lensd::daemon
