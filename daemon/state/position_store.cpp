// Remembered positions, one small file a lens, written whole at every rest. A file that does not parse, or whose
// checksum does not fit, counts as no memory.
#include "daemon/state/position_store.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <utility>

#include "base/guarded.h"
#include "io/atomic_file.h"
#include "io/checked_file.h"
#include "varlink/json.h"

namespace lensd::daemon {
namespace {

using drivers::Axis;
using rig::AxisMemory;
using varlink::Json;

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
  if (axis.offset != Native{}) json["offset"] = axis.offset.value;
  if (axis.said) json["said"] = true;
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
  axis.offset = Native{json.value("offset", 0.0)};
  axis.said = json.value("said", false);
  return axis;
}

/// One for each file of this process.
std::shared_ptr<std::mutex> PlaceOf(const std::string& path) {
  static std::mutex mutex;
  static std::map<std::string, std::weak_ptr<std::mutex>> places;
  const std::lock_guard lock(mutex);
  std::erase_if(places, [](const auto& place) { return place.second.expired(); });
  auto place = places[path].lock();
  if (!place) places[path] = place = std::make_shared<std::mutex>();
  return place;
}

}  // namespace

PositionStore::PositionStore(const std::string& folder, const std::string& lens, const std::string& serial,
                             std::shared_ptr<StopSignal> stops)
    : lens_(lens),
      serial_(serial),
      path_((std::filesystem::path(folder) /
             (lens + (serial.empty() ? "" : "-" + ForFileName(serial)) + ".position.json"))
                .string()),
      stops_(std::move(stops)),
      place_(PlaceOf(path_)),
      thread_([this] { Write(); }) {}

PositionStore::~PositionStore() {
  stops_->Tell([this] { work_.quit = true; });
}

void PositionStore::Write() {
  for (;;) {
    std::string text;
    std::uint64_t number = 0;
    stops_->Wait([&] {
      if (stops_->severed()) work_.next.reset();  // another store writes this file by now
      if (!work_.next) return work_.quit;
      text = *std::exchange(work_.next, std::nullopt);
      number = work_.asked;
      stops_->SetWriting(true);
      return work_.writing = true;
    });
    if (number == 0) return;
    Result<void> result = Fail(Code::Internal, path_ + ": cannot be written");
    if (auto thrown = Guarded(path_, [&] { result = WriteOne(text); })) {
      result = PassOn(*thrown);
    }
    stops_->Tell([&] {
      work_.writing = false;
      stops_->SetWriting(false);
      work_.written = number;
      work_.result = std::move(result);
    });
  }
}

/// The disk may hang at any point. A writer given up meanwhile has not taken the place, or the one after it waits
/// for it.
Result<void> PositionStore::WriteOne(const std::string& text) {
  auto file = io::WrittenFile::Create(path_, text);
  if (!file) return PassOn(file);
  const std::lock_guard lock(*place_);
  if (stops_->IsSevered()) return Fail(Code::Cancelled, path_ + ": another one writes it by now");
  return file->Replace();
}

Result<rig::PositionMemory::Axes> PositionStore::Load() {
  if (loaded_) return *loaded_;
  auto read = Read();
  if (read) kept_ = *read;
  loaded_ = read ? Result<Axes>(read->axes) : PassOn(read);
  return *loaded_;
}

drivers::PerAxis<std::optional<Native>> PositionStore::left() const {
  drivers::PerAxis<std::optional<Native>> left;
  for (const Axis axis : drivers::kAxes) {
    if (kept_.left[axis] && kept_.axes[axis]) left[axis] = kept_.axes[axis]->position;
  }
  return left;
}

/// Whether a command has left an axis at the position that is to be saved now.
bool PositionStore::LeftBy(const Axes& axes, Axis axis) const {
  const auto &before = kept_.axes[axis], &now = axes[axis];
  if (!before || !now || !now->known) return false;
  const bool still_there = kept_.left[axis] && before->position == now->position;
  if (now->in_motion) return still_there;
  // A rig says that an axis moves only of what it has commanded; but who moved on while no lensd ran is not known.
  if (before->in_motion) return sent_[axis];
  const bool elsewhere = before->offset != now->offset && before->position != now->position;
  if (now->said && (!before->said || !before->known || elsewhere)) return true;  // somebody says so just now
  return still_there;
}

Result<KeptPositions> PositionStore::Read() const {
  const std::lock_guard lock(*place_);
  KeptPositions content;
  const auto kept = io::ReadKeptFile(path_);
  if (!kept) return PassOn(kept);
  const auto& text = *kept;
  if (!text) return content;
  // Only lensd writes it: what is not as it was written tells nothing about where the lens stands.
  if (io::IntegrityOfObject(*text) != io::Integrity::Whole) {
    return Fail(Code::BadData, path_ + ": is not as it was written (its checksum does not fit)");
  }
  const auto json = varlink::ParseJson(*text);
  if (!json) return Fail(Code::BadData, path_ + ": " + json.error().message);
  try {
    if (json->at("version") != 1) return Fail(Code::BadData, path_ + ": is not version 1");
    if (json->at("serial") != serial_) return content;
    for (const auto& [name, axis] : json->at("axes").get_ref<const Json::object_t&>()) {
      const auto known = drivers::AxisFromName(name);
      if (!known) return Fail(Code::BadData, path_ + ": there is no axis \"" + name + "\"");
      content.axes[*known] = AxisMemoryOf(axis);
      content.left[*known] = axis.value("left", false);
    }
  } catch (const Json::exception&) {
    return Fail(Code::BadData, path_ + ": something is missing or of the wrong type");
  }
  return content;
}

Result<void> PositionStore::Save(const Axes& axes) {
  loaded_.reset();
  Json all = Json::object();
  KeptPositions next{.axes = axes, .left = {}};
  for (const Axis axis : drivers::kAxes) {
    if (!axes[axis]) continue;
    next.left[axis] = LeftBy(axes, axis);
    Json& json = all[std::string(AxisName(axis))] = JsonOf(*axes[axis]);
    if (next.left[axis]) json["left"] = true;
  }
  const Json file{{"version", 1}, {"lens", lens_}, {"serial", serial_}, {"axes", std::move(all)}};
  const std::string text = io::SignedObject(varlink::WriteJson(file) + "\n");
  std::uint64_t number = 0;
  stops_->Tell([&] {
    work_.next = text;
    number = ++work_.asked;
  });
  Result<void> result;
  const bool written = stops_->WaitUnlessRaised([&] {
    if (work_.written < number) return false;
    result = work_.result;
    return true;
  });
  if (written) {
    if (!result) return result;
    saved_ = text;
    kept_ = next;
    for (const Axis axis : drivers::kAxes) sent_[axis] = axes[axis] && axes[axis]->in_motion;
    return result;
  }
  // What the caller believes to be on disk has to be there, or come back.
  stops_->Tell([&] {
    work_.next.reset();
    if (!work_.writing || saved_.empty()) return;
    work_.next = saved_;
    ++work_.asked;
  });
  return Fail(Code::Cancelled, "a stop came before it was on disk");
}

}  // namespace lensd::daemon
