// One lens with its optional camera: a state machine that turns commands into device calls and ends each with the
// truth. It owns no thread: its driver calls Step() again and again, a daemon's worker or a bench on a stepped
// clock.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "autofocus/method.h"
#include "autofocus/regions.h"
#include "base/clock.h"
#include "base/result.h"
#include "base/units.h"
#include "drivers/api/camera.h"
#include "drivers/api/device.h"
#include "drivers/api/lens.h"
#include "rig/calibration.h"
#include "rig/config.h"
#include "rig/direction.h"
#include "rig/focus_map.h"
#include "rig/learned_lag.h"
#include "rig/learned_slope.h"
#include "rig/left_out_frame.h"
#include "rig/motion.h"
#include "rig/optics_table.h"
#include "rig/position_memory.h"
#include "rig/search_conditions.h"

namespace lensd::rig {

/// A frame with the lens state in force during its exposure.
struct LensedFrame {
  /// One axis from exposure start to end: between `lowest` and `highest`, as far as polling saw it.
  struct AxisDuring {
    Native lowest;
    Native highest;
    bool moving = false;    ///< it moved, or had not settled, at some time of the exposure
    Native bound = {};      ///< the true position was within this of the middle of the two, if it was not moving
    Native mid = {};        ///< at mid-exposure, between the readings before and after it
    Native mid_bound = {};  ///< the true position was within this of `mid` then, moving or not
  };
  drivers::Frame frame;
  drivers::PerAxis<std::optional<AxisDuring>> axes;
  std::optional<Metres> extension;  ///< middle of the focus interval, where optics are known
  std::optional<Metres> extension_bound = {};
  std::optional<FNumber> f_number;
  std::optional<FNumber> f_number_bound = {};  ///< 0 where the f-number is fixed
};

constexpr std::size_t kMostSamples = 1000;  ///< that are told of one autofocus

/// A frame of an autofocus, as one of its regions saw it.
struct AutofocusSample {
  enum class State {
    Standing,     ///< the lens stood, its backlash taken up
    Moving,       ///< it moved meanwhile
    BacklashOpen  ///< it stood, but came against its approach direction
  };
  int frame = 0;   ///< of the run, from 0
  int region = 0;  ///< index of the request's region
  State state = State::Standing;
  Native position;                   ///< of the mechanism at mid-exposure
  Native bound;                      ///< it was within this of that
  std::optional<Dioptres> vergence;  ///< there, where optics are known
  double score = 0.0;                ///< sharpness, as of autofocus::RegionSample
  double score_sigma = 0.0;
  Instant exposure_start{};
  Instant exposure_end{};
};

/// Where an autofocus whose frames come from outside wants the next one.
struct FrameWanted {
  int number = 1;                   ///< of the frame in this run
  int frames_expected = 0;          ///< in all, as far as can be told
  Native position;                  ///< where the lens stands
  std::optional<Metres> extension;  ///< there, where optics are known
  std::optional<Dioptres> vergence;
  Instant since{};                         ///< exposures that begin now or later will do
  std::vector<AutofocusSample> samples{};  ///< the curve so far
};
using WantedCallback = std::function<void(const FrameWanted&)>;

/// A camera that a client drives.
struct OutsideCamera {
  double pixel_um = 0.0;            ///< pitch of its pixels; 0: not known, so only search methods work
  bool scores_only = false;         ///< it sends no pictures but their sharpness
  std::optional<int> lag_frames{};  ///< by which its pictures are late; nothing: as learned, or not known
  WantedCallback wanted;            ///< called from Step() when the lens stands where the next frame is wanted
};

/// Whose frames will do: those of a lens at rest, or of one that may still move.
enum class LensMotion { Standing, Any };

/// An observer of what the rig does.
struct FrameViewer {
  LensMotion lens = LensMotion::Any;  ///< whether frames of a moving lens are shown
  Duration period{};                  ///< at least this from one frame shown to the next; 0: every frame
  /// Called from Step() for every frame, and for the error that ends the view: the lens or the camera does not answer,
  /// or the rig is no more (then from its destructor). False: no more. It must not give the rig commands.
  std::function<bool(const Result<LensedFrame>&)> show;
};

/// How sharp a frame is by a client's own measure.
struct OutsideScore {
  double sharpness = 0.0;  ///< > 0, any unit, rises with focus
  double sigma = 0.0;      ///< > 0: its standard deviation from frame to frame
  Instant exposure_start{};
  Instant exposure_end{};
};

struct AutofocusOutcome;

/// How far apart the frames of a search's first pass may be.
struct SearchStep {
  enum class Kind {
    Native,     ///< native units
    Extension,  ///< metres of extension
    Blur        ///< px of blur diameter
  };
  Kind kind = Kind::Native;
  double value = 0.0;  ///< > 0
};

/// Where frames are taken: between these two places of focus, in either order, ends included.
struct SearchRange {
  Target from;
  Target to;
};

struct AutofocusRequest {
  std::vector<drivers::Region> regions{};                 ///< default: the camera's own
  autofocus::Policy policy = autofocus::Policy::Nearest;  ///< which of several regions gives the answer
  std::string method = "auto";                            ///< a name of autofocus::MethodNames()
  /// For the search, from its start; going back adds a move. Nothing: as long as a search of the whole range takes, by
  /// the camera's frame rate and the lens' speed, and at least 20 s; with an OutsideCamera by how often its frames
  /// come, at least a minute and at most an hour.
  std::optional<Duration> deadline{};
  std::optional<SearchRange> range{};       ///< default: all of the travel
  std::optional<SearchStep> step{};         ///< default: what the optics call for
  std::optional<autofocus::MapGrid> map{};  ///< best focus all over the frame, instead of one answer by a method
  /// Goes on after each answer or refusal, which it is told of, and holds focus on the one region until it is stopped,
  /// superseded or fails: only then the run ends. The deadline is one for each search.
  std::function<void(const AutofocusOutcome&)> track{};
  KnownSlopes slopes{};                          ///< of this lens, as earlier runs have shown it; null: as told
  std::shared_ptr<LearnedLag> lags{};            ///< of the cameras, for this run and later ones; null: the rig's own
  std::optional<SearchConditions> conditions{};  ///< of the search alone; not with `track` or `outside`
  std::optional<OutsideCamera> outside{};  ///< instead of the lens's own camera; `regions` are of its frames then,
                                           ///< all of them by default
};

/// What an autofocus came to focus on.
struct AutofocusSubject {
  int region = 0;  ///< index of the request's region
  autofocus::FoundBy by = autofocus::FoundBy::Sharpness;
  Native position;                   ///< where all frames together place the focus: the lens stands near it
  std::optional<Dioptres> vergence;  ///< there, where optics are known
  std::optional<Dioptres> sigma;     ///< of that
};

/// How far an autofocus run has come.
struct AutofocusProgress {
  int frames = 0;                          ///< used so far
  int moves = 0;                           ///< motions of the focus motor so far
  int frames_expected = 0;                 ///< in all, as far as can be told
  Native position;                         ///< of the last frame
  double sharpness = 0.0;                  ///< of the last frame relative to the first
  std::vector<AutofocusSample> samples{};  ///< the newest kMostSamples
};

/// One of several places in focus.
struct AutofocusCandidate {
  Native position;
  std::optional<Dioptres> vergence;
  int region = 0;  ///< index of the request's region
};

struct AutofocusOutcome {
  bool focused = false;
  std::string method;
  int frames = 0;  ///< all of them, the first and the checking one included
  int moves = 0;   ///< motions of the focus motor, going back included
  Duration elapsed{};
  std::optional<Dioptres> vergence;  ///< where the lens now stands, where optics are known
  std::optional<Dioptres> sigma;
  std::optional<AutofocusSubject> subject{};           ///< where focused
  Native position;                                     ///< where the lens now stands
  Duration cpu{};                                      ///< processor time the method itself took
  double confidence = 0.0;                             ///< 0..1
  autofocus::Cause cause = autofocus::Cause::Unclear;  ///< of a refusal
  std::string reason;                                  ///< why it believes the answer, or why it refuses
  std::vector<AutofocusCandidate> candidates;          ///< what there was to choose from, where it was more than one
  std::vector<AutofocusSample> samples{};              ///< the newest kMostSamples, those of the last search
  std::vector<LeftOutFrame> left_out{};                ///< by the last search; counted in `frames`
  std::vector<drivers::Region> regions{};              ///< that were looked at
  std::optional<autofocus::StarFigures> stars{};       ///< in the last frame, where it was focused by them
  std::optional<SlopeRun> slope{};  ///< that its frames showed, where they did and it held throughout
  std::optional<autofocus::KnownSlope> known_slope{};  ///< that it went by, instead of the told one
  std::optional<int> lag_frames{};                     ///< by which the pictures are late; nothing: not known
  std::optional<FocusMapOutcome> map{};                ///< where one was asked for and the search came to its end
  std::optional<SearchedUnder> under{};                ///< of a search under conditions of its own
};

using StopCallback = std::move_only_function<void(Result<void>)>;
using AutofocusCallback = std::move_only_function<void(Result<AutofocusOutcome>)>;
using ProgressCallback = std::move_only_function<void(const AutofocusProgress&)>;
using SnapshotCallback = std::move_only_function<void(Result<LensedFrame>)>;

struct AxisStatus {
  drivers::NativeUnit unit = drivers::NativeUnit::Steps;
  Native position;
  Native target;   ///< where it was last told to go; its position if it never was
  Native minimum;  ///< soft limits
  Native maximum;
  bool moving = false;
  bool homed = false;       ///< the position is known: it refers to a reference, and nothing has put that in doubt
  bool last_known = false;  ///< the lens does not answer: nothing here is of now
  Native bound = {};     ///< the mechanism is within this of `position` while it stands; of what is last known: nothing
  Arrival arrival = {};  ///< what its next motion will end with
  bool moved_by_us = false;             ///< the last motion was asked of this rig
  bool moved_by_another = false;        ///< the last motion was not
  std::string fault;                    ///< empty, or what the device complains of
  bool lost = false;                    ///< nobody knows where it stands, and it cannot search: see Rig::SetPosition()
  std::optional<bool> referenced = {};  ///< somebody has said where it stands; nothing: something else tells
};
/// NotHomed, in words, where nobody knows where this axis stands and it cannot search; nothing: it is not so.
std::optional<Error> WhyLost(drivers::Axis axis, const std::optional<AxisStatus>& status);

/// What the rig is doing, for people and clients.
struct Activity {
  enum class Kind { Idle, Moving, Homing, Autofocus, Backlash, Snapshot };
  Kind kind = Kind::Idle;
  int step = 0;  ///< x of
  int of = 0;    ///< y; 0: not known
};

/// Motions, homings, stops and autofocus runs that callers have asked for.
struct CommandCount {
  std::uint64_t given = 0;  ///< all of them
  std::uint64_t stops = 0;
  bool operator==(const CommandCount&) const = default;
};

/// A copy of everything known about the rig at one moment.
struct Status {
  bool connected = false;
  std::string
      problem;  ///< empty, or why the lens does not answer: then nothing moves as far as is known, and nothing is homed
  bool wrong_device = false;  ///< the problem is that another device is in its place
  Instant sampled_at{};       ///< of the axes
  drivers::PerAxis<std::optional<AxisStatus>> axes;
  FocusDirection direction{};                 ///< of the focus axis, where there is one
  int limits_set = 0;                         ///< how often soft limits have been set: another number, other limits
  std::shared_ptr<const OpticsTable> optics;  ///< under the conditions of this moment; null: not known
  std::optional<Metres> focal_length;         ///< breathing and zoom counted
  std::optional<Metres> extension;
  std::optional<Metres> extension_error;        ///< of the calibration here; nothing where it is not known
  std::optional<Dioptres> vergence;             ///< of the plane in focus
  std::optional<Dioptres> vergence_bound = {};  ///< the true one is within this of it; nothing while focus moves
  Grade grade = Grade::Uncalibrated;            ///< of the focus position
  std::optional<FNumber> f_number;
  std::optional<FNumber> f_number_bound = {};  ///< likewise; 0 where the f-number is fixed
  std::optional<Celsius> temperature;          ///< the newest that was believed
  std::string temperature_fault = {};          ///< empty, or why what the thermometer reports since then is left out
  std::uint64_t temperatures_left_out = 0;     ///< readings
  bool compensates = false;  ///< positions are worked out for it: that is wanted, and a coefficient is known
  Activity activity;
  std::optional<Instant> held_until{};  ///< lensd's own corrections wait until then
  CommandCount focus_commands{};        ///< as Rig::commands_given() has them
  bool has_camera = false;
  bool may_regain = false;  ///< a part was left out that may work when the devices are opened again
  bool streaming = false;
  drivers::Counters counters;      ///< of camera and lens
  std::optional<Unkept> unkept;    ///< positions on disk are older than these
  bool in_motion_on_disk = false;  ///< an axis moves as far as the disk knows: it does, or came to rest just now
};

/// The rig. One thread calls everything but Interrupt(). A command acts at once, but motors start and all callbacks
/// come in Step(). Every callback is called exactly once: from Step(), or with Code::Cancelled from the destructor. A
/// callback may give the rig further commands but must not destroy it.
///
/// Newest command wins: a motion of an axis displaces the one before (its caller gets Code::Superseded), and any motion
/// displaces autofocus. Stop goes before everything else; the displaced caller gets Code::Cancelled, and the target
/// becomes the readback.
class Rig {
 public:
  /// `device.lens` must be there; `clock` must outlive the rig; without `memory` a restart trusts what the device says.
  /// InvalidArgument: optics that make no sense, a calibration (null: none) that is of another lens or contradicts the
  /// configuration.
  static Result<std::unique_ptr<Rig>> Create(RigConfig config, drivers::Device device, const Clock& clock,
                                             std::shared_ptr<const Calibration> calibration = nullptr,
                                             std::unique_ptr<PositionMemory> memory = nullptr);
  ~Rig();
  Rig(const Rig&) = delete;
  Rig& operator=(const Rig&) = delete;

  const drivers::Capabilities& lens() const;
  const drivers::CameraCapabilities* camera() const;  ///< nullptr: none
  const drivers::Findings& findings() const;          ///< parts of its devices that were left out
  const OpticsTable* optics() const;                  ///< nullptr: not known
  /// Lowest and highest native target of an axis that the lens has, whether it answers or not.
  std::pair<Native, Native> SoftLimits(drivers::Axis axis) const;

  /// Where `target` lies in native units of `axis`. Unsupported: no such axis, no optics for this kind of target.
  /// OutOfRange: outside the soft limits. InvalidArgument.
  Result<Native> Resolve(drivers::Axis axis, const Target& target) const;

  /// Moves and reports. An impossible target fails with Resolve()'s error before anything moves or is displaced.
  /// NotHomed while the position of an axis that could search its reference is not known, and where optics decide a
  /// target of one that only counts and has lost count. NotKept: the memory cannot be written, and nothing has moved.
  void Move(drivers::Axis axis, const Target& target, MoveCallback done);
  /// Searches the reference of `axis`. Unsupported where it has none.
  void Home(drivers::Axis axis, MoveCallback done);
  /// Says where an axis stands that only counts its steps and has no reference; moves nothing. Its count is set off
  /// from the device's from now on, and that is remembered. Unsupported: no such axis, or something tells it better.
  /// Busy: it moves, or a search is under way. OutOfRange: outside its travel. Disconnected, Timeout: it is not known
  /// what the device counts. NotKept, Cancelled: it could not be remembered. With an error nothing has changed.
  void SetPosition(drivers::Axis axis, Native position, StopCallback done);
  /// Ends the motion of these axes, all of them if empty, and any autofocus. Unsupported: an axis cannot stop midway
  /// (the others are stopped all the same).
  void Stop(const std::vector<drivers::Axis>& axes, StopCallback done);
  /// Clears the faults of these axes, all of them if empty, where devices want to be told; moves nothing. Unsupported:
  /// an axis that was named takes no such command.
  void ResetFaults(const std::vector<drivers::Axis>& axes, StopCallback done);
  /// Focuses on a region. Refusing is an outcome, not an error. Unsupported: no camera, no focus axis, conditions that
  /// cannot be set or could not be brought back. InvalidArgument: no such method, a region outside the frame. With
  /// conditions its answer comes once all is as before, or what is not is known.
  void Autofocus(AutofocusRequest request, ProgressCallback progress, AutofocusCallback done);
  /// The frame, or its sharpness, that an autofocus with an OutsideCamera wants. `taken` says whether it was used; what
  /// follows comes through that run's own callbacks. InvalidArgument: no frame is wanted, the exposure began too early
  /// or has not ended, the picture is too small: the same frame is still wanted then.
  void GiveFrame(drivers::Frame frame, StopCallback taken);
  void GiveScore(OutsideScore score, StopCallback taken);
  /// One frame exposed wholly after this call with every axis settled, unless frames of a moving lens will do.
  /// Unsupported: no camera. Timeout: none came.
  void Snapshot(SnapshotCallback done, LensMotion lens = LensMotion::Standing);

  /// Shows frames as they come, until `viewer` says that it has seen enough. It has no part in anything else: while
  /// autofocus uses a camera that makes frames on demand it sees those that autofocus takes, and no others are taken.
  /// Unsupported: no camera.
  Result<void> View(FrameViewer viewer);

  std::shared_ptr<const Calibration> calibration() const;  ///< null: none
  /// Another calibration from now on (null: none). Motions under way go on to where they were sent. Errors as Create();
  /// then the old one stays.
  void SetCalibration(std::shared_ptr<const Calibration> calibration, StopCallback done);

  /// What a measurement has shown of the direction of focus (nothing: what was shown before no longer counts). It
  /// counts from now on where neither the configuration nor a calibration says another. Errors as Create().
  /// Unsupported: no focus axis. Busy: WhyNotAtRest().
  void SetSeenDirection(std::optional<drivers::Direction> seen, StopCallback done);

  const Clock& clock() const;

  /// The side an axis is approached from: its last motion goes toward larger positions.
  bool approaches_up(drivers::Axis axis) const;
  /// What is known of the axis' backlash, from the configuration or else the calibration; 0 where nothing is.
  Backlash backlash(drivers::Axis axis) const;
  /// What must end before the lens may be focused: a search for focus, or a measurement of backlash. Nothing: nothing.
  std::optional<Error> WhyNotFocused() const;
  /// What must end before it can be said where the lens stands, or what its positions mean: that, or an axis that
  /// moves. Nothing: it is at rest.
  std::optional<Error> WhyNotAtRest() const;
  /// From now on, as long as a caller keeps it, what goes on is this, whatever single moves it takes.
  std::shared_ptr<Activity> Occupy(Activity activity);
  /// What has been asked for so far, by all callers, of these axes (none named: of any axis); autofocus counts for the
  /// focus.
  CommandCount commands_given(const std::vector<drivers::Axis>& axes) const;
  /// Until then (an instant that is over: no more) what the rig does by itself waits: following the temperature, and
  /// the next search of an autofocus that tracks. Commands and stops do not. Whether the lens is at rest: what it does
  /// by itself and has begun is finished all the same.
  bool Hold(Instant until);
  /// Exposure time and gain of the frames that start from now on, where they are given, and then as the camera says
  /// they are set. With nothing given it only asks. Unsupported: no camera, or fixed there. OutOfRange: from the
  /// camera; what could be set before that stays set. Busy: autofocus uses the camera, and frames must be alike.
  Result<drivers::ExposureState> SetExposure(const drivers::ExposureState& wanted);

  /// Does one bounded piece of work (each device call ends within its driver's I/O deadline) and returns when it wants
  /// to be called next, at the latest; call it at once after a command.
  Instant Step(Instant now);

  Status GetStatus() const;
  /// From any thread: makes a device call in progress end soon, so that Step() returns.
  void Interrupt();
  /// From any thread: the same of a reading only, which is made up for later. Before a stop.
  void CutReadingShort();

 private:
  class Impl;
  friend class ConditionedSearch;
  explicit Rig(std::unique_ptr<Impl> impl);
  Impl& Commanded();
  Impl& Displacing(const std::vector<drivers::Axis>& axes);
  std::unique_ptr<Impl> impl_;
};

}  // namespace lensd::rig
