// One thread owns the camera's control channel; others hand it tasks with a deadline. It notices loss of control and
// opens the camera again with growing pauses.
#include "control_link.h"

#include <arv.h>

#include <algorithm>
#include <utility>

#include "discovery.h"

namespace lensd::drivers::aravis {
namespace {

constexpr Duration kOpenDeadline = std::chrono::seconds(12);
constexpr Duration kFirstPause = std::chrono::milliseconds(100);
constexpr Duration kLongestPause = std::chrono::seconds(2);
constexpr Duration kCheckEvery = std::chrono::seconds(1);
// Parts of a call's deadline: when it is asked whether the camera is still there, and how often. 0.95 of it in all.
constexpr int kSoon = 4, kHails = 5, kHailEvery = 7;

constexpr Duration kEmission = std::chrono::milliseconds(500);  ///< of a signal: its handlers take microseconds

Instant Now() {
  return std::chrono::steady_clock::now();
}

/// The thread of Aravis' heartbeat refers to the device while it tells that control is lost. Were it the last to do so
/// it would wait for its own end, for which GLib ends the program: so it is let finish.
void LetGo(Handle<ArvCamera> camera) {
  const Handle<ArvDevice> device(ARV_DEVICE(g_object_ref(arv_camera_get_device(camera.get()))));
  camera.reset();
  const Instant deadline = Now() + kEmission;
  while (g_atomic_int_get(&G_OBJECT(device.get())->ref_count) > 1 && Now() < deadline) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

}  // namespace

Result<std::shared_ptr<AravisLink>> AravisLink::Open(const DriverConfig& config, Setup setup) {
  TameGlib();
  std::shared_ptr<AravisLink> link(new AravisLink(config, std::move(setup)));
  std::unique_lock lock(link->mutex_);
  if (!link->answered_.wait_for(lock, kOpenDeadline, [&] { return link->state_.opened.has_value(); })) {
    return Fail(Code::Timeout, "the camera with " + config.Named() + " could not be opened in time");
  }
  link->state_.barrier.Check();
  if (!*link->state_.opened) return PassOn(*link->state_.opened);
  lock.unlock();
  return link;
}

AravisLink::AravisLink(const DriverConfig& config, Setup setup) : config_(config), setup_(std::move(setup)) {
  thread_ = std::jthread([this](const std::stop_token& stop) { Run(stop); });
}

AravisLink::~AravisLink() {
  thread_.request_stop();
  wake_.notify_all();
  thread_.join();
}

void AravisLink::Post(std::function<void(ArvCamera*)> work) {
  Task task;
  task.wanted = [] { return true; };
  task.run = std::move(work);
  Enqueue(std::move(task));
}

std::uint64_t AravisLink::Enqueue(Task task) {
  std::unique_lock lock(mutex_);
  const std::uint64_t generation = interrupts_;
  if (state_.connected && !state_.lost) {
    tasks_.push_back(std::move(task));
    lock.unlock();
    wake_.notify_one();
    return generation;
  }
  lock.unlock();
  task.run(nullptr);  // no camera to ask
  return generation;
}

Result<void> AravisLink::WaitFor(const std::function<bool()>& done, std::uint64_t generation) {
  const Instant deadline = Now() + config_.deadline;
  std::unique_lock lock(mutex_);
  const auto over = [&] { return done() || interrupts_ != generation; };
  const bool gone = !answered_.wait_for(lock, config_.deadline / kSoon, over) && Gone(lock, over);
  const bool in_time = gone || answered_.wait_until(lock, deadline, over);
  if (done()) return {};
  if (gone) {
    state_.lost = true;
    wake_.notify_one();
    return Fail(Code::Disconnected, "the camera with " + config_.Named() + " does not answer any more");
  }
  if (in_time) return Fail(Code::Cancelled, "interrupted");
  return Fail(Code::Timeout, "the camera with " + config_.Named() + " did not answer in time");
}

/// Whether no device is at the camera's address any more: Aravis takes 2.5 s to say so of one register. A camera that
/// is busy with what it was asked may be slow to answer this too, so it has nearly the whole deadline.
bool AravisLink::Gone(std::unique_lock<std::mutex>& lock, const std::function<bool()>& over) {
  if (state_.address.empty()) return false;
  Hail hail(state_.address);
  for (int i = 0; i < kHails; ++i) {
    hail.Send();
    const bool ended = answered_.wait_for(lock, config_.deadline / kHailEvery, over);
    const Presence presence = ended ? Presence::Camera : hail.Wait({});
    if (presence == Presence::Refuses || presence == Presence::Unreachable) return true;
    if (presence != Presence::Silent) return false;
  }
  return true;
}

void AravisLink::Interrupt() {
  const std::lock_guard lock(mutex_);
  ++interrupts_;
  answered_.notify_all();
}

bool AravisLink::connected() const {
  const std::lock_guard lock(mutex_);
  return state_.connected && !state_.lost;
}

void AravisLink::SetHooks(Hooks hooks) {
  const std::lock_guard lock(hooks_mutex_);
  hooks_ = std::move(hooks);
}

/// A camera that does not answer one access, after five tries, answers none.
void AravisLink::Note(const Error& error) {
  if (error.code != Code::Timeout && error.code != Code::Disconnected) return;
  const std::lock_guard lock(mutex_);
  state_.lost = true;
}

/// Disconnected or WrongDevice, and what is known of it.
Error AravisLink::WhyAbsent() const {
  const std::lock_guard lock(mutex_);
  if (!state_.why_not) return {Code::Disconnected, "the camera with " + config_.Named() + " does not answer"};
  const bool wrong = state_.why_not->code == Code::WrongDevice;
  return {wrong ? Code::WrongDevice : Code::Disconnected, state_.why_not->message};
}

// ---- the link's thread --------------------------------------------------------------------------------------------

void AravisLink::Run(const std::stop_token& stop) {
  if (!state_.barrier.Run([&] { OpenAndServe(stop); })) {
    const std::lock_guard lock(mutex_);
    state_.opened = Fail(Code::Internal, "internal error in the driver");
    answered_.notify_all();
  }
  state_.barrier.Run([this] { FailQueue(); });
  state_.barrier.Run([this] { Close(); });
}

void AravisLink::OpenAndServe(const std::stop_token& stop) {
  auto opened = OpenCamera();
  const bool good = opened.has_value();
  {
    const std::lock_guard lock(mutex_);
    state_.connected = good;
    state_.opened = std::move(opened);
  }
  answered_.notify_all();
  if (good) Serve(stop);
}

void AravisLink::Serve(const std::stop_token& stop) {
  Instant next_check = Now() + kCheckEvery;
  while (!stop.stop_requested()) {
    Task task;
    {
      std::unique_lock lock(mutex_);
      wake_.wait_until(lock, stop, next_check, [this] { return !tasks_.empty() || state_.lost; });
      if (!state_.lost && !tasks_.empty()) {
        task = std::move(tasks_.front());
        tasks_.pop_front();
        if (!task.wanted()) task.run = nullptr;
      }
    }
    if (!StillControls()) {
      if (task.run) task.run(nullptr);
      Reopen(stop);
      continue;
    }
    if (task.run) task.run(camera_.handle.get());
    if (Now() < next_check) continue;
    CheckUp();
    next_check = Now() + kCheckEvery;
  }
}

/// Aravis' own heartbeat takes 5 s to give a camera up, and says nothing about one that was restarted meanwhile until
/// then. One register tells: who controls the camera.
Result<void> AravisLink::CheckPrivilege() const {
  constexpr guint64 kControlPrivilege = 0x0a00;
  ArvDevice* device = arv_camera_get_device(camera_.handle.get());
  if (!ARV_IS_GV_DEVICE(device)) return {};
  guint32 privilege = 0;
  CallError error;
  arv_device_read_register(device, kControlPrivilege, &privilege, error.out());
  if (error) return error.Why("asking who controls the camera");
  if (privilege == 0) return Fail(Code::Disconnected, "the camera was restarted");
  return {};
}

/// Aravis repeats a question of which it has heard nothing for 500 ms, and does not report that: after work that took
/// so long the camera may have been restarted.
Result<void> AravisLink::CheckAfter(Instant began) const {
  constexpr Duration kRepeated = std::chrono::milliseconds(250);
  if (Now() < began + kRepeated) return {};
  return CheckPrivilege();
}

void AravisLink::CheckUp() {
  if (const auto ours = CheckPrivilege(); !ours) return Note(ours.error());
  const std::lock_guard lock(hooks_mutex_);
  if (hooks_.every_second) hooks_.every_second(camera_.handle.get());
}

bool AravisLink::StillControls() {
  ArvDevice* device = arv_camera_get_device(camera_.handle.get());
  const bool controls = !ARV_IS_GV_DEVICE(device) || arv_gv_device_is_controller(ARV_GV_DEVICE(device)) != 0;
  const std::lock_guard lock(mutex_);
  if (!controls) state_.lost = true;
  return !state_.lost;
}

/// Answers everybody who waits for a camera that is not there.
void AravisLink::FailQueue() {
  std::deque<Task> tasks;
  {
    const std::lock_guard lock(mutex_);
    state_.connected = false;
    tasks = std::exchange(tasks_, {});
  }
  for (const Task& task : tasks) task.run(nullptr);
}

void AravisLink::Reopen(const std::stop_token& stop) {
  FailQueue();
  {
    const std::lock_guard lock(hooks_mutex_);
    if (hooks_.lost) hooks_.lost();
  }
  Close();
  for (Duration pause = kFirstPause; !stop.stop_requested(); pause = std::min(2 * pause, kLongestPause)) {
    {
      std::unique_lock lock(mutex_);
      wake_.wait_for(lock, stop, pause, [] { return false; });
    }
    if (stop.stop_requested()) return;
    const auto opened = OpenCamera();
    if (opened) break;
    {
      const std::lock_guard lock(mutex_);
      state_.why_not = opened.error();
    }
    Close();
  }
  if (!camera_.handle) return;
  const std::lock_guard hooks(hooks_mutex_);
  if (hooks_.reopened) hooks_.reopened(camera_.handle.get());
  const std::lock_guard lock(mutex_);
  state_.lost = false;
  state_.connected = true;
  state_.why_not.reset();
}

Result<void> AravisLink::OpenCamera() {
  auto opened = OpenConfigured(config_);
  if (!opened) return PassOn(opened);
  camera_.handle = std::move(opened->camera);
  ++camera_.times_opened;
  {
    const std::lock_guard lock(mutex_);
    state_.address = opened->address;
  }
  ArvDevice* device = arv_camera_get_device(camera_.handle.get());
  arv_device_set_range_check_policy(device, ARV_RANGE_CHECK_POLICY_ENABLE);
  arv_device_set_access_check_policy(device, ARV_ACCESS_CHECK_POLICY_ENABLE);
  arv_device_set_register_cache_policy(device, ARV_REGISTER_CACHE_POLICY_DISABLE);
  if (ARV_IS_GV_DEVICE(device) && !arv_gv_device_is_controller(ARV_GV_DEVICE(device))) {
    return Fail(Code::Busy,
                "the camera with " + config_.Named() + " is controlled by another program; close that first");
  }
  // The signal comes from a thread of Aravis', up to 5 s after the camera went.
  const auto lost = +[](ArvDevice*, gpointer link) {
    const std::lock_guard lock(static_cast<AravisLink*>(link)->mutex_);
    static_cast<AravisLink*>(link)->state_.lost = true;
    static_cast<AravisLink*>(link)->wake_.notify_one();
  };
  camera_.lost_handler = g_signal_connect(device, "control-lost", G_CALLBACK(lost), this);
  const auto lens = setup_(camera_.handle.get());
  if (!lens) return PassOn(lens);
  camera_.in_use = std::make_unique<CameraInUse>(opened->place, *lens);
  return {};
}

void AravisLink::Close() {
  if (!camera_.handle) return;
  if (camera_.lost_handler != 0)
    g_signal_handler_disconnect(arv_camera_get_device(camera_.handle.get()), camera_.lost_handler);
  camera_.lost_handler = 0;
  camera_.in_use.reset();
  LetGo(std::move(camera_.handle));
}

}  // namespace lensd::drivers::aravis
