// A GigE Vision camera on this machine's network: the protocol is Aravis' fake camera, registers and pictures are the
// simulator's. It shares no code with the driver.
#include "sim/devices/gige_camera.h"

#include <arpa/inet.h>
#include <arv.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <condition_variable>
#include <cstring>
#include <fstream>
#include <mutex>
#include <thread>
#include <utility>

#include "axis_registers.h"
#include "drivers/api/device.h"
#include "genicam_text.h"
#include "picture_packing.h"
#include "sim/scene.h"
#include "sim/world.h"

namespace lensd::sim {
namespace {

using drivers::Axis;
using namespace std::chrono_literals;

constexpr Duration kTick = 500us;
constexpr Duration kClockLead = 10000s;  ///< the camera's clock is that much ahead of the host's
constexpr Duration kFrameWait = 40ms;    ///< how long the stream waits for a picture not sent yet
constexpr std::uint32_t kStatusNotInitialized = 1, kStatusBusy = 3, kStatusReady = 4, kStatusError = 5;

/// Owns a GObject.
struct Unref {
  void operator()(void* object) const { g_object_unref(object); }
};

/// Aravis lets two cameras share a port, and then neither works.
Result<void> CheckAddress(const std::string& address) {
  sockaddr_in where{};
  where.sin_family = AF_INET;
  where.sin_port = htons(3956);
  if (inet_pton(AF_INET, address.c_str(), &where.sin_addr) != 1) {
    return Fail(Code::InvalidArgument, "\"" + address + "\" is not an IPv4 address");
  }
  const int probe = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const int bound = bind(probe, reinterpret_cast<const sockaddr*>(&where), sizeof where);
  const int error = errno;
  close(probe);
  if (bound == 0) return {};
  if (error == EADDRINUSE) return Fail(Code::Busy, address + " port 3956 has a camera already");
  return Fail(Code::InvalidArgument, "cannot be a camera at " + address + ": " + std::strerror(error));
}

}  // namespace

struct GigeCamera::Body {
  GigeOptions options;
  std::shared_ptr<const Scene> scene;
  World world;
  std::string description;
  std::unique_ptr<ArvGvFakeCamera, Unref> server;
  ArvFakeCamera* memory = nullptr;
  std::vector<AxisRegisters> axes;
  bool initialized = true;
  std::optional<Instant> moving_since;  // the lens' thread
  std::atomic<bool> frozen = false;

  std::mutex mutex;
  std::condition_variable new_frame;
  std::optional<double> placed;         // guarded by mutex: where something else turns the focus
  std::optional<drivers::Frame> frame;  // guarded by mutex
  std::uint64_t frames_taken = 0;       // guarded by mutex
  std::uint64_t frames_sent = 0;        // the server's thread
  std::jthread lens_thread;
  std::jthread eye_thread;

  ~Body();
  Result<void> Describe();
  Result<void> Serve();
  std::uint32_t Read(unsigned address) const;
  void Write(unsigned address, std::uint32_t value) { arv_fake_camera_write_register(memory, address, value); }
  void SetRegisters();
  void TickLens();
  void LatchClock();
  std::uint32_t StatusOf(const drivers::LensState& state);
  void ShowPlace(const AxisRegisters& axis, const drivers::AxisState& state);
  void Obey(AxisRegisters& axis, bool stopped_after);
  void RunEye(const std::stop_token& stop);
  void Fill(ArvBuffer* buffer, std::uint32_t gain_db, std::uint32_t format);
};

GigeCamera::Body::~Body() {
  lens_thread = {};
  eye_thread = {};
  server.reset();
}

std::uint32_t GigeCamera::Body::Read(unsigned address) const {
  guint32 value = 0;
  arv_fake_camera_read_register(memory, address, &value);
  return value;
}

Result<void> GigeCamera::Body::Describe() {
  const LensSettings& lens = scene->lens;
  const drivers::Capabilities& can = world.device.lens->capabilities();
  GenicamOptions text;
  text.names = options.names;
  text.width = scene->camera.width;
  text.height = scene->camera.height;
  text.focus = {.minimum = 0.0, .maximum = lens.steps - 1.0};
  if (lens.liquid) {
    const double sensor_m = 1e-3 * lens.min_focal_length_mm;
    const double low_d = 1.0 / (sensor_m - 1e-3 * lens.min_extension_mm);
    const double high_d = 1.0 / (sensor_m - 1e-3 * lens.max_extension_mm);
    text.focus_is_power = true;
    text.focus = {low_d, high_d, (high_d - low_d) / (lens.steps - 1.0), low_d, 0.0};
  }
  const auto add = [&](Axis axis, unsigned target, unsigned place, auto native, auto count, double grid = 1.0) {
    axes.push_back({axis, target, place, native, count, grid, 0, {}, {}});
  };
  const auto focus_count = options.focus_zero == GigeFocusZero::Near && !lens.liquid ? FromNear : Same;
  add(Axis::Focus, registers::kFocusTarget, registers::kFocusPlace, focus_count, focus_count);
  const bool optical = options.names == "sfnc" || options.names == "sfnc-abort" || options.names == "allied-vision";
  if (can.axes[Axis::Iris]) {
    // Twice the coarsest half step of the blades: what is asked for is reached within it.
    const double step = std::max(0.01, std::ceil(lens.max_f_number * IrisSpan(lens) * 100.0) / 100.0);
    text.iris = optical ? LensAxisText{lens.min_f_number, lens.max_f_number, kPerFNumber, 0.0, step}
                        : LensAxisText{0.0, lens.iris_steps - 1.0, 1.0, 0.0, 0.0};
    add(Axis::Iris, registers::kIrisTarget, registers::kIrisPlace, optical ? IrisNative : Same,
        optical ? IrisCount : Same, optical ? step / kPerFNumber : 1.0);
  }
  if (can.axes[Axis::Zoom] && options.names == "sfnc") {
    text.zoom = LensAxisText{lens.min_focal_length_mm, lens.max_focal_length_mm, kPerMillimetre, 0.0,
                             can.axes[Axis::Zoom]->resolution};
    add(Axis::Zoom, registers::kZoomTarget, registers::kZoomPlace, ZoomNative, ZoomCount);
  }
  description = GenicamText(text);
  if (options.edit_description) description = options.edit_description(std::move(description));
  if (options.names == "none") axes.clear();
  if (!description.empty()) return {};
  return Fail(
      Code::InvalidArgument,
      "names are sfnc, sfnc-abort, basler, allied-vision, imaging-source or none, not \"" + options.names + "\"");
}

Result<void> GigeCamera::Body::Serve() {
  char name[] = "/tmp/lensd-gige-XXXXXX";
  const int file = mkstemp(name);
  if (file < 0) return Fail(Code::Io, std::string("no room for a file in /tmp: ") + std::strerror(errno));
  close(file);
  std::ofstream(name) << description;
  server.reset(arv_gv_fake_camera_new_full(options.interface.c_str(), options.serial.c_str(), name));
  unlink(name);
  if (!server || !arv_gv_fake_camera_is_running(server.get())) {
    return Fail(Code::Io, "cannot serve a camera at " + options.interface);
  }
  memory = arv_gv_fake_camera_get_fake_camera(server.get());
  SetRegisters();
  const auto fill = +[](ArvBuffer* buffer, void* body, guint32, guint32 gain, ArvPixelFormat format) {
    static_cast<Body*>(body)->Fill(buffer, gain, format);
  };
  arv_fake_camera_set_fill_pattern(memory, fill, this);
  lens_thread = std::jthread([this](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      TickLens();
      std::this_thread::sleep_for(kTick);
    }
  });
  eye_thread = std::jthread([this](const std::stop_token& stop) { RunEye(stop); });
  return {};
}

void GigeCamera::Body::SetRegisters() {
  const CameraSettings& camera = scene->camera;
  Write(0x118, static_cast<std::uint32_t>(camera.height));
  Write(0x11c, static_cast<std::uint32_t>(camera.width));
  Write(0x100, static_cast<std::uint32_t>(camera.width));
  Write(0x104, static_cast<std::uint32_t>(camera.height));
  const std::pair<int, std::uint32_t> formats[] = {
      {8, 0x01080001}, {10, 0x01100003}, {12, 0x01100005}, {16, 0x01100007}};
  for (const auto& [bits, code] : formats) {
    if (bits == camera.bits) Write(0x128, code);
  }
  Write(0x138, static_cast<std::uint32_t>(std::lround(1e6 / camera.frame_rate_hz)));
  Write(0x120, static_cast<std::uint32_t>(std::lround(camera.exposure_ms * 1e3)));
  Write(registers::kPixelPitch, static_cast<std::uint32_t>(std::lround(camera.pixel_um * 1e3)));
  Write(registers::kTemperature, static_cast<std::uint32_t>(std::lround(scene->lens.temperature_c * 100.0)));
  for (AxisRegisters& axis : axes) {
    axis.last_target = registers::kToggle;
    Write(axis.target, axis.last_target);
  }
  initialized = !options.needs_initialize;
  TickLens();
}

/// Carries out what was written since the last look, in the order it was written as far as a command tells.
void GigeCamera::Body::TickLens() {
  LatchClock();
  const std::uint32_t abort = Read(registers::kAbort), initialize = Read(registers::kInitialize);
  if (abort != 0) Write(registers::kAbort, 0);
  if (initialize != 0) Write(registers::kInitialize, 0);
  if (Read(registers::kDisconnect) != 0) {
    Write(registers::kDisconnect, 0);
    initialized = false;
  }
  drivers::Lens& lens = *world.device.lens;
  std::optional<double> elsewhere;
  {
    const std::lock_guard lock(mutex);
    elsewhere = std::exchange(placed, std::nullopt);
  }
  if (elsewhere) (void)lens.StartMove(Axis::Focus, Native{std::clamp(*elsewhere, 0.0, scene->lens.steps - 1.0)});
  for (AxisRegisters& axis : axes) {
    const std::uint32_t bit = 2u << static_cast<unsigned>(axis.axis);
    const bool toggled_now = (Read(axis.target) & registers::kToggle) != 0;
    // The command knew the newest target: it came after it.
    const bool abort_is_newer = abort != 0 && ((abort & bit) != 0) == toggled_now;
    const bool initialize_is_newer = initialize != 0 && ((initialize & bit) != 0) == toggled_now;
    if (abort != 0 && !abort_is_newer) (void)lens.Stop(axis.axis);
    Obey(axis, abort_is_newer || initialize_is_newer);
    if (abort_is_newer) (void)lens.Stop(axis.axis);
    if (initialize != 0 && axis.axis == Axis::Focus) (void)lens.StartHome(axis.axis);
    if (abort != 0 || initialize != 0) axis.told.reset();
  }
  if (initialize != 0) initialized = true;
  const auto state = lens.Read();
  if (!state || frozen) return;
  Write(registers::kStatus, StatusOf(*state));
  for (const AxisRegisters& axis : axes) ShowPlace(axis, *state->axes[axis.axis]);
}

void GigeCamera::Body::ShowPlace(const AxisRegisters& axis, const drivers::AxisState& state) {
  if (options.position == GigePosition::Echo && axis.told) return Write(axis.place, *axis.told);
  if (options.position == GigePosition::AtEnd && state.moving) return;
  const Duration since = std::chrono::steady_clock::now() - axis.told_at;
  if (axis.told && since < options.echo) return Write(axis.place, *axis.told);
  if (axis.told && since < options.stale) return;
  const double exact = axis.count(scene->lens, state.position.value);
  const double least = axis.count(scene->lens, 0.0);
  const double count = least + std::round((exact - least) / axis.grid) * axis.grid;
  Write(axis.place, static_cast<std::uint32_t>(std::lround(std::max(count, 0.0))));
}

void GigeCamera::Body::Obey(AxisRegisters& axis, bool overruled) {
  const std::uint32_t target = Read(axis.target);
  if (std::exchange(axis.last_target, target) == target || overruled || !initialized) return;
  const drivers::AxisCapabilities& can = *world.device.lens->capabilities().axes[axis.axis];
  axis.told = (target & ~registers::kToggle) - 1u;
  axis.told_at = std::chrono::steady_clock::now();
  const double native = axis.native(scene->lens, *axis.told);
  (void)world.device.lens->StartMove(axis.axis, Native{std::clamp(native, can.minimum.value, can.maximum.value)});
}

std::uint32_t GigeCamera::Body::StatusOf(const drivers::LensState& state) {
  if (!initialized) return kStatusNotInitialized;
  bool moving = false, bad = false;
  for (const AxisRegisters& axis : axes) {
    moving = moving || state.axes[axis.axis]->moving;
    bad = bad || !state.axes[axis.axis]->fault.empty();
  }
  const Instant now = std::chrono::steady_clock::now();
  if (!moving) moving_since.reset();
  if (moving && !moving_since) moving_since = now;
  const bool shows = moving && now - *moving_since >= options.busy_late;
  return shows ? kStatusBusy : bad ? kStatusError : kStatusReady;
}

void GigeCamera::Body::LatchClock() {
  if (Read(registers::kTimestampControl) == 0) return;
  const Duration now = std::chrono::steady_clock::now().time_since_epoch() + kClockLead;
  const std::uint64_t big_endian = GUINT64_TO_BE(static_cast<std::uint64_t>(now.count()));
  arv_fake_camera_write_memory(memory, registers::kTimestampHigh, sizeof big_endian, &big_endian);
  Write(registers::kTimestampControl, 0);
}

/// Takes pictures while a client streams.
void GigeCamera::Body::RunEye(const std::stop_token& stop) {
  drivers::Camera& camera = *world.device.camera;
  std::uint32_t exposure_us = Read(0x120);
  bool streaming = false;
  while (!stop.stop_requested()) {
    // The status is read first: what a client wrote before it started the stream holds from the first picture on.
    const bool wanted = arv_fake_camera_get_acquisition_status(memory) != 0;
    if (const std::uint32_t now_us = Read(0x120); std::exchange(exposure_us, now_us) != now_us) {
      (void)camera.SetExposure(std::chrono::microseconds(now_us));
    }
    if (wanted != streaming) {
      (void)(wanted ? camera.Start() : camera.Stop());
      streaming = wanted;
    }
    if (streaming) {
      auto polled = camera.Poll();
      if (polled && *polled) {
        {
          const std::lock_guard lock(mutex);
          frame = *std::move(polled);
          ++frames_taken;
        }
        new_frame.notify_one();
      }
    }
    std::this_thread::sleep_for(kTick);
  }
}

/// On the server's thread: it answers no register meanwhile, so it does not wait long.
void GigeCamera::Body::Fill(ArvBuffer* buffer, std::uint32_t gain_db, std::uint32_t format) {
  drivers::Frame picture;
  {
    std::unique_lock lock(mutex);
    new_frame.wait_for(lock, kFrameWait, [this] { return frames_taken != frames_sent; });
    // Aravis sends what it has whether there is a picture or not: before the first one its packets go nowhere.
    g_object_set(server.get(), "gvsp-lost-ratio", frame ? options.lost_packets : 1.0, nullptr);
    if (!frame) return;
    picture = *frame;
    frames_sent = frames_taken;
  }
  const std::size_t width = Read(0x100), height = Read(0x104), left = Read(0x130), top = Read(0x134);
  const double gain = std::pow(10.0, gain_db / 20.0);
  const double full = std::ldexp(1.0, picture.bits) - 1.0;
  std::vector<std::uint16_t> samples(width * height);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const std::size_t x = left + i % width, y = top + i / width;
    if (x >= static_cast<std::size_t>(picture.width) || y >= static_cast<std::size_t>(picture.height)) continue;
    const double sample = (*picture.samples)[y * static_cast<std::size_t>(picture.width) + x];
    samples[i] = static_cast<std::uint16_t>(gain_db == 0 ? sample : std::min(full, std::round(sample * gain)));
  }
  const std::vector<std::uint8_t> bytes = Pack(samples, picture.bits, format);
  std::size_t unused = 0;
  auto* data = static_cast<std::uint8_t*>(const_cast<void*>(arv_buffer_get_data(buffer, &unused)));
  std::ranges::copy(bytes.begin(),
                    bytes.begin() + static_cast<std::ptrdiff_t>(width * height * BitsPerPixel(format) / 8), data);
  const Duration stamp = picture.exposure_start.time_since_epoch() + kClockLead;
  arv_buffer_set_timestamp(buffer, static_cast<guint64>(stamp.count()));
}

Result<std::unique_ptr<GigeCamera>> GigeCamera::Start(const GigeOptions& options, const Clock& clock) {
  if (auto free = CheckAddress(options.interface); !free) return PassOn(free);
  if (options.serial.empty() || options.serial.size() > 15) {
    return Fail(Code::InvalidArgument, "a serial number has 1 to 15 characters");
  }
  if (!(options.lost_packets >= 0.0 && options.lost_packets <= 1.0)) {
    return Fail(Code::InvalidArgument, "the part of lost packets is between 0 and 1");
  }
  auto scene = LoadScene(options.scene);
  if (!scene) return PassOn(scene);
  auto body = std::make_unique<Body>();
  body->options = options;
  body->scene = std::make_shared<const Scene>(std::move(*scene));
  WorldOptions world_options;
  world_options.seed = options.seed;
  auto world = OpenWorld(body->scene, clock, world_options);
  if (!world) return PassOn(world);
  body->world = std::move(*world);
  if (auto described = body->Describe(); !described) return PassOn(described);
  if (auto served = body->Serve(); !served) return PassOn(served);
  return std::unique_ptr<GigeCamera>(new GigeCamera(std::move(body)));
}

GigeCamera::GigeCamera(std::unique_ptr<Body> body) : body_(std::move(body)) {}
GigeCamera::~GigeCamera() = default;

void GigeCamera::PlaceFocus(double steps) {
  const std::lock_guard lock(body_->mutex);
  body_->placed = steps;
}

void GigeCamera::Freeze(bool frozen) {
  body_->frozen = frozen;
}

double GigeCamera::TrueFocus() const {
  return body_->world.truth->Now().focus_steps;
}

const std::string& GigeCamera::description() const {
  return body_->description;
}

}  // namespace lensd::sim
