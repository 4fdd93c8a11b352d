// One search for everybody, and opening without the lock of Aravis' list.
#include "camera_search.h"

#include <arv.h>

#include <algorithm>
#include <condition_variable>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <utility>

#include "description_check.h"
#include "discovery.h"
#include "gobject_handles.h"
#include "packed_file.h"
#include "trial.h"

namespace lensd::drivers::aravis {
namespace {

constexpr Duration kSearchDeadline = std::chrono::seconds(8);
constexpr Duration kTurnDeadline = std::chrono::seconds(3);

std::vector<ListedCamera> ListNow() {
  arv_update_device_list();
  std::vector<ListedCamera> cameras;
  for (unsigned int i = 0; i < arv_get_n_devices(); ++i) {
    cameras.push_back({.id = Text(arv_get_device_id(i)),
                       .physical_id = Text(arv_get_device_physical_id(i)),
                       .protocol = Text(arv_get_device_protocol(i)),
                       .address = Text(arv_get_device_address(i)),
                       .vendor = Text(arv_get_device_vendor(i)),
                       .model = Text(arv_get_device_model(i)),
                       .serial = Text(arv_get_device_serial_nbr(i))});
  }
  return cameras;
}

/// What is under way for all who want it. Aravis' list is one a process, and each search frees the words of the last.
class SharedSearch {
 public:
  Result<std::vector<ListedCamera>> Search() {
    std::unique_lock lock(mutex_);
    if (running_) {
      const auto joined = begun_;
      const auto over = [&] { return !running_ || begun_ != joined; };
      if (ended_.wait_for(lock, kSearchDeadline, over)) return found_;
      return Fail(Code::Timeout, "the search for cameras does not end");
    }
    running_ = true;
    ++begun_;
    lock.unlock();
    auto found = ListNow();
    lock.lock();
    running_ = false;
    found_ = found;
    ended_.notify_all();
    return found;
  }

 private:
  std::mutex mutex_;
  std::condition_variable ended_;
  bool running_ = false;             // guarded by mutex_, as all below
  std::uint64_t begun_ = 0;          ///< searches
  std::vector<ListedCamera> found_;  ///< by the last that ended
};

SharedSearch& TheSearch() {
  static SharedSearch search;
  return search;
}

/// Addresses that somebody in this process opens a camera at; twice where that took too long.
struct Turns {
  std::mutex mutex;
  std::condition_variable ended;
  std::multiset<std::string> taken;
};

Turns& TheTurns() {
  static Turns turns;
  return turns;
}

/// What this process has connected, by place, and whether it moves a lens. Twice where one link of a camera has not
/// ended yet as the next begins.
struct CamerasInUse {
  std::mutex mutex;
  std::multimap<std::string, bool> by_place;
};

CamerasInUse& InUse() {
  static CamerasInUse cameras;
  return cameras;
}

std::string PlaceOf(const ListedCamera& listed) {
  return listed.protocol == "GigEVision" ? listed.address : listed.id;
}

/// Aravis 0.8 parses every description into one and the same variable of its own.
std::mutex& OneDescriptionAtATime() {
  static std::mutex mutex;
  return mutex;
}

/// " (Local:camera.xml;8000;1a2b)", for messages; empty: nobody knows it.
std::string Shown(std::string file) {
  constexpr std::size_t kMostShown = 80;
  if (file.empty()) return "";
  if (file.size() > kMostShown) file.replace(kMostShown, std::string::npos, "...");
  std::ranges::replace_if(file, [](char c) { return c < ' ' || c > '~'; }, '?');
  return " (" + file + ")";
}

std::unexpected<Error> NotUsed(const std::string& named, const std::string& file, const Error& why) {
  return Fail(Code::Unsupported,
              "the camera with " + named + " is not used: its GenICam file" + Shown(file) + " " + why.message);
}

/// What can be told of the file before Aravis fetches and unpacks it. Returns the place of the file.
Result<std::string> CheckFile(const Route& route, const std::string& named) {
  const auto places = AskForFile(route);
  if (!places) return Fail(places.error().code, "no camera with " + named + ": " + places.error().message);
  for (const std::string& place : *places) {
    if (!IsPacked(place)) continue;
    const auto bytes = FetchFile(route, place);
    if (!bytes) return Fail(bytes.error().code, "no camera with " + named + ": " + bytes.error().message);
    if (const auto checked = CheckPackedFile(*bytes); !checked) return NotUsed(named, place, checked.error());
  }
  return places->front();
}

/// The camera of a device just opened. Opening a device evaluates no node of its description, making the camera does.
Result<OpenedCamera> CameraOf(ArvDevice* device, const std::string& named, const std::string& file) {
  std::size_t size = 0;
  const char* text = arv_device_get_genicam_xml(device, &size);
  if (const auto checked = CheckDescription({text, text == nullptr ? 0 : size}); !checked) {
    return NotUsed(named, file, checked.error());
  }
  CallError error;
  OpenedCamera opened;
  opened.camera.reset(arv_camera_new_with_device(device, error.out()));
  if (error) return error.Why("opening the camera with " + named);
  if (!opened.camera) return Fail(Code::Disconnected, "the camera with " + named + " cannot be opened");
  return opened;
}

/// By its addresses, with no list in between: that lock is not held.
Result<OpenedCamera> OpenAt(const std::string& host, const std::string& named) {
  const auto route = AskCamera(host);
  if (!route) return Fail(route.error().code, "no camera with " + named + ": " + route.error().message);
  const auto file = CheckFile(*route, named);
  if (!file) return PassOn(file);
  auto turn = std::make_unique<CameraTurn>(route->camera);
  CallError error;
  const Handle<GInetAddress> here(g_inet_address_new_from_string(route->here.c_str()));
  const Handle<GInetAddress> there(g_inet_address_new_from_string(route->camera.c_str()));
  std::unique_lock lock(OneDescriptionAtATime());
  const Handle<ArvDevice> device(arv_gv_device_new(here.get(), there.get(), error.out()));
  lock.unlock();
  if (error) return error.Why("opening the camera with " + named);
  if (!device) return Fail(Code::Disconnected, "the camera with " + named + " cannot be opened");
  auto opened = CameraOf(device.get(), named, *file);
  if (!opened) return opened;
  opened->address = opened->place = route->camera;
  opened->turn = std::move(turn);
  return opened;
}

bool IsMeant(const ListedCamera& listed, const DriverConfig& config) {
  if (!config.serial.empty()) return listed.serial == config.serial;
  return listed.id == config.id || listed.physical_id == config.id || listed.vendor + "-" + listed.serial == config.id;
}

Result<OpenedCamera> OpenNamed(const ListedCamera& listed, const std::string& named) {
  if (listed.protocol == "GigEVision") return OpenAt(listed.address, named);
  if (const auto tried = TryUsbCameraFirst(listed.id); !tried) {
    return Fail(tried.error().code, "the camera with " + named +
                                        " is not used: lensd opens a camera on USB in a process of its own first, and "
                                        "the process that tried it " +
                                        tried.error().message);
  }
  CallError error;
  std::unique_lock lock(OneDescriptionAtATime());
  const Handle<ArvDevice> device(arv_open_device(listed.id.c_str(), error.out()));
  lock.unlock();
  if (error) return error.Why("opening the camera with " + named);
  if (!device) return Fail(Code::Disconnected, "the camera with " + named + " cannot be opened");
  auto opened = CameraOf(device.get(), named, "");
  if (opened) opened->place = listed.id;
  return opened;
}

}  // namespace

CameraTurn::CameraTurn(std::string address) : address_(std::move(address)) {
  Turns& turns = TheTurns();
  std::unique_lock lock(turns.mutex);
  turns.ended.wait_for(lock, kTurnDeadline, [&] { return !turns.taken.contains(address_); });
  turns.taken.insert(address_);
}

CameraTurn::~CameraTurn() {
  Turns& turns = TheTurns();
  const std::lock_guard lock(turns.mutex);
  turns.taken.erase(turns.taken.find(address_));
  turns.ended.notify_all();
}

CameraInUse::CameraInUse(std::string place, bool lens) : place_(std::move(place)) {
  CamerasInUse& cameras = InUse();
  const std::lock_guard lock(cameras.mutex);
  cameras.by_place.emplace(place_, lens);
}

CameraInUse::~CameraInUse() {
  CamerasInUse& cameras = InUse();
  const std::lock_guard lock(cameras.mutex);
  cameras.by_place.erase(cameras.by_place.find(place_));
}

std::optional<bool> LensOfCameraInUse(const ListedCamera& listed) {
  const CameraTurn nobody_opens_it(listed.address);
  CamerasInUse& cameras = InUse();
  const std::lock_guard lock(cameras.mutex);
  const auto found = cameras.by_place.find(PlaceOf(listed));
  return found == cameras.by_place.end() ? std::nullopt : std::optional(found->second);
}

Result<std::vector<ListedCamera>> SearchCameras() {
  return TheSearch().Search();
}

Result<OpenedCamera> OpenListed(const ListedCamera& listed) {
  return OpenNamed(listed, "id \"" + listed.id + "\"");
}

Result<OpenedCamera> OpenConfigured(const DriverConfig& config) {
  if (!config.address.empty()) return OpenAt(config.address, config.Named());
  const auto cameras = SearchCameras();
  if (!cameras) return PassOn(cameras);
  const auto found = std::ranges::find_if(*cameras, [&](const ListedCamera& one) { return IsMeant(one, config); });
  if (found != cameras->end()) return OpenNamed(*found, config.Named());
  return Fail(Code::Disconnected, "there is no camera with " + config.Named() +
                                      "; is it connected and powered? arv-tool-0.8 lists what is");
}

}  // namespace lensd::drivers::aravis
