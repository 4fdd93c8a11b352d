// The types of io.lensd.Lens, and of each method its parameters and its answer. Names are those of docs/interface.md;
// enumerations are their words, and may get more; a list that is left out is empty.
// Written by script/client-types from proto/io.lensd.Lens.varlink: change that, not this.
#ifndef LENSD_TYPES_H_
#define LENSD_TYPES_H_

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "lensd/value.h"

namespace lensd {
inline namespace v1 {

class DaemonMetrics;
class AxisInfo;
class OpticsInfo;
class CameraInfo;
class LeftOut;
class LensInfo;
class AxisStatus;
class Counters;
class Histogram;
class LensMetrics;
class Unwritten;
class LensStatus;
class Target;
class MoveResult;
class MoveProgress;
class Region;
class FocusRange;
class FocusStep;
class AutofocusSample;
class AutofocusStars;
class AutofocusSubject;
class AutofocusProgress;
class AutofocusCandidate;
class SearchConditions;
class ShiftSize;
class FocusShift;
class SearchedUnder;
class FocusShiftProgress;
class FocusShiftResult;
class AutofocusResult;
class AutofocusLeftOut;
class KnownSlope;
class AutofocusSlope;
class FocusMapCell;
class FocusTilt;
class FocusSurface;
class FocusMapResult;
class AutofocusStep;
class ExposureInfo;
class Size;
class PictureInfo;
class AxisDuring;
class FrameInfo;
class Depth;
class DepthInterval;
class BlurLimit;
class PlanRequest;
class PlanRequestField;
class PlanLimit;
class StackShot;
class PlanAnswer;
class PlanAnswerDepthOfField;
class PlanAnswerRelaxed;
class FoundDevice;
class FailedSearch;
class LeaseInfo;
class Progress;
class FaultChange;
class ThermometerChange;
class LeaseChange;
class CalibrationChange;
class PresetChange;
class ListChange;
class Event;
class EventMark;
class CalibrationPoint;
class CalibrationInfo;
class BacklashResult;
class BacklashProgress;
class Preset;
class RecallResult;
class FocusAtValue;
class FocusAtSample;
class FocusAtSurface;
class FocusAtPlace;
class Refocus;
class DriftResult;
class FocusDrift;
class RefocusState;
class LearnedRun;
class LearnedState;
class UndoResult;
class ListReply;
class ListParameters;
class DevicesReply;
class DevicesParameters;
class ReloadReply;
class ReloadParameters;
class StatusReply;
class StatusParameters;
class MetricsReply;
class MetricsParameters;
class MonitorReply;
class MonitorParameters;
class MoveReply;
class MoveParameters;
class GetCalibrationReply;
class GetCalibrationParameters;
class CalibrateReply;
class CalibrateParameters;
class MeasureBacklashReply;
class MeasureBacklashParameters;
class MeasureFocusShiftReply;
class MeasureFocusShiftParameters;
class ListFocusShiftsReply;
class ListFocusShiftsParameters;
class RemoveFocusShiftReply;
class RemoveFocusShiftParameters;
class FocusAtAddReply;
class FocusAtAddParameters;
class FocusAtGetReply;
class FocusAtGetParameters;
class FocusAtReply;
class FocusAtParameters;
class FocusAtForgetReply;
class FocusAtForgetParameters;
class GetRefocusReply;
class GetRefocusParameters;
class ForgetDriftReply;
class ForgetDriftParameters;
class GetLearnedReply;
class GetLearnedParameters;
class ForgetLearnedReply;
class ForgetLearnedParameters;
class KeepDirectionReply;
class KeepDirectionParameters;
class PresetSaveReply;
class PresetSaveParameters;
class PresetListReply;
class PresetListParameters;
class PresetRecallReply;
class PresetRecallParameters;
class PresetRemoveReply;
class PresetRemoveParameters;
class UndoReply;
class UndoParameters;
class HomeReply;
class HomeParameters;
class SetPositionReply;
class SetPositionParameters;
class StopReply;
class StopParameters;
class ResetFaultsReply;
class ResetFaultsParameters;
class TakeLeaseReply;
class TakeLeaseParameters;
class HoldReply;
class HoldParameters;
class ReleaseReply;
class ReleaseParameters;
class DropLeaseReply;
class DropLeaseParameters;
class PlanReply;
class PlanParameters;
class AutofocusReply;
class AutofocusParameters;
class FocusMapReply;
class FocusMapParameters;
class AutofocusBeginReply;
class AutofocusBeginParameters;
class AutofocusPixelsReply;
class AutofocusPixelsParameters;
class AutofocusFrameReply;
class AutofocusFrameParameters;
class AutofocusScoreReply;
class AutofocusScoreParameters;
class AutofocusEndReply;
class AutofocusEndParameters;
class SnapshotReply;
class SnapshotParameters;
class GetExposureReply;
class GetExposureParameters;
class SetExposureReply;
class SetExposureParameters;
class ViewReply;
class ViewParameters;

/// What lensd as a whole has to do.
class LENSD_API DaemonMetrics : public Value {
 public:
  /// When lensd began.
  std::int64_t sinceNs() const;
  /// Writes and reads of files that wait for their turn.
  std::int64_t filesWaiting() const;
  /// Long plans that wait for their turn.
  std::int64_t plansWaiting() const;
  /// Failures for which the command of `on_failure` was run.
  std::int64_t failuresTold() const;
  /// Those of them for which it could not be run, failed, or was ended because it took too long.
  std::int64_t failuresNotTold() const;
  /// Failures for which it was not run at all, because they came too fast.
  std::int64_t failuresDropped() const;
};

/// One axis as built and configured.
class LENSD_API AxisInfo : public Value {
 public:
  /// Which one.
  std::string axis() const;
  /// Unit of native positions.
  std::string unit() const;
  /// Lowest native target accepted, soft limits included.
  double minimum() const;
  /// Highest native target accepted, soft limits included.
  double maximum() const;
  /// Native units between neighbouring targets: a target is rounded to one. Where an axis stands need not be one, as
  /// before its first move, or after someone else's.
  double resolution() const;
  /// What a position tells: none (what was commanded), echo (the device repeats its target), counts (steps it made, as
  /// far as none was lost) or encoder (where it is, measured on what moves).
  std::string feedback() const;
  /// A reference can be searched for.
  bool canHome() const;
  /// Absolute moves are refused until homed.
  bool needsHome() const;
  /// A motion can be ended midway.
  bool canStop() const;
  /// Feature "direction". Of focus; null: nobody says. Then whatever goes by distance, extension or "nearer" is
  /// Unsupported.
  std::optional<std::string> direction() const;
  /// Feature "direction". Who says so; null where nobody does.
  std::optional<std::string> directionFrom() const;
  /// Feature "direction". What the driver goes by, for people ("the V4L2 standard"); null where it is not the driver
  /// who says so.
  std::optional<std::string> directionBy() const;
  /// Feature "setPosition". Of an axis that counts its steps and has no reference to search: SetPosition has said where
  /// it stands. False: its positions are what the device reports. Null: something else tells where it stands, or the
  /// lens has never answered.
  std::optional<bool> referenced() const;
};

/// What is known of the optics.
class LENSD_API OpticsInfo : public Value {
 public:
  /// Focal length.
  double focalLengthMm() const;
  /// Smallest f-number, the widest opening.
  double fNumberMin() const;
  /// Largest f-number.
  double fNumberMax() const;
  /// Sensor distance beyond the focal length at the far end of focus.
  double extensionMinMm() const;
  /// Sensor distance beyond the focal length at the near end of focus.
  double extensionMaxMm() const;
  /// Distance between the principal planes; counts in distances from the sensor.
  double principalGapMm() const;
  /// Exit pupil diameter over entrance pupil diameter.
  double pupilFactor() const;
  /// Where distances given by people start.
  std::string distanceFrom() const;
  /// How far the sensor may be from where a focus step says: half a step.
  double sensorToleranceUm() const;
  /// How far the f-number may be from what an iris step says, as a ratio: half a step.
  double fNumberTolerance() const;
  /// Longest focal length of a zoom, null where it does not zoom.
  std::optional<double> focalLengthMaxMm() const;
  /// How far the focal length may be from what is stated, as a ratio; 0 where the configuration does not say.
  std::optional<double> focalLengthTolerance() const;
  /// How far focus positions can be trusted.
  std::string grade() const;
  /// Greatest error of the calibration in extension, null where it is not known.
  std::optional<double> calibrationErrorUm() const;
  /// File the calibration is kept in, as `file` of CalibrationInfo; null where none is kept.
  std::optional<std::string> calibrationFile() const;
};

/// The camera behind the lens.
class LENSD_API CameraInfo : public Value {
 public:
  /// Driver that serves it.
  std::string driver() const;
  /// As the camera names itself.
  std::string model() const;
  /// Serial number, null where there is none.
  std::optional<std::string> serial() const;
  /// Width of a frame.
  std::int64_t widthPx() const;
  /// Height of a frame.
  std::int64_t heightPx() const;
  /// Significant bits a sample.
  std::int64_t bits() const;
  /// Pixel pitch on the sensor, null when unknown.
  std::optional<double> pixelUm() const;
  /// Frames a second, null when unknown.
  std::optional<double> frameRateHz() const;
  /// Its pictures have colour, by the format that it sends. Otherwise they are luminance.
  bool colour() const;
};

/// Feature "leftOut". A part that a device lists and that cannot be used, as was found when it was opened: the lens
/// goes without. It is looked for again when the device is opened again, as by Reload. What the configuration names is
/// never left out: without it the lens is absent or wrongDevice.
class LENSD_API LeftOut : public Value {
 public:
  /// The name of an axis, or camera (its pictures), exposure, or gain.
  std::string part() const;
  /// Why it cannot be used.
  std::string reason() const;
};

/// One configured lens.
class LENSD_API LensInfo : public Value {
 public:
  /// Name in the configuration.
  std::string name() const;
  /// Driver that serves it.
  std::string driver() const;
  /// As the lens names itself, null before it has been there.
  std::optional<std::string> model() const;
  /// Serial number, null where there is none.
  std::optional<std::string> serial() const;
  /// Its axes.
  std::vector<AxisInfo> axes() const;
  /// Null when nothing is known: such a lens works in native units only.
  std::optional<OpticsInfo> optics() const;
  /// Null when there is no camera.
  std::optional<CameraInfo> camera() const;
  /// Feature "leftOut". Parts that its devices have and that cannot be used; empty when all is well.
  std::vector<LeftOut> leftOut() const;
};

/// One axis now.
class LENSD_API AxisStatus : public Value {
 public:
  /// Which one.
  std::string axis() const;
  /// Native position.
  double position() const;
  /// Native position it was last told to go to.
  double target() const;
  /// A motion is under way.
  bool moving() const;
  /// The position refers to a known reference, and nothing has put that in doubt, such as lensd killed in mid-move, or
  /// a lens that does not answer.
  bool homed() const;
  /// The lens does not answer, and the position is the last that was known.
  std::optional<bool> lastKnown() const;
  /// Largest difference between the native position and where the mechanism stands, while it stands. Null while the
  /// lens does not answer.
  std::optional<double> positionBound() const;
  /// Who moved it last, null when it has not been moved since lensd began.
  std::optional<std::string> movedBy() const;
  /// What the device complains of; null when all is well.
  std::optional<std::string> fault() const;
  /// Feature "setPosition". True: it counts its steps, may have lost count of them, and has no reference to search, so
  /// that nobody knows where it stands. It moves in its own steps; what needs a calibration or a place that was kept is
  /// NotHomed until SetPosition says where it stands.
  std::optional<bool> positionUnknown() const;
};

/// What went wrong on the way to a lens and its camera since lensd has opened them. None ever falls.
class LENSD_API Counters : public Value {
 public:
  /// Frames damaged, incomplete, or missing between two that came.
  std::int64_t framesLost() const;
  /// Frames that came more than a whole frame time after they were due by the one before: the next one was due by then.
  std::int64_t framesLate() const;
  /// Packets of a network camera that never came.
  std::int64_t packetsLost() const;
  /// Packets of a network camera that came when asked for again.
  std::int64_t packetsResent() const;
  /// Questions that were not answered, or against the rules of the protocol; those repeated with success included.
  std::int64_t busErrors() const;
  /// Readings of the lens' thermometer that cannot be, and were left out.
  std::optional<std::int64_t> temperaturesLeftOut() const;
  /// Feature "badFrames". Of framesLost those that came and could not be used: incomplete, torn, of another size, or no
  /// picture to the decoder.
  std::optional<std::int64_t> framesDamaged() const;
};

/// How long something took, by how long: counts[i] took at most upToMs[i] and longer than upToMs[i-1]; the last of
/// counts, one more than there are bounds, took longer than all of these.
class LENSD_API Histogram : public Value {
 public:
  /// The bounds, rising.
  std::vector<double> upToMs() const;
  /// How many took so long.
  std::vector<std::int64_t> counts() const;
  /// How many there were in all.
  std::int64_t count() const;
  /// How long all of them took together.
  double sumMs() const;
};

/// What a lens has done since lensd began, or since it is configured as it is now.
class LENSD_API LensMetrics : public Value {
 public:
  /// Name of the lens.
  std::string lens() const;
  /// Moves and homings that ended by themselves: neither stopped nor displaced.
  std::int64_t moves() const;
  /// Those of them that arrived.
  std::int64_t movesReached() const;
  /// Those of them whose arrival was measured.
  std::int64_t movesVerified() const;
  /// Those of them that came to rest elsewhere, as often as they were tried.
  std::optional<std::int64_t> movesMissed() const;
  /// Searches for focus that ended by themselves.
  std::int64_t autofocuses() const;
  /// Those of them that were sure.
  std::int64_t autofocusesFocused() const;
  /// Frames that came whole.
  std::int64_t frames() const;
  /// Feature "badFrames". Those of them that are shown and measured though they have bytes too many, or no end marker
  /// (JPEG).
  std::optional<std::int64_t> framesFlawed() const;
  /// Calls that were answered with an error because of this lens, or of what it was doing.
  std::optional<std::int64_t> refused() const;
  /// Times that its device was opened.
  std::optional<std::int64_t> openings() const;
  /// Times that the work on this lens failed, so that it was closed and opened anew.
  std::optional<std::int64_t> failures() const;
  /// Commands that wait now until the lens takes them.
  std::optional<std::int64_t> commandsWaiting() const;
  /// How long commands waited for that.
  std::optional<Histogram> waitMs() const;
  /// How long the moves and homings took that ended by themselves, until they had settled.
  std::optional<Histogram> settleMs() const;
  /// What went wrong.
  Counters counters() const;
};

/// A file that is older than the truth: what was to be written could not be, and is tried again every second or sooner.
/// Where lensd ends before that works, it begins with what the file says: positions are then not known.
class LENSD_API Unwritten : public Value {
 public:
  /// Which one.
  std::string file() const;
  /// When it could not be written for the first time.
  std::int64_t sinceNs() const;
  /// Why not; it names the file.
  std::string reason() const;
};

/// One lens now.
class LENSD_API LensStatus : public Value {
 public:
  /// Name in the configuration.
  std::string name() const;
  /// The device answers. If not, what follows of its axes is the last that was known, and nothing moves or is homed.
  bool connected() const;
  /// The same with the reason; `error` has it in words.
  std::string connection() const;
  /// A stop holds: nothing moves until ResetFaults.
  std::optional<bool> latched() const;
  /// Feature "hold". Until when what lensd does by itself waits, by the longest of the holds; null where there is none.
  std::optional<std::int64_t> holdUntilNs() const;
  /// What is to be known of the files this lens was opened with: damaged (then it goes without, and a copy is kept), or
  /// edited by hand. A calibration that is written since takes its warning away. Also what of its device is not as it
  /// should be and costs no part of it, such as an autofocus of its own that could not be switched off.
  std::vector<std::string> warnings() const;
  /// Files on disk that are older than what is told here; empty when all is well.
  std::vector<Unwritten> unwritten() const;
  /// What is wrong, null when all is well.
  std::optional<std::string> error() const;
  /// What it is doing.
  std::string activity() const;
  /// Step of the activity, from 1; 0 where it has no steps.
  std::int64_t step() const;
  /// Steps expected in all; 0 when not known.
  std::int64_t stepsExpected() const;
  /// Its axes.
  std::vector<AxisStatus> axes() const;
  /// Feature "leftOut". As in LensInfo.
  std::vector<LeftOut> leftOut() const;
  /// Vergence the lens is focused at, null where the optics or the place of focus are not known.
  std::optional<double> vergenceD() const;
  /// The same as a distance, null also when infinite or past infinity.
  std::optional<double> focalPlaneM() const;
  /// Sensor distance beyond the focal length, null where the optics or the place of focus are not known.
  std::optional<double> extensionMm() const;
  /// F-number, null when unknown.
  std::optional<double> fNumber() const;
  /// Focal length, zoom and breathing counted; null when unknown.
  std::optional<double> focalLengthMm() const;
  /// How much nearer to the scene the lens centre stands than at the shortest focal length: what distances from the
  /// lens are longer by than those from its centre. Null when unknown.
  std::optional<double> centreShiftMm() const;
  /// How far this focus position can be trusted, null without optics.
  std::optional<std::string> grade() const;
  /// Error of the calibration at this focus position, in extension; null where it is not known.
  std::optional<double> calibrationErrorUm() const;
  /// Temperature of the lens, null when it has no sensor: the newest reading that can be, by `range_c` and
  /// `max_c_per_min` of [lens.temperature].
  std::optional<double> temperatureC() const;
  /// Why what its sensor reports since then is left out, null when nothing is. `temperaturesLeftOut` of the counters
  /// says how often that was.
  std::optional<std::string> temperatureFault() const;
  /// What went wrong on the way to it.
  std::optional<Counters> counters() const;
  /// Who has it alone, null: it is everybody's.
  std::optional<LeaseInfo> lease() const;
  /// When the device was read; 0: it never was.
  std::int64_t readAtNs() const;
  /// Feature "stateBounds". The true vergence of the plane in focus is within this of vergenceD, as far as Grade says;
  /// the tolerance of the focal length counts. Null where that is, and while focus moves.
  std::optional<double> vergenceBoundD() const;
  /// Feature "stateBounds". The true f-number is within this of fNumber, as far as Grade says. Null where that is, and
  /// while the iris moves.
  std::optional<double> fNumberBound() const;
};

/// Where an axis should go: exactly one field. distanceM, vergenceD and extensionMm are for focus, fNumber for the
/// iris; position, relative and nearer are for every axis that has native units.
class LENSD_API Target : public Value {
 public:
  /// Distance of the focal plane from where distanceFrom of Move says.
  std::optional<double> distanceM() const;
  Target& distanceM(double value);
  /// Vergence of the focal plane at the lens centre.
  std::optional<double> vergenceD() const;
  Target& vergenceD(double value);
  /// Sensor distance beyond the focal length.
  std::optional<double> extensionMm() const;
  Target& extensionMm(double value);
  /// F-number.
  std::optional<double> fNumber() const;
  Target& fNumber(double value);
  /// Focal length at extension 0, without breathing. Zoom only.
  std::optional<double> focalLengthMm() const;
  Target& focalLengthMm(double value);
  /// Absolute native position.
  std::optional<double> position() const;
  Target& position(double value);
  /// Native steps from where the axis stands.
  std::optional<double> relative() const;
  Target& relative(double value);
  /// Native steps toward nearer focus, whatever the wiring; negative is farther. Focus only.
  std::optional<double> nearer() const;
  Target& nearer(double value);
};

/// A finished move or homing.
class LENSD_API MoveResult : public Value {
 public:
  /// Name of the lens.
  std::string lens() const;
  /// Which axis.
  std::string axis() const;
  /// It arrived, as far as the device can tell.
  bool reached() const;
  /// It came to rest: the settling time has passed after arrival.
  bool settled() const;
  /// Arrival was measured: by an encoder on what moves, or because the axis stands at its reference. Steps that are
  /// counted are no measurement: then the move is reached, within the bound.
  bool verified() const;
  /// Native position at the end.
  double position() const;
  /// Where it stands is on disk, and known again after a power cut. Null: nothing is kept, or it did not arrive.
  std::optional<bool> kept() const;
  /// Largest difference between the stated and the true native position.
  std::optional<double> positionBound() const;
  /// Vergence the lens is focused at; of focus, where the optics are known.
  std::optional<double> vergenceD() const;
  /// F-number; of the iris, where the optics are known.
  std::optional<double> fNumber() const;
  /// Focal length at extension 0, without breathing; of a zoom whose optics are known.
  std::optional<double> focalLengthMm() const;
  /// Sensor distance beyond the focal length; of focus, where the optics are known.
  std::optional<double> extensionMm() const;
  /// Largest difference between the stated and the true extension, as far as Grade says; where extensionMm is told.
  std::optional<double> extensionBoundUm() const;
  /// It came to rest elsewhere, as often as it was tried.
  std::optional<bool> missed() const;
  /// external: another program took the axis elsewhere meanwhile; it was left there.
  std::string movedBy() const;
  /// Largest difference between the stated and the true vergence of the plane in focus, as far as Grade says; the
  /// tolerance of the focal length counts. Where vergenceD is told.
  std::optional<double> vergenceBoundD() const;
  /// Largest difference between the stated and the true focal length, as far as Grade says; where focalLengthMm is
  /// told.
  std::optional<double> focalLengthBoundMm() const;
  /// A zoom that kept the plane in focus: the sensor was within this of where that plane is sharp, all the way.
  std::optional<double> trackingBoundUm() const;
  /// A zoom that kept the plane in focus: vergence of that plane.
  std::optional<double> keptD() const;
  /// An iris move that kept the brightness: exposure time from now on, null where it was left alone.
  std::optional<double> exposureMs() const;
  /// An iris move that kept the brightness: brightness now over brightness before; other than 1 where the camera's
  /// limits stood in the way: its shortest and longest exposure, and its frame time, unless the exposure was longer
  /// already.
  std::optional<double> brightnessRatio() const;
  /// Why it is not reached or not verified; null when there is nothing to say.
  std::optional<std::string> cause() const;
  /// The same in words.
  std::optional<std::string> reason() const;
  /// From the start of the command to its end.
  double elapsedMs() const;
};

/// A move under way.
class LENSD_API MoveProgress : public Value {
 public:
  /// Which axis.
  std::string axis() const;
  /// Native position.
  double position() const;
  /// Native target.
  double target() const;
};

/// A rectangle of the frame as fractions of its width and height, from the upper left corner.
class LENSD_API Region : public Value {
 public:
  /// Left edge, 0 to 1.
  double x() const;
  Region& x(double value);
  /// Upper edge, 0 to 1.
  double y() const;
  Region& y(double value);
  /// Width, above 0, to 1.
  double w() const;
  Region& w(double value);
  /// Height, above 0, to 1.
  double h() const;
  Region& h(double value);
};

/// The part of the travel in which autofocus takes its frames: from one place of focus to another, in either order,
/// ends included. Each is a target of focus; relative ones count from where the lens stands when the search is asked
/// for. Where the lens stands outside it, it goes to the nearer end first. Taking up backlash may go beyond an end,
/// without frames.
class LENSD_API FocusRange : public Value {
 public:
  /// One end.
  Target from() const;
  FocusRange& from(const Target& value);
  /// The other end.
  Target to() const;
  FocusRange& to(const Target& value);
};

/// How far apart the frames of a search's first pass are at most: exactly one field.
class LENSD_API FocusStep : public Value {
 public:
  /// Native steps.
  std::optional<double> relative() const;
  FocusStep& relative(double value);
  /// Extension. Where the optics are known, and not of liquid lenses.
  std::optional<double> extensionUm() const;
  FocusStep& extensionUm(double value);
  /// Change of the blur's diameter. Where extensionUm can be said, and f-number and pixels are known.
  std::optional<double> blurPx() const;
  FocusStep& blurPx(double value);
};

/// A frame of an autofocus, as one of its regions saw it.
class LENSD_API AutofocusSample : public Value {
 public:
  /// Number of the frame, from 1.
  std::int64_t frame() const;
  /// Which of the regions asked for, from 0.
  std::int64_t region() const;
  /// How the lens was.
  std::string state() const;
  /// Native focus position at mid-exposure.
  double position() const;
  /// The true position was within this of it, null when not known.
  std::optional<double> positionBound() const;
  /// Vergence in focus there, null where the optics are not known, and of liquid lenses.
  std::optional<double> vergenceD() const;
  /// Sharpness: gradient energy without that of the noise over squared brightness, which is about 0 where nothing can
  /// be seen; or what AutofocusScore said. Comparable within a run; earlier ones change where a later frame shows that
  /// a part of the region has to be left out of all.
  double score() const;
  /// Standard deviation of score from frame to frame.
  double scoreSigma() const;
  /// Exposure, on CLOCK_MONOTONIC.
  std::int64_t exposureStartNs() const;
  /// Its end.
  std::int64_t exposureEndNs() const;
};

/// Points of light in the frame at the answer.
class LENSD_API AutofocusStars : public Value {
 public:
  /// How many were measured: those that touch another one or the frame's edge are not.
  std::int64_t count() const;
  /// How many of them are too bright for the sensor.
  std::int64_t clipped() const;
  /// Median of their half-flux radii: the circle about a star's centroid that holds half of its light. Of those that
  /// are not clipped; null where all are.
  std::optional<double> hfrPx() const;
  /// Median of their full widths at half maximum, of Gaussians fitted to them. Null where all are clipped, or none has
  /// that shape.
  std::optional<double> fwhmPx() const;
};

/// What an autofocus came to focus on.
class LENSD_API AutofocusSubject : public Value {
 public:
  /// Which of the regions asked for, from 0.
  std::int64_t region() const;
  /// What it was found by.
  std::string foundBy() const;
  /// Native focus position at which all frames together place the focus. The lens stands near it: no motion is spent on
  /// what is a small part of the depth of field.
  double position() const;
  /// Vergence of the subject, null where the optics are not known, and of liquid lenses.
  std::optional<double> vergenceD() const;
  /// The same as a distance from the lens centre, null also when infinite or past it.
  std::optional<double> focalPlaneM() const;
  /// Standard deviation of vergenceD.
  std::optional<double> sigmaD() const;
};

/// An autofocus under way.
class LENSD_API AutofocusProgress : public Value {
 public:
  /// Frames used so far.
  std::int64_t frames() const;
  /// Moves made so far.
  std::int64_t moves() const;
  /// Frames the method expects to need in all; 0 when not known.
  std::int64_t framesExpected() const;
  /// Native focus position of the last frame.
  double position() const;
  /// Sharpness of the last frame relative to the first, null when not known.
  std::optional<double> sharpness() const;
  /// The curve so far, region by region, frames as they were taken: the newest 1000.
  std::vector<AutofocusSample> samples() const;
};

/// A place where something is in focus, where there is more than one.
class LENSD_API AutofocusCandidate : public Value {
 public:
  /// Which of the regions asked for, from 0.
  std::int64_t region() const;
  /// Native focus position.
  double position() const;
  /// Vergence in focus there, null where the optics are not known, and of liquid lenses.
  std::optional<double> vergenceD() const;
};

/// Feature "searchConditions". Under what to search, where that is not how the lens stands; what is left out stays as
/// it is.
class LENSD_API SearchConditions : public Value {
 public:
  /// Exposure time.
  std::optional<double> exposureMs() const;
  SearchConditions& exposureMs(double value);
  /// Gain, in the unit of the camera's gain as GetExposure tells it.
  std::optional<double> gain() const;
  SearchConditions& gain(double value);
  /// F-number.
  std::optional<double> fNumber() const;
  SearchConditions& fNumber(double value);
  /// Native position of the filter.
  std::optional<double> filterPosition() const;
  SearchConditions& filterPosition(double value);
};

/// Feature "searchConditions". How far focus is from where it is under another condition: in extension where the optics
/// are known, else in native units of focus.
class LENSD_API ShiftSize : public Value {
 public:
  /// Extension that focus needs more; null where it is told in native units.
  std::optional<double> extensionUm() const;
  /// Standard deviation of that.
  std::optional<double> sigmaUm() const;
  /// Native units that focus is higher; null where it is told in extension.
  std::optional<double> size() const;
  /// Standard deviation of that.
  std::optional<double> sizeSigma() const;
};

/// Feature "searchConditions". The shift of focus from one f-number to another, or from one filter to another, as it
/// was measured.
class LENSD_API FocusShift : public Value {
 public:
  /// F-number that it is from, null where it is of filters.
  std::optional<double> fromFNumber() const;
  /// F-number that it is to.
  std::optional<double> toFNumber() const;
  /// Filter that it is from, null where it is of f-numbers.
  std::optional<double> fromFilter() const;
  /// Filter that it is to.
  std::optional<double> toFilter() const;
  /// Focal length that a zoom had, null where it does not zoom.
  std::optional<double> focalLengthMm() const;
  /// How far.
  ShiftSize shift() const;
  /// Pairs of searches that it was measured by; 0 where a person said it.
  std::int64_t pairs() const;
  /// When, null where it does not say.
  std::optional<std::string> made() const;
};

/// Feature "searchConditions". What became of the conditions of a search.
class LENSD_API SearchedUnder : public Value {
 public:
  /// Exposure time of its frames, as the camera said; null where none was asked for.
  std::optional<double> exposureMs() const;
  /// Gain, likewise.
  std::optional<double> gain() const;
  /// F-number of the search, null where it is not known.
  std::optional<double> fNumber() const;
  /// Where the filter stood, null where there is none.
  std::optional<double> filterPosition() const;
  /// All is again as it was before the search.
  bool restored() const;
  /// What is not, and why; null where all is.
  std::optional<std::string> stays() const;
  /// What focus went on by, from where the search found it to where it is without the conditions; 0 where they do not
  /// change focus. Null: by nothing.
  std::optional<ShiftSize> shift() const;
  /// Why by nothing: not measured, as it says then. Null where there is nothing to say.
  std::optional<std::string> shiftReason() const;
};

/// How far a measurement of a shift has come.
class LENSD_API FocusShiftProgress : public Value {
 public:
  /// The search under way, from 1.
  std::int64_t search() const;
  /// Searches in all.
  std::int64_t searchesExpected() const;
  /// Frames used so far.
  std::int64_t frames() const;
};

/// A finished measurement of a shift.
class LENSD_API FocusShiftResult : public Value {
 public:
  /// Name of the lens.
  std::string lens() const;
  /// It was measured, and is kept.
  bool measured() const;
  /// What it is, null where it was not measured: then what was known before stays.
  std::optional<FocusShift> shift() const;
  /// Frames it took.
  std::int64_t frames() const;
  /// Time it took.
  double elapsedMs() const;
  /// Why the search refused that ended it, null where it was measured.
  std::optional<std::string> cause() const;
  /// The same in words, null where it was measured.
  std::optional<std::string> reason() const;
};

/// A finished autofocus.
class LENSD_API AutofocusResult : public Value {
 public:
  /// Name of the lens.
  std::string lens() const;
  /// It is sure. Otherwise it refused, and the lens is back where it was, unless it is notRestored.
  bool focused() const;
  /// Method used.
  std::string method() const;
  /// Frames used.
  std::int64_t frames() const;
  /// Moves made.
  std::int64_t moves() const;
  /// From the start of the command to its end.
  double elapsedMs() const;
  /// Vergence where the lens now stands, null where the optics are not known, and of liquid lenses.
  std::optional<double> vergenceD() const;
  /// Standard deviation of the answer, null where vergenceD is, or refused.
  std::optional<double> sigmaD() const;
  /// Native focus position at the end.
  double position() const;
  /// 0 to 1.
  double confidence() const;
  /// Why it believes the answer, or why it refused.
  std::string cause() const;
  /// The same in words.
  std::string reason() const;
  /// What there was to choose from: one for each of several regions in focus, or the depths found in a region that was
  /// refused for having several. Absent where there is no choice.
  std::vector<AutofocusCandidate> candidates() const;
  /// What was focused on, null where it refused.
  std::optional<AutofocusSubject> subject() const;
  /// The curve of this search, as in AutofocusProgress.
  std::vector<AutofocusSample> samples() const;
  /// The regions looked at: those asked for, else the camera's own.
  std::vector<Region> regions() const;
  /// Feature "stars". What was focused on by the method stars, null where it was another.
  std::optional<AutofocusStars> stars() const;
  /// Feature "searchConditions". What became of the conditions of the search; null where it had none of its own.
  std::optional<SearchedUnder> conditions() const;
  /// Feature "learned". What it knew of the lens' blur and what it saw of it; null where both is nothing.
  std::optional<AutofocusSlope> slope() const;
  /// Feature "badFrames". Frames that were not used: black, torn, or of a place where the lens was before. They count
  /// in frames, and samples has none of them. Absent where there are none.
  std::vector<AutofocusLeftOut> framesLeftOut() const;
};

/// Feature "badFrames". A frame of an autofocus that was not used; another one was taken in its place.
class LENSD_API AutofocusLeftOut : public Value {
 public:
  /// Number of the frame, from 1.
  std::int64_t frame() const;
  /// Native focus position that it was taken at.
  double position() const;
  /// Why, in words.
  std::string reason() const;
};

/// Feature "learned". The blur that a step of focus makes, over what the configuration and the calibration tell, as
/// earlier autofocus runs have shown it.
class LENSD_API KnownSlope : public Value {
 public:
  /// Their mean.
  double factor() const;
  /// Between this and `high` the next run is expected, with 95 %.
  double low() const;
  /// See `low`.
  double high() const;
  /// Number of runs that it is learned from: 3 to 10, the newest that were made with iris and zoom where they stand.
  std::int64_t runs() const;
  /// Feature "learnedSides". Blur grows at most so many times as fast on one side of focus as on the other, with 95 %:
  /// near 1, a search may do with three frames. Null: fewer than three of the runs have shown it.
  std::optional<double> uneven() const;
};

/// Feature "learned". The blur that a step of focus makes, in one autofocus.
class LENSD_API AutofocusSlope : public Value {
 public:
  /// As its frames showed it, over what is told; null where they did not.
  std::optional<double> shown() const;
  /// As earlier runs had shown it: the search went by this instead of what is told. Null: by what is told.
  std::optional<KnownSlope> known() const;
  /// The two contradict each other, as with another lens: what was learned is forgotten, if focus was found.
  bool anotherLens() const;
};

/// Feature "focusMap". One region of a focus map.
class LENSD_API FocusMapCell : public Value {
 public:
  /// Its column from the left, from 0.
  std::int64_t column() const;
  /// Its row from the top, from 0.
  std::int64_t row() const;
  /// The region.
  Region region() const;
  /// Its middle, as a fraction of the frame's width from the left.
  double x() const;
  /// Its middle, as a fraction of the frame's height from the top.
  double y() const;
  /// found, or why it is not known where it is in focus.
  std::string cause() const;
  /// The same in words.
  std::string reason() const;
  /// Native focus position at which it is in focus, null where cause is not found.
  std::optional<double> position() const;
  /// Vergence in focus there, null where position is.
  std::optional<double> vergenceD() const;
  /// Extension there beyond that at which the frame as a whole is least out of focus; null where position is, or where
  /// there is no surface.
  std::optional<double> extensionUm() const;
  /// Standard deviation of that by this region's own frames, null where position is.
  std::optional<double> sigmaUm() const;
  /// Extension there beyond the fitted surface, null where extensionUm is.
  std::optional<double> offUm() const;
  /// It is too far off to lie on the surface, and was left out of the fit.
  bool outlier() const;
};

/// Feature "focusMap". How best focus changes along one side of the frame. The angles are two readings of the same:
/// each would explain all of it.
class LENSD_API FocusTilt : public Value {
 public:
  /// Extension of best focus at the right edge beyond that at the left; down: at the lower edge beyond the upper.
  double riseUm() const;
  /// Standard deviation of that.
  double sigmaUm() const;
  /// Angle of the sensor that explains it, positive where the side that shows the right (lower) edge of the picture is
  /// too near to the lens; null where the pixels' size is not known.
  std::optional<double> sensorDeg() const;
  /// Standard deviation of that.
  std::optional<double> sensorSigmaDeg() const;
  /// Angle of the target that explains it, positive where its right (lower) edge is nearer; null where sensorDeg is,
  /// and where the target is so far away that no angle would.
  std::optional<double> targetDeg() const;
};

/// Feature "focusMap". The smooth surface that best focus lies on over the frame: a plane and a bowl.
class LENSD_API FocusSurface : public Value {
 public:
  /// The plane's slope along the frame's width: a turn about the vertical (y) axis.
  FocusTilt across() const;
  /// Along its height: a turn about the horizontal (x) axis.
  FocusTilt down() const;
  /// Extension of best focus in the corners beyond the middle, null where too few regions tell.
  std::optional<double> curvatureUm() const;
  /// Standard deviation of that.
  std::optional<double> curvatureSigmaUm() const;
  /// Standard deviation by which regions are off the surface beyond their own sigmaUm. It counts in the errors above.
  double scatterUm() const;
  /// The region that is farthest out of focus where the lens now stands is so by this, by the surface.
  double leftUm() const;
  /// Diameter of the blur there, null where the f-number or the pixels' size are not known.
  std::optional<double> leftPx() const;
  /// How many regions it was fitted to.
  std::int64_t used() const;
};

/// Feature "focusMap". A finished focus map.
class LENSD_API FocusMapResult : public Value {
 public:
  /// Name of the lens.
  std::string lens() const;
  /// It is sure. Otherwise it refused, and the lens is back where it was.
  bool mapped() const;
  /// Why it believes the map, or why it refused.
  std::string cause() const;
  /// The same in words.
  std::string reason() const;
  /// Columns of the grid.
  std::int64_t columns() const;
  /// Rows of the grid.
  std::int64_t rows() const;
  /// The regions, row by row. Empty where the search did not come to its end.
  std::vector<FocusMapCell> cells() const;
  /// What was fitted to them, null where it refused.
  std::optional<FocusSurface> surface() const;
  /// Size of the target on the sensor over its own, from vergenceD; null where it refused.
  std::optional<double> magnification() const;
  /// Frames used.
  std::int64_t frames() const;
  /// Moves made.
  std::int64_t moves() const;
  /// From the start of the command to its end.
  double elapsedMs() const;
  /// Native focus position at the end: where the frame as a whole is least out of focus.
  double position() const;
  /// Vergence in focus there.
  std::optional<double> vergenceD() const;
};

/// Where an autofocus session wants its next frame. The lens stands there.
class LENSD_API AutofocusStep : public Value {
 public:
  /// Number of the frame, from 1.
  std::int64_t frame() const;
  /// Frames the method expects to need in all; 0 when not known.
  std::int64_t framesExpected() const;
  /// Native focus position.
  double position() const;
  /// Sensor distance beyond the focal length, null where the optics are not known.
  std::optional<double> extensionMm() const;
  /// Vergence the lens is focused at, null where the optics are not known.
  std::optional<double> vergenceD() const;
  /// When it had come to rest there: exposures that begin now or later will do.
  std::int64_t settledAtNs() const;
  /// The curve so far, as in AutofocusProgress.
  std::vector<AutofocusSample> samples() const;
};

/// How a camera exposes, and what it can be set to.
class LENSD_API ExposureInfo : public Value {
 public:
  /// Name of the lens.
  std::string lens() const;
  /// Exposure time as the camera says it is set, null where it does not say.
  std::optional<double> exposureMs() const;
  /// The exposure time can be set.
  bool canSetExposure() const;
  /// Shortest that can be set, null when unknown.
  std::optional<double> exposureMinMs() const;
  /// Longest that can be set, null when unknown.
  std::optional<double> exposureMaxMs() const;
  /// From one that can be set to the next, counted from the shortest; null where any can be, or when unknown.
  std::optional<double> exposureStepMs() const;
  /// Gain as the camera says it is set, null where it does not say.
  std::optional<double> gain() const;
  /// The gain can be set.
  bool canSetGain() const;
  /// Lowest that can be set, null where it cannot.
  std::optional<double> gainMin() const;
  /// Highest that can be set, null where it cannot.
  std::optional<double> gainMax() const;
  /// From one that can be set to the next, counted from the lowest; null where any can be, or when unknown.
  std::optional<double> gainStep() const;
  /// What gain is counted in, null where it cannot be set.
  std::optional<std::string> gainUnit() const;
};

/// A size in pixels.
class LENSD_API Size : public Value {
 public:
  /// Width, at least 1.
  std::int64_t widthPx() const;
  Size& widthPx(std::int64_t value);
  /// Height, at least 1.
  std::int64_t heightPx() const;
  Size& heightPx(std::int64_t value);
};

/// A picture made of a frame.
class LENSD_API PictureInfo : public Value {
 public:
  /// How it is written.
  std::string encoding() const;
  /// Left edge of the part of the frame that it shows, in pixels of the frame.
  std::int64_t leftPx() const;
  /// Upper edge of it.
  std::int64_t topPx() const;
  /// Width of the picture.
  std::int64_t widthPx() const;
  /// Height of the picture.
  std::int64_t heightPx() const;
  /// Samples a pixel: 1 is luminance, 3 is red, green, blue.
  std::int64_t channels() const;
  /// Significant bits a sample.
  std::int64_t bits() const;
  /// Sample = light^(1/gamma); 1 is linear light.
  double gamma() const;
  /// How many samples of the luminance of that part lie in each of 64 equal parts of the full scale, before it was made
  /// smaller. Of every row, or of every second, third ... where it has more than a million pixels. Only in View.
  std::vector<std::int64_t> histogram() const;
  /// How sharp that part is, before it was made smaller: gradient energy without noise over squared mean light, to be
  /// compared between frames of one scene. A little below 0 where there is hardly more than noise. Only in View; null
  /// below 3 pixels a side.
  std::optional<double> sharpness() const;
};

/// One axis during an exposure.
class LENSD_API AxisDuring : public Value {
 public:
  /// Which one.
  std::string axis() const;
  /// Native position, the middle of where it was.
  double position() const;
  /// Largest difference between that and where the mechanism stood at any time of the exposure.
  double positionBound() const;
  /// It moved, or had not settled.
  bool moving() const;
};

/// A frame of the camera, and the lens during its exposure.
class LENSD_API FrameInfo : public Value {
 public:
  /// Width of the frame.
  std::int64_t widthPx() const;
  /// Height of the frame.
  std::int64_t heightPx() const;
  /// Significant bits a sample of the camera.
  std::int64_t bits() const;
  /// Sample = light^(1/gamma); 1 is linear light.
  double gamma() const;
  /// Counts the camera's frames, lost ones included.
  std::int64_t sequence() const;
  /// Exposure time.
  double exposureMs() const;
  /// When the exposure began.
  std::optional<std::int64_t> exposureStartNs() const;
  /// When it ended.
  std::optional<std::int64_t> exposureEndNs() const;
  /// Sensor distance beyond the focal length, null where the optics or the place of focus are not known.
  std::optional<double> extensionMm() const;
  /// The true extension during the exposure was within this of it, as far as Grade says; null where that is.
  std::optional<double> extensionBoundUm() const;
  /// F-number, null when unknown.
  std::optional<double> fNumber() const;
  /// The true f-number was within this of it, as far as Grade says; null when unknown.
  std::optional<double> fNumberBound() const;
  /// An axis moved during the exposure.
  bool moving() const;
  /// Every axis during the exposure.
  std::vector<AxisDuring> axes() const;
};

/// Where something is along the axis from the lens centre: exactly one field.
class LENSD_API Depth : public Value {
 public:
  /// Distance, above 0.
  std::optional<double> distanceM() const;
  Depth& distanceM(double value);
  /// Vergence; 0 is infinity.
  std::optional<double> vergenceD() const;
  Depth& vergenceD(double value);
};

/// Every depth between two ends, in either order; equal ends are one depth.
class LENSD_API DepthInterval : public Value {
 public:
  /// One end.
  Depth oneEnd() const;
  DepthInterval& oneEnd(const Depth& value);
  /// The other end.
  Depth otherEnd() const;
  DepthInterval& otherEnd(const Depth& value);
};

/// A limit on the blur of a subject.
class LENSD_API BlurLimit : public Value {
 public:
  /// Its name in answers and conflicts, another one for each limit; its place in the list, such as limits[0], when left
  /// out. focus, fNumber and extension are refused; depth and positions are not, but stand for something else in
  /// `conflict`.
  std::optional<std::string> name() const;
  BlurLimit& name(const std::string& value);
  /// sharp: the blur is at most limitUm at every depth; blurred: at least.
  std::string kind() const;
  BlurLimit& kind(const std::string& value);
  /// Diameter of the blur disk on the sensor, above 0; one pixel when both this and limitPx are left out.
  std::optional<double> limitUm() const;
  BlurLimit& limitUm(double value);
  /// The same in pixels.
  std::optional<double> limitPx() const;
  BlurLimit& limitPx(double value);
  /// Where the subject is.
  std::vector<DepthInterval> depths() const;
  BlurLimit& depths(const std::vector<DepthInterval>& value);
  /// Side of the focal plane a blurred subject lies on: behind is farther than the plane. Either when left out. It does
  /// not count for sharp ones.
  std::optional<std::string> side() const;
  BlurLimit& side(const std::string& value);
};

/// A question to the planner. What is left out is the lens' own as it stands now: its focal length, breathing, ranges,
/// pixel, calibration, and the bounds within which its motors keep their word.
class LENSD_API PlanRequest : public Value {
 public:
  /// Where distances start. As configured when left out.
  std::optional<std::string> distanceFrom() const;
  PlanRequest& distanceFrom(const std::string& value);
  /// Focal length a zoom shall go to. Where it stands when left out.
  std::optional<double> focalLengthMm() const;
  PlanRequest& focalLengthMm(double value);
  /// Instead, any focal length from this one ...
  std::optional<double> focalLengthMinMm() const;
  PlanRequest& focalLengthMinMm(double value);
  /// ... to this one: the best for the limits is chosen.
  std::optional<double> focalLengthMaxMm() const;
  PlanRequest& focalLengthMaxMm(double value);
  /// Instead, the focal length at which a field of this width fills the sensor, focused there.
  std::optional<PlanRequestField> field() const;
  PlanRequest& field(const PlanRequestField& value);
  /// Width of the sensor for `field` (without that it does not count); the camera's when left out.
  std::optional<double> sensorWidthMm() const;
  PlanRequest& sensorWidthMm(double value);
  /// The fewest shots that together keep every sharp limit, instead of one setting.
  std::optional<bool> stack() const;
  PlanRequest& stack(bool value);
  /// apertureMin, apertureMax and stops are diameters in millimetres, not f-numbers. False when left out.
  std::optional<bool> aperturesAreDiameters() const;
  PlanRequest& aperturesAreDiameters(bool value);
  /// Low end of the apertures.
  std::optional<double> apertureMin() const;
  PlanRequest& apertureMin(double value);
  /// High end of the apertures.
  std::optional<double> apertureMax() const;
  PlanRequest& apertureMax(double value);
  /// The only apertures there are; replaces the range. An empty list counts as left out.
  std::vector<double> stops() const;
  PlanRequest& stops(const std::vector<double>& value);
  /// Low end of the sensor distance beyond the focal length.
  std::optional<double> extensionMinMm() const;
  PlanRequest& extensionMinMm(double value);
  /// High end of it.
  std::optional<double> extensionMaxMm() const;
  PlanRequest& extensionMaxMm(double value);
  /// Where the focal plane must be; anywhere when left out.
  std::optional<Depth> focus() const;
  PlanRequest& focus(const Depth& value);
  /// The plan holds for every sensor position within this of its own. What is less than the motors keep, also below 0,
  /// stands for what they keep; so too of fNumberTolerance.
  std::optional<double> sensorToleranceUm() const;
  PlanRequest& sensorToleranceUm(double value);
  /// The plan holds for every f-number within this ratio of its own.
  std::optional<double> fNumberTolerance() const;
  PlanRequest& fNumberTolerance(double value);
  /// Counts diffraction at this wavelength in sharp limits.
  std::optional<double> wavelengthNm() const;
  PlanRequest& wavelengthNm(double value);
  /// How diffraction is counted, where a wavelength is given. By the Airy disk when left out.
  std::optional<std::string> diffraction() const;
  PlanRequest& diffraction(const std::string& value);
  /// Exit pupil diameter over entrance pupil diameter.
  std::optional<double> pupilFactor() const;
  PlanRequest& pupilFactor(double value);
  /// What is best: light (smallest f-number), sharp (smallest worst ratio of blur to limit) or depth (greatest depth of
  /// field at `focus`). Light when left out.
  std::optional<std::string> objective() const;
  PlanRequest& objective(const std::string& value);
  /// Blur that still counts as sharp for the objective depth, which needs it and `focus`; otherwise it does not count.
  std::optional<double> blurLimitUm() const;
  PlanRequest& blurLimitUm(double value);
  /// The same in pixels.
  std::optional<double> blurLimitPx() const;
  PlanRequest& blurLimitPx(double value);
  /// Pixel pitch.
  std::optional<double> pixelUm() const;
  PlanRequest& pixelUm(double value);
  /// What the camera model may leave out.
  std::optional<double> modelToleranceUm() const;
  PlanRequest& modelToleranceUm(double value);
  /// The same in pixels.
  std::optional<double> modelTolerancePx() const;
  PlanRequest& modelTolerancePx(double value);
  /// The limits.
  std::vector<BlurLimit> limits() const;
  PlanRequest& limits(const std::vector<BlurLimit>& value);
};

/// Instead, the focal length at which a field of this width fills the sensor, focused there.
class LENSD_API PlanRequestField : public Value {
 public:
  double widthM() const;
  double distanceM() const;
};

/// How one limit fares, tolerances included.
class LENSD_API PlanLimit : public Value {
 public:
  /// Its name.
  std::string name() const;
  /// Near end of its depths.
  std::optional<double> nearD() const;
  /// Far end of its depths.
  std::optional<double> farD() const;
  /// The limit.
  std::optional<double> limitUm() const;
  /// Greatest blur for a sharp limit, least for a blurred one.
  std::optional<double> worstUm() const;
  /// Where that is.
  std::optional<double> atD() const;
  /// worstUm/limitUm, or its inverse for a blurred limit: it holds when at most 1.
  std::optional<double> ratio() const;
};

/// One picture of a focus stack.
class LENSD_API StackShot : public Value {
 public:
  /// The f-number, the same for all shots of a stack.
  double fNumber() const;
  /// Sensor distance beyond the focal length.
  double extensionMm() const;
  /// Focal length there.
  double focalLengthMm() const;
  /// Width of the field there at the distance of `field`.
  std::optional<double> fieldWidthM() const;
  /// Near end of what this shot keeps sharp.
  std::optional<double> nearD() const;
  /// Far end of it.
  std::optional<double> farD() const;
  /// Image size over object size at the focal plane.
  double magnification() const;
  /// Native position of focus, null where there is no such motor.
  std::optional<double> focusPosition() const;
  /// Native position of the iris, null where there is no such motor.
  std::optional<double> irisPosition() const;
};

/// The planner's answer. An infeasible one has `conflict` and `relax`, a feasible one all the others but those of a
/// stack, which has `shots` alone, with `field` the framing of the first beside them, or `reason` where there can be
/// none.
class LENSD_API PlanAnswer : public Value {
 public:
  /// There is such a setting.
  bool feasible() const;
  /// The f-number: the focal length at extension 0 over the opening.
  std::optional<double> fNumber() const;
  /// Focal length, zoom and breathing counted.
  std::optional<double> focalLengthMm() const;
  /// Width of the field at the distance of `field`.
  std::optional<double> fieldWidthM() const;
  /// Native position of focus, null where there is no such motor.
  std::optional<double> focusPosition() const;
  /// Native position of the iris, null where there is no such motor.
  std::optional<double> irisPosition() const;
  /// Native position of the zoom, where it moves.
  std::optional<double> zoomPosition() const;
  /// The shots of a stack, from far to near.
  std::vector<StackShot> shots() const;
  /// Why there can be no stack.
  std::optional<std::string> cause() const;
  /// The same in words.
  std::optional<std::string> reason() const;
  /// Diameter of the entrance pupil.
  std::optional<double> apertureDiameterMm() const;
  /// F-number that counts for light at this magnification.
  std::optional<double> workingFNumber() const;
  /// The same for a lens that transmits everything.
  std::optional<double> tStop() const;
  /// Light on the axis relative to an aperture as wide as its distance from the sensor: (A/Z)^2.
  std::optional<double> lightParaxial() const;
  /// The same exactly, 4 sin^2 of half the angle below.
  std::optional<double> lightExact() const;
  /// Angle the aperture subtends at the sensor.
  std::optional<double> subtendedAngleDeg() const;
  /// Image size over object size at the focal plane.
  std::optional<double> magnification() const;
  /// Sensor distance beyond the focal length.
  std::optional<double> extensionMm() const;
  /// Lens centre to sensor.
  std::optional<double> sensorDistanceMm() const;
  /// The focal plane.
  std::optional<double> focalPlaneD() const;
  /// The same as a distance, null at infinity and past it.
  std::optional<double> focalPlaneM() const;
  /// The same from the sensor mark.
  std::optional<double> focusFromSensorM() const;
  /// Worst ratio of all limits.
  std::optional<double> worstRatio() const;
  /// Camera model used: the simplest that is good enough.
  std::optional<std::string> model() const;
  /// Bound on what that model leaves out of the blur that was asked about: geometric blur alone without a wavelength.
  std::optional<double> modelErrorUm() const;
  /// Not told by lensd. `lensctl plan` without a lens says it where no wavelength is given: the diffraction disk at 550
  /// nm and this plan's working f-number, which no limit counts.
  std::optional<double> diffractionUm() const;
  /// The limits, in the order asked.
  std::vector<PlanLimit> limits() const;
  /// What is acceptably sharp, for the objective depth.
  std::optional<PlanAnswerDepthOfField> depthOfField() const;
  /// Names that together are infeasible; without any one of them there is a plan. Beside names of limits: focus
  /// (`focus` of the request), fNumber (apertureMin, apertureMax, stops, or the lens' own), extension (extensionMinMm,
  /// extensionMaxMm, or the lens' own), depth (what the objective depth asks for), positions (those the motors can
  /// take: see Plan).
  std::vector<std::string> conflict() const;
  /// Smallest factor on all limits that makes it feasible, null when none does. Where the conflict is "positions": the
  /// worst ratio of `nearest`.
  std::optional<double> relax() const;
  /// The setting that this factor allows, null where `relax` is. Where the conflict is "positions" its numbers are 0
  /// and mean nothing: `nearest` is that setting.
  std::optional<PlanAnswerRelaxed> relaxed() const;
  /// Something the reader should know.
  std::optional<std::string> note() const;
};

/// What is acceptably sharp, for the objective depth.
class LENSD_API PlanAnswerDepthOfField : public Value {
 public:
  std::optional<double> nearD() const;
  std::optional<double> farD() const;
};

/// The setting that this factor allows, null where `relax` is. Where the conflict is "positions" its numbers are 0 and
/// mean nothing: `nearest` is that setting.
class LENSD_API PlanAnswerRelaxed : public Value {
 public:
  std::optional<double> fNumber() const;
  std::optional<double> extensionMm() const;
  std::optional<double> focalPlaneD() const;
};

/// Something plugged into this machine that a driver would take.
class LENSD_API FoundDevice : public Value {
 public:
  /// The driver.
  std::string driver() const;
  /// As the device names itself.
  std::string model() const;
  /// Serial number, null where it has none.
  std::optional<std::string> serial() const;
  /// Where it is: a device node or an address; null where it has none.
  std::optional<std::string> node() const;
  /// It offers a lens.
  bool lens() const;
  /// It offers a camera.
  bool camera() const;
  /// Lines to paste into the configuration.
  std::string config() const;
  /// Why the daemon could not open it now and what to do; null when it could.
  std::optional<std::string> problem() const;
  /// Lens of the configuration that has it; null when none has.
  std::optional<std::string> usedBy() const;
};

/// A driver that could not search.
class LENSD_API FailedSearch : public Value {
 public:
  /// The driver.
  std::string driver() const;
  /// Why.
  std::string message() const;
};

/// Who has a lens for itself.
class LENSD_API LeaseInfo : public Value {
 public:
  /// The program, process and user that took it, or renewed it last.
  std::string holder() const;
  /// When it ends, null: with the connection it was taken on.
  std::optional<std::int64_t> untilNs() const;
};

/// How far something has come: exactly one field is set.
class LENSD_API Progress : public Value {
 public:
  /// An axis is under way.
  std::optional<MoveProgress> move() const;
  /// An autofocus is, with the lens' own camera or in a session.
  std::optional<AutofocusProgress> autofocus() const;
  /// A measurement of backlash is.
  std::optional<BacklashProgress> backlash() const;
};

/// An axis complains of something, or of nothing any more.
class LENSD_API FaultChange : public Value {
 public:
  /// Which one.
  std::string axis() const;
  /// What the device complains of, null: of nothing any more.
  std::optional<std::string> fault() const;
};

/// The readings of a thermometer are left out, or are believed again.
class LENSD_API ThermometerChange : public Value {
 public:
  /// Why they are left out, null: they are believed again.
  std::optional<std::string> fault() const;
};

/// A lease changed. renewed: by the same holder, or its lens was opened anew and it goes on. takenOver: by another one,
/// who gave its key.
class LENSD_API LeaseChange : public Value {
 public:
  /// What became of it.
  std::string change() const;
  /// Who has it, or had it.
  std::string holder() const;
  /// When it ends or would have ended, null: with the connection it was taken on.
  std::optional<std::int64_t> untilNs() const;
  /// Why it ended, otherwise null. dropped: by a call of DropLease. expired: its time was over. disconnected: the
  /// connection it was taken on closed. reopened: the configuration was read again, and has no such lens any more.
  std::optional<std::string> cause() const;
};

/// The calibration of a lens changed, its backlash included: GetCalibration tells what is in force.
class LENSD_API CalibrationChange : public Value {
 public:
  /// How far it can be trusted now.
  std::string grade() const;
  /// Greatest error in extension, null where it is not known.
  std::optional<double> errorUm() const;
  /// It could be written. False: it is forgotten when lensd ends.
  bool kept() const;
};

/// The presets of a lens changed.
class LENSD_API PresetChange : public Value {
 public:
  /// saved: in place of what had this label, if anything had.
  std::string change() const;
  /// Which one.
  std::string label() const;
};

/// What there is changed. opened: the lens answers, and what List says of it may be new. gone: it does not answer.
/// added, removed, reopened: by Reload.
class LENSD_API ListChange : public Value {
 public:
  /// What changed.
  std::string change() const;
  /// Whether it answers now, null where Reload changed the list.
  std::optional<std::string> connection() const;
  /// Why, null where there is nothing to say.
  std::optional<std::string> reason() const;
};

/// Something that happened to a lens: exactly one of the fields from `status` on is set. status and progress are
/// passing: a newer one of the same lens (and axis) stands for those that were left out before it. All others are
/// lasting: none is left out. Both numbers count what happened to this lens in this run of lensd, whether a client
/// looked on or not, and rise within a stream; lensd opens a lens anew without counting anew. From one event of a lens
/// to the next of it that a client was told, also over another connection, as long as `instance` is the same: the
/// difference of `sequence` is how many events it was not told, the second one itself included, and that of `lasting`
/// how many of these were lasting. (The states that a stream begins with are no events of their own: nothing is to be
/// taken off there.) Within one stream none of those left out is lasting.
class LENSD_API Event : public Value {
 public:
  /// Name of this run of lensd, as in List. Another one: lensd began anew, and so did the numbers; it cannot be told
  /// what happened meanwhile.
  std::string instance() const;
  /// The lens it happened to.
  std::string lens() const;
  /// Counts all events of this lens. The states that a stream begins with happen at no time of their own: they carry
  /// the number of what happened last, 0 where nothing has.
  std::int64_t sequence() const;
  /// How many of those, up to this one, are lasting.
  std::int64_t lasting() const;
  /// The state of a lens: first of every lens, then at each change, and before every lasting event that goes with a
  /// change.
  std::optional<LensStatus> status() const;
  /// Something has come further.
  std::optional<Progress> progress() const;
  /// A move or homing ended by itself. One that was stopped or displaced has no result: its caller alone is told.
  std::optional<MoveResult> move() const;
  /// An autofocus ended by itself.
  std::optional<AutofocusResult> autofocus() const;
  /// A measurement of backlash ended by itself, or backlash was said.
  std::optional<BacklashResult> backlash() const;
  /// An axis complains, or not any more.
  std::optional<FaultChange> fault() const;
  /// What the lens' thermometer reports cannot be, or can be again.
  std::optional<ThermometerChange> thermometer() const;
  /// A lease changed.
  std::optional<LeaseChange> lease() const;
  /// The calibration changed.
  std::optional<CalibrationChange> calibration() const;
  /// The presets changed.
  std::optional<PresetChange> preset() const;
  /// Lenses came or went.
  std::optional<ListChange> list() const;
  /// Feature "refocus". lensd has corrected focus by itself, or tried to.
  std::optional<Refocus> refocus() const;
};

/// Up to where a stream has told of a lens, as in Event.
class LENSD_API EventMark : public Value {
 public:
  /// The lens.
  std::string lens() const;
  /// `sequence` of the last event of it.
  std::int64_t sequence() const;
  /// `lasting` of the last event of it.
  std::int64_t lasting() const;
};

/// A focus position whose focus is known: exactly one of the distance, the vergence and the extension.
class LENSD_API CalibrationPoint : public Value {
 public:
  /// Native focus position.
  double position() const;
  CalibrationPoint& position(double value);
  /// Distance of what is in focus there, from where distanceFrom of Calibrate says.
  std::optional<double> distanceM() const;
  CalibrationPoint& distanceM(double value);
  /// Vergence of what is in focus there, at the lens centre.
  std::optional<double> vergenceD() const;
  CalibrationPoint& vergenceD(double value);
  /// Sensor distance beyond the focal length there.
  std::optional<double> extensionMm() const;
  CalibrationPoint& extensionMm(double value);
};

/// The calibration of a lens as it is in force.
class LENSD_API CalibrationInfo : public Value {
 public:
  /// Name of the lens.
  std::string lens() const;
  /// How far focus can be trusted now. `toml` may name another grade: where it has no curve of focus (backlash alone),
  /// or none for the conditions of this moment.
  std::string grade() const;
  /// Greatest error in extension, null where it is not known.
  std::optional<double> errorUm() const;
  /// File it is kept in, which may not be there yet; null: it is not kept, and forgotten at the daemon's end. A path
  /// that is not absolute starts where lensd was started.
  std::optional<std::string> file() const;
  /// What is kept: curves, backlash, or both. Null: nothing.
  std::optional<std::string> toml() const;
};

/// What is known of the backlash of an axis.
class LENSD_API BacklashResult : public Value {
 public:
  /// Name of the lens.
  std::string lens() const;
  /// Which axis.
  std::string axis() const;
  /// It is known now. False: it could not be measured, and what was known before stays.
  bool known() const;
  /// It was measured; otherwise the user stated it.
  bool measured() const;
  /// Native units that a reversal loses.
  std::optional<double> size() const;
  /// Low end of the 95 % confidence interval.
  std::optional<double> sizeLow() const;
  /// High end of the 95 % confidence interval: as much is taken up at every reversal.
  std::optional<double> sizeHigh() const;
  /// Frames it took.
  std::int64_t frames() const;
  /// Time it took.
  double elapsedMs() const;
  /// Why it was not measured, or what keeps it from being in force; null when there is nothing to say.
  std::optional<std::string> cause() const;
  /// The same in words.
  std::optional<std::string> reason() const;
};

/// A measurement of backlash under way.
class LENSD_API BacklashProgress : public Value {
 public:
  /// Sweep, from 1.
  std::int64_t sweep() const;
  /// Sweeps expected in all.
  std::int64_t sweepsExpected() const;
  /// Frames used so far.
  std::int64_t frames() const;
};

/// A lens state under a label.
class LENSD_API Preset : public Value {
 public:
  /// Its label.
  std::string label() const;
  /// When it was saved: date and time, UTC.
  std::string saved() const;
  /// Native position of focus, null: no such axis.
  std::optional<double> focusPosition() const;
  /// The same of the iris.
  std::optional<double> irisPosition() const;
  /// The same of the zoom.
  std::optional<double> zoomPosition() const;
  /// Place of the filter wheel.
  std::optional<double> filterPosition() const;
  /// Focus was approached moving toward larger positions.
  bool approachUp() const;
  /// Vergence of the plane in focus, null where the optics or the place of focus were not known.
  std::optional<double> vergenceD() const;
  /// The true one was within this of it, as far as Grade says.
  std::optional<double> vergenceBoundD() const;
  /// The same plane as a distance, null at infinity and past it.
  std::optional<double> focalPlaneM() const;
  /// F-number.
  std::optional<double> fNumber() const;
  /// Focal length at extension 0, without breathing.
  std::optional<double> focalLengthMm() const;
  /// Temperature of the lens.
  std::optional<double> temperatureC() const;
  /// How far the focus position could be trusted.
  std::string grade() const;
};

/// A preset recalled.
class LENSD_API RecallResult : public Value {
 public:
  /// Name of the lens.
  std::string lens() const;
  /// The preset.
  std::string label() const;
  /// Every axis is where the preset had it.
  bool reached() const;
  /// The plane in focus is within this of the one that was saved; null where the preset or the lens has no vergence.
  std::optional<double> vergenceBoundD() const;
  /// Focus is within this of the place that was saved, in native units; told where vergenceBoundD is not.
  std::optional<double> positionBound() const;
  /// What was moved, in order.
  std::vector<MoveResult> moves() const;
  /// Something the reader should know.
  std::optional<std::string> note() const;
};

/// Feature "focusAt". One coordinate that is not the lens's own, such as that of a stage: as the client names and
/// counts it.
class LENSD_API FocusAtValue : public Value {
 public:
  /// Its name.
  std::string name() const;
  FocusAtValue& name(const std::string& value);
  /// Its value.
  double value() const;
  FocusAtValue& value(double value);
  /// Its unit, null where it has none.
  std::optional<std::string> unit() const;
  FocusAtValue& unit(const std::string& value);
};

/// Feature "focusAt". Focus as it was found at one place.
class LENSD_API FocusAtSample : public Value {
 public:
  /// The place.
  std::vector<FocusAtValue> at() const;
  /// Native position of focus, as it was found.
  double position() const;
  /// Standard deviation of that.
  double sigma() const;
  /// By how much what it says of this moment is off the surface; null where there is no surface.
  std::optional<double> off() const;
  /// It is too far off to lie on the surface, and was left out of the fit.
  bool outlier() const;
  /// Temperature that it was found at, null where there is no thermometer.
  std::optional<double> temperatureC() const;
  /// Where the zoom stood, null where there is none.
  std::optional<double> zoomPosition() const;
  /// Where the filter stood, null where there is none.
  std::optional<double> filterPosition() const;
  /// F-number that it was found at, null where it is not known.
  std::optional<double> fNumber() const;
  /// When: date and time, UTC.
  std::string made() const;
};

/// Feature "focusAt". What is known of focus over coordinates that are not the lens's own.
class LENSD_API FocusAtSurface : public Value {
 public:
  /// Name of the lens.
  std::string lens() const;
  /// The samples, oldest first. The first has the number 1.
  std::vector<FocusAtSample> samples() const;
  /// There is a surface through them now.
  bool fitted() const;
  /// Why there is none; null where there is.
  std::optional<std::string> reason() const;
  /// The least of each coordinate that the surface covers; null where there is none.
  std::vector<FocusAtValue> low() const;
  /// The greatest of each.
  std::vector<FocusAtValue> high() const;
  /// It is curved, not a plane; null where there is none.
  std::optional<bool> curved() const;
  /// Standard deviation by which samples are off the surface beyond their own; null where there is none.
  std::optional<double> scatter() const;
  /// What the temperature has added to the samples since, on average; null where there is no surface.
  std::optional<double> correction() const;
  /// Where another sample would tell most: an outlier again, once, else where the surface is least sure. Null: nowhere,
  /// or there is no surface.
  std::vector<FocusAtValue> next() const;
  /// What the samples do not tell, and which to forget; null where there is nothing to say.
  std::optional<std::string> note() const;
};

/// Feature "focusAt". Focus as the surface has it at one place.
class LENSD_API FocusAtPlace : public Value {
 public:
  /// The place.
  std::vector<FocusAtValue> at() const;
  /// Native position of focus.
  double position() const;
  /// Standard deviation of that.
  double sigma() const;
  /// Vergence in focus there, null where the optics are not known.
  std::optional<double> vergenceD() const;
  /// Standard deviation of that, null where vergenceD is.
  std::optional<double> sigmaD() const;
  /// What the samples do not tell, null where there is nothing to say.
  std::optional<std::string> note() const;
};

/// Feature "refocus". One correction of focus that lensd made by itself, or tried to ([lens.refocus] of the
/// configuration).
class LENSD_API Refocus : public Value {
 public:
  /// Name of the lens.
  std::string lens() const;
  /// When it ended.
  std::int64_t atNs() const;
  /// What started it.
  std::string cause() const;
  /// How it ended.
  std::string end() const;
  /// Why that way, for people.
  std::string reason() const;
  /// Temperature then, null where there is no thermometer.
  std::optional<double> temperatureC() const;
  /// Where focus stands since, null where that is not known.
  std::optional<double> position() const;
  /// By how much extension it was moved; null where it was searched, or the optics are not known.
  std::optional<double> byUm() const;
};

/// Feature "refocus". What one autofocus has told of focus and temperature.
class LENSD_API DriftResult : public Value {
 public:
  /// Results with the same number are of the same thing under the same conditions.
  std::int64_t subject() const;
  /// Temperature then.
  double temperatureC() const;
  /// Extension of the position where focus was found, corrected for no temperature.
  double extensionUm() const;
  /// Standard deviation of that.
  double sigmaUm() const;
  /// By how much it is off what the coefficient says; 0 where there is none.
  double offUm() const;
  /// It does not go with the others, and was left out.
  bool outlier() const;
  /// When: date and time, UTC.
  std::string made() const;
};

/// Feature "refocus". How focus goes with the temperature, learned from autofocus results alone.
class LENSD_API FocusDrift : public Value {
 public:
  /// Micrometres of extension gained per degree at one focus position, as `um_per_c` of [lens.temperature] has it.
  double umPerC() const;
  /// Its 95 % interval.
  double lowUmPerC() const;
  /// Its upper end.
  double highUmPerC() const;
  /// Lowest temperature that it was learned at.
  double coldestC() const;
  /// Highest temperature that it was learned at.
  double hottestC() const;
  /// Number of results that it was learned from.
  std::int64_t results() const;
};

/// Feature "refocus". What lensd does by itself to keep a lens in focus.
class LENSD_API RefocusState : public Value {
 public:
  /// Name of the lens.
  std::string lens() const;
  /// An autofocus has reached focus, and lensd looks after it.
  bool active() const;
  /// Why it does not, or what a correction that is due waits for; null where neither is so.
  std::optional<std::string> reason() const;
  /// What was learned; null where that is too little.
  std::optional<FocusDrift> drift() const;
  /// What is missing then.
  std::optional<std::string> driftReason() const;
  /// What it was learned from, oldest first; at most 200. The first has the number 1.
  std::vector<DriftResult> results() const;
  /// The newest correction since the lens was configured; null where there was none.
  std::optional<Refocus> last() const;
};

/// Feature "learned". What one autofocus has shown of the blur that a step of focus makes.
class LENSD_API LearnedRun : public Value {
 public:
  /// That blur over the one that the configuration and the calibration told at that time.
  double shown() const;
  /// Native focus position at the end.
  double position() const;
  /// Pixels of blur that a native unit of focus makes there.
  double blurPxPerUnit() const;
  /// Pitch of the pixels as it was told.
  double pixelUm() const;
  /// Where the iris stood, null where the lens has no motorised one.
  std::optional<double> irisPosition() const;
  /// Where the zoom stood, likewise.
  std::optional<double> zoomPosition() const;
  /// The frames were those of a client (AutofocusBegin).
  bool framesFromOutside() const;
  /// Feature "learnedSides". Blur at extensions above that of focus over blur as far below it; null where too few
  /// frames were taken to tell.
  std::optional<double> aboveOverBelow() const;
  /// It counts for a search as the lens stands now, with iris and zoom there and with frames from where the newest run
  /// had them.
  bool holds() const;
  /// When that was (UTC), for people.
  std::string made() const;
};

/// Feature "learned". What autofocus has taught lensd of a lens.
class LENSD_API LearnedState : public Value {
 public:
  /// Name of the lens.
  std::string lens() const;
  /// What the next search goes by, as the lens stands now and with frames from where the newest run had them (the lens'
  /// own camera, or a client); null: by what is told.
  std::optional<KnownSlope> known() const;
  /// Why that is null, or that the file of it cannot be read and nothing more is kept; null otherwise.
  std::optional<std::string> reason() const;
  /// What it was learned from, oldest first; at most 200.
  std::vector<LearnedRun> runs() const;
};

/// A lens brought back.
class LENSD_API UndoResult : public Value {
 public:
  /// Name of the lens.
  std::string lens() const;
  /// There was something to undo, and every axis is where it was.
  bool undone() const;
  /// The plane in focus is within this of the one before; null where the lens had no vergence then, or has none now.
  std::optional<double> vergenceBoundD() const;
  /// Focus is within this of its place before, in native units; told where vergenceBoundD is not.
  std::optional<double> positionBound() const;
  /// What was moved, in order.
  std::vector<MoveResult> moves() const;
  /// Something the reader should know: why nothing was undone, for instance.
  std::optional<std::string> note() const;
};

/// The answer to List.
class LENSD_API ListReply : public Value {
 public:
  std::vector<LensInfo> lenses() const;
  std::string instance() const;
  std::vector<std::string> features() const;
};

/// Every configured lens; the name of this run of lensd, another one at each start; and the names of what was added to
/// this interface since 1.0.
class LENSD_API ListParameters : public Value {
 public:
  using Reply = ListReply;
  static const char* Method() { return "List"; }
};

/// The answer to Devices.
class LENSD_API DevicesReply : public Value {
 public:
  std::vector<FoundDevice> devices() const;
  std::vector<FailedSearch> failed() const;
};

/// What is plugged in, as far as drivers can search for it: buses without names (RS-485) and distant networks are not
/// searched. Disturbs nothing that is in use; takes up to some seconds.
class LENSD_API DevicesParameters : public Value {
 public:
  using Reply = DevicesReply;
  static const char* Method() { return "Devices"; }
};

/// The answer to Reload.
class LENSD_API ReloadReply : public Value {
 public:
  std::vector<std::string> added() const;
  std::vector<std::string> removed() const;
  std::vector<std::string> reopened() const;
  std::vector<std::string> unchanged() const;
};

/// Reads the configuration again. Lenses whose configuration is the same go on undisturbed, also where a file that it
/// names has changed; one whose configuration is another one stops, answers its callers with Cancelled, and is opened
/// anew; it keeps its lease. A configuration with a mistake is refused whole (BadConfiguration), and all stays as it
/// is. Unsupported: lensd has none. Busy: that was done too often, or too much waits to be read. `added`, `removed`,
/// `reopened` and `unchanged` are names of lenses. Feature "leftOut": a lens of which a part was left out because its
/// device, or the way to it, failed is opened anew too.
class LENSD_API ReloadParameters : public Value {
 public:
  using Reply = ReloadReply;
  static const char* Method() { return "Reload"; }
};

/// The answer to Status.
class LENSD_API StatusReply : public Value {
 public:
  std::vector<LensStatus> lenses() const;
};

/// The state of one lens, or of all when `lens` is left out. With `more`: now, and then each change of a lens.
class LENSD_API StatusParameters : public Value {
 public:
  using Reply = StatusReply;
  static const char* Method() { return "Status"; }
  StatusParameters& lens(const std::string& value);
};

/// The answer to Metrics.
class LENSD_API MetricsReply : public Value {
 public:
  std::vector<LensMetrics> lenses() const;
  std::optional<DaemonMetrics> daemon() const;
};

/// What one lens has done and what went wrong, or all of them when `lens` is left out; and lensd itself.
class LENSD_API MetricsParameters : public Value {
 public:
  using Reply = MetricsReply;
  static const char* Method() { return "Metrics"; }
  MetricsParameters& lens(const std::string& value);
};

/// The answer to Monitor.
class LENSD_API MonitorReply : public Value {
 public:
  Event event() const;
};

/// What happens to one lens, or to all when `lens` is left out, also to those that are added later. Needs `more`; ends
/// by itself when the one lens is taken out of the configuration (LensNotFound). States and progress come at least
/// minIntervalMs apart (10 to 10000; 40 when left out), and only once the caller has read what came before: of each
/// lens the newest state, of each of its axes and procedures the newest progress. Everything else comes at once, each
/// time, with what waited to be told of that lens before it. Overrun: even that came faster than it was read.
class LENSD_API MonitorParameters : public Value {
 public:
  using Reply = MonitorReply;
  static const char* Method() { return "Monitor"; }
  MonitorParameters& lens(const std::string& value);
  MonitorParameters& minIntervalMs(double value);
};

/// The answer to Move.
class LENSD_API MoveReply : public Value {
 public:
  std::optional<MoveProgress> progress() const;
  std::optional<MoveResult> move() const;
};

/// Moves one axis and answers when it has settled. distanceFrom says where distanceM starts and counts for nothing
/// else; the configuration decides when it is left out. With `more`, `progress` comes until `move` ends the call.
/// keepFocus is for the zoom: focus follows so that the plane in focus stays, off by at most trackingToleranceUm (which
/// counts for nothing else) on the way: two pixels of blur when left out. What steps, backlash and calibration leave
/// unknown counts as well: where that alone takes most of it, trackingBoundUm of the answer is larger. keepBrightness
/// is for the iris: the exposure follows.
class LENSD_API MoveParameters : public Value {
 public:
  using Reply = MoveReply;
  static const char* Method() { return "Move"; }
  MoveParameters& lens(const std::string& value);
  MoveParameters& axis(const std::string& value);
  MoveParameters& target(const Target& value);
  MoveParameters& distanceFrom(const std::string& value);
  MoveParameters& keepFocus(bool value);
  MoveParameters& trackingToleranceUm(double value);
  MoveParameters& keepBrightness(bool value);
  MoveParameters& lease(const std::string& value);
};

/// The answer to GetCalibration.
class LENSD_API GetCalibrationReply : public Value {
 public:
  CalibrationInfo calibration() const;
};

/// The calibration of a lens.
class LENSD_API GetCalibrationParameters : public Value {
 public:
  using Reply = GetCalibrationReply;
  static const char* Method() { return "GetCalibration"; }
  GetCalibrationParameters& lens(const std::string& value);
};

/// The answer to Calibrate.
class LENSD_API CalibrateReply : public Value {
 public:
  CalibrationInfo calibration() const;
};

/// Changes it, by exactly one of three: a whole file (`toml`); a focus curve for the zoom, filter and temperature of
/// this moment from `points`, several of which may be of the same depth; or back to the nominal figures (`remove`). The
/// other parameters count with `points` alone: errorUm is the curve's error, estimated from at least four depths when
/// left out; `approximate` says that it is not measured; `made` is a remark that is kept. It is kept in the file the
/// configuration names, else in the daemon's state folder. Busy: an axis moves. BadData: what `toml` says. OutOfRange:
/// a distance too short to be in front of the lens. InvalidRequest: a depth inside the focal length. NotKept: it is in
/// force, and could not be written.
class LENSD_API CalibrateParameters : public Value {
 public:
  using Reply = CalibrateReply;
  static const char* Method() { return "Calibrate"; }
  CalibrateParameters& lens(const std::string& value);
  CalibrateParameters& toml(const std::string& value);
  CalibrateParameters& points(const std::vector<CalibrationPoint>& value);
  CalibrateParameters& distanceFrom(const std::string& value);
  CalibrateParameters& errorUm(double value);
  CalibrateParameters& approximate(bool value);
  CalibrateParameters& made(const std::string& value);
  CalibrateParameters& remove(bool value);
  CalibrateParameters& lease(const std::string& value);
};

/// The answer to MeasureBacklash.
class LENSD_API MeasureBacklashReply : public Value {
 public:
  std::optional<BacklashProgress> progress() const;
  std::optional<BacklashResult> backlash() const;
};

/// Measures the backlash of focus on a region of the picture (the camera's own when left out), by 3 to 100 pairs of
/// sweeps (5 when left out), or takes that of any axis from `size`, in native units: then pairs and region do not
/// count. It is kept with the calibration. With `more`, `progress` comes until `backlash` ends the call. Busy: an axis
/// moves, or an autofocus is under way. OutOfRange: a size above a tenth of the travel.
class LENSD_API MeasureBacklashParameters : public Value {
 public:
  using Reply = MeasureBacklashReply;
  static const char* Method() { return "MeasureBacklash"; }
  MeasureBacklashParameters& lens(const std::string& value);
  MeasureBacklashParameters& axis(const std::string& value);
  MeasureBacklashParameters& size(double value);
  MeasureBacklashParameters& pairs(std::int64_t value);
  MeasureBacklashParameters& region(const Region& value);
  MeasureBacklashParameters& lease(const std::string& value);
};

/// The answer to MeasureFocusShift.
class LENSD_API MeasureFocusShiftReply : public Value {
 public:
  std::optional<FocusShiftProgress> progress() const;
  std::optional<FocusShiftResult> shift() const;
};

/// Feature "searchConditions". Measures how focus shifts from `conditions`, which have exactly one of fNumber and
/// filterPosition (and the exposure that goes with it), to the conditions that the lens is in: 3 to 20 pairs of
/// searches (5 when left out) by sweep on a region of the picture, which must stay as it is. It is kept with the
/// calibration, in place of what was measured for the same pair; an Autofocus with such conditions goes on by it. With
/// `more`, `progress` comes until `shift` ends the call. Busy: an axis moves, or an autofocus is under way. Otherwise
/// as Autofocus.
class LENSD_API MeasureFocusShiftParameters : public Value {
 public:
  using Reply = MeasureFocusShiftReply;
  static const char* Method() { return "MeasureFocusShift"; }
  MeasureFocusShiftParameters& lens(const std::string& value);
  MeasureFocusShiftParameters& conditions(const SearchConditions& value);
  MeasureFocusShiftParameters& pairs(std::int64_t value);
  MeasureFocusShiftParameters& region(const Region& value);
  MeasureFocusShiftParameters& lease(const std::string& value);
};

/// The answer to ListFocusShifts.
class LENSD_API ListFocusShiftsReply : public Value {
 public:
  std::vector<FocusShift> shifts() const;
};

/// Feature "searchConditions". The shifts of focus that were measured of a lens.
class LENSD_API ListFocusShiftsParameters : public Value {
 public:
  using Reply = ListFocusShiftsReply;
  static const char* Method() { return "ListFocusShifts"; }
  ListFocusShiftsParameters& lens(const std::string& value);
};

/// The answer to RemoveFocusShift.
class LENSD_API RemoveFocusShiftReply : public Value {
 public:
};

/// Feature "searchConditions". Forgets the shift between two f-numbers or between two filters, whichever way round.
/// InvalidRequest: none is known of them.
class LENSD_API RemoveFocusShiftParameters : public Value {
 public:
  using Reply = RemoveFocusShiftReply;
  static const char* Method() { return "RemoveFocusShift"; }
  RemoveFocusShiftParameters& lens(const std::string& value);
  RemoveFocusShiftParameters& fromFNumber(double value);
  RemoveFocusShiftParameters& toFNumber(double value);
  RemoveFocusShiftParameters& fromFilter(double value);
  RemoveFocusShiftParameters& toFilter(double value);
  RemoveFocusShiftParameters& lease(const std::string& value);
};

/// The answer to FocusAtAdd.
class LENSD_API FocusAtAddReply : public Value {
 public:
  FocusAtSurface surface() const;
};

/// Feature "focusAt". Adds a sample to the surface of focus: the newest Autofocus or session that was sure, as it found
/// focus at the place `at`, or `position` with its standard deviation `sigma`. One autofocus makes one sample. One to
/// three coordinates, always the same and in the same order. It is kept with the calibration. Unsupported: the zoom,
/// the filter, the wavelength or the side that focus is approached from are others than those of the samples, or the
/// temperature is, by more than 2 C, and the lens has no coefficient that is used. OutOfRange: 30 samples are kept
/// already, or focus cannot stand there. InvalidRequest: no autofocus to take; other coordinates. Busy: an axis moves.
/// NotHomed: an axis has lost its reference. NotKept: it is in force, and could not be written.
class LENSD_API FocusAtAddParameters : public Value {
 public:
  using Reply = FocusAtAddReply;
  static const char* Method() { return "FocusAtAdd"; }
  FocusAtAddParameters& lens(const std::string& value);
  FocusAtAddParameters& at(const std::vector<FocusAtValue>& value);
  FocusAtAddParameters& position(double value);
  FocusAtAddParameters& sigma(double value);
  FocusAtAddParameters& lease(const std::string& value);
};

/// The answer to FocusAtGet.
class LENSD_API FocusAtGetReply : public Value {
 public:
  FocusAtSurface surface() const;
  std::optional<FocusAtPlace> place() const;
};

/// Feature "focusAt". What is known, and with `at` where focus lies there, as FocusAt has it. OutOfRange, Unsupported:
/// as of FocusAt.
class LENSD_API FocusAtGetParameters : public Value {
 public:
  using Reply = FocusAtGetReply;
  static const char* Method() { return "FocusAtGet"; }
  FocusAtGetParameters& lens(const std::string& value);
  FocusAtGetParameters& at(const std::vector<FocusAtValue>& value);
};

/// The answer to FocusAt.
class LENSD_API FocusAtReply : public Value {
 public:
  FocusAtPlace place() const;
  MoveResult move() const;
};

/// Feature "focusAt". Moves focus to where the surface has it at a place. OutOfRange: outside the samples, or too few
/// of them. Unsupported: other conditions than those of the samples, as of FocusAtAdd. Otherwise as Move.
class LENSD_API FocusAtParameters : public Value {
 public:
  using Reply = FocusAtReply;
  static const char* Method() { return "FocusAt"; }
  FocusAtParameters& lens(const std::string& value);
  FocusAtParameters& at(const std::vector<FocusAtValue>& value);
  FocusAtParameters& lease(const std::string& value);
};

/// The answer to FocusAtForget.
class LENSD_API FocusAtForgetReply : public Value {
 public:
  std::optional<bool> removed() const;
};

/// Feature "focusAt". Forgets all samples, or one of them, by its number from 1. InvalidRequest: there is no such
/// sample. NotKept: it is in force, and could not be written. `removed` says that there was something to forget.
class LENSD_API FocusAtForgetParameters : public Value {
 public:
  using Reply = FocusAtForgetReply;
  static const char* Method() { return "FocusAtForget"; }
  FocusAtForgetParameters& lens(const std::string& value);
  FocusAtForgetParameters& sample(std::int64_t value);
  FocusAtForgetParameters& lease(const std::string& value);
};

/// The answer to GetRefocus.
class LENSD_API GetRefocusReply : public Value {
 public:
  RefocusState refocus() const;
};

/// Feature "refocus". What lensd does by itself to keep a lens in focus, and what it has learned for that.
class LENSD_API GetRefocusParameters : public Value {
 public:
  using Reply = GetRefocusReply;
  static const char* Method() { return "GetRefocus"; }
  GetRefocusParameters& lens(const std::string& value);
};

/// The answer to ForgetDrift.
class LENSD_API ForgetDriftReply : public Value {
 public:
};

/// Feature "refocus". Forgets what was learned of focus and temperature, or one result of that, by its number from 1.
/// InvalidRequest: there is no such result. NotKept: it is in force, and could not be written.
class LENSD_API ForgetDriftParameters : public Value {
 public:
  using Reply = ForgetDriftReply;
  static const char* Method() { return "ForgetDrift"; }
  ForgetDriftParameters& lens(const std::string& value);
  ForgetDriftParameters& result(std::int64_t value);
  ForgetDriftParameters& lease(const std::string& value);
};

/// The answer to GetLearned.
class LENSD_API GetLearnedReply : public Value {
 public:
  LearnedState learned() const;
};

/// Feature "learned". What autofocus has taught lensd of a lens: the blur that a step of focus makes. Disconnected: the
/// lens has not been there since lensd began; of one that has gone it is told.
class LENSD_API GetLearnedParameters : public Value {
 public:
  using Reply = GetLearnedReply;
  static const char* Method() { return "GetLearned"; }
  GetLearnedParameters& lens(const std::string& value);
};

/// The answer to ForgetLearned.
class LENSD_API ForgetLearnedReply : public Value {
 public:
};

/// Feature "learned". Forgets all of it: the next searches go by what is told, and learn anew. NotKept: it is in force,
/// and could not be written.
class LENSD_API ForgetLearnedParameters : public Value {
 public:
  using Reply = ForgetLearnedReply;
  static const char* Method() { return "ForgetLearned"; }
  ForgetLearnedParameters& lens(const std::string& value);
  ForgetLearnedParameters& lease(const std::string& value);
};

/// The answer to KeepDirection.
class LENSD_API KeepDirectionReply : public Value {
 public:
};

/// Feature "direction". Remembers, also when lensd is restarted, which way focus counts, as a measurement of this
/// device has shown it (`lensctl setup --at` makes one); null forgets it. It counts from now on where neither the
/// configuration nor a calibration says another; where they do, `warnings` of LensStatus tells of it. Unsupported: no
/// motorised focus. Busy: an axis moves, or an autofocus is under way. NotKept: it is in force, and could not be
/// written.
class LENSD_API KeepDirectionParameters : public Value {
 public:
  using Reply = KeepDirectionReply;
  static const char* Method() { return "KeepDirection"; }
  KeepDirectionParameters& lens(const std::string& value);
  KeepDirectionParameters& direction(const std::string& value);
  KeepDirectionParameters& lease(const std::string& value);
};

/// The answer to PresetSave.
class LENSD_API PresetSaveReply : public Value {
 public:
  Preset preset() const;
};

/// Saves the state of a lens under a label, in place of what was there. Busy: an axis moves. NotKept: nothing was
/// saved. OutOfRange: 1000 are saved already. NotHomed: an axis has lost its reference, so nobody knows where it
/// stands.
class LENSD_API PresetSaveParameters : public Value {
 public:
  using Reply = PresetSaveReply;
  static const char* Method() { return "PresetSave"; }
  PresetSaveParameters& lens(const std::string& value);
  PresetSaveParameters& label(const std::string& value);
  PresetSaveParameters& lease(const std::string& value);
};

/// The answer to PresetList.
class LENSD_API PresetListReply : public Value {
 public:
  std::vector<Preset> presets() const;
};

/// The presets of a lens, in the order of their labels. BadData, DeviceError: the file they are kept in cannot be read.
class LENSD_API PresetListParameters : public Value {
 public:
  using Reply = PresetListReply;
  static const char* Method() { return "PresetList"; }
  PresetListParameters& lens(const std::string& value);
};

/// The answer to PresetRecall.
class LENSD_API PresetRecallReply : public Value {
 public:
  RecallResult recall() const;
};

/// Brings zoom, filter, iris and focus back to the same optical state: by today's calibration and temperature.
/// PresetNotFound: there is none of that label. BadData, DeviceError: as of PresetList.
class LENSD_API PresetRecallParameters : public Value {
 public:
  using Reply = PresetRecallReply;
  static const char* Method() { return "PresetRecall"; }
  PresetRecallParameters& lens(const std::string& value);
  PresetRecallParameters& label(const std::string& value);
  PresetRecallParameters& lease(const std::string& value);
};

/// The answer to PresetRemove.
class LENSD_API PresetRemoveReply : public Value {
 public:
};

/// Forgets a preset. PresetNotFound: there is none of that label. NotKept: it is still there. BadData, DeviceError: as
/// of PresetList.
class LENSD_API PresetRemoveParameters : public Value {
 public:
  using Reply = PresetRemoveReply;
  static const char* Method() { return "PresetRemove"; }
  PresetRemoveParameters& lens(const std::string& value);
  PresetRemoveParameters& label(const std::string& value);
  PresetRemoveParameters& lease(const std::string& value);
};

/// The answer to Undo.
class LENSD_API UndoReply : public Value {
 public:
  UndoResult undo() const;
};

/// Feature "undo". Brings zoom, filter, iris and focus back to the optical state in which the lens last stood before it
/// was brought where it is, by whichever client; once more: forth again. What counts as one step is a whole call: an
/// autofocus, a recall, a plan that was applied. lensd knows the last two states of a lens since it began, and forgets
/// them at its end. NotHomed: an axis has lost its reference.
class LENSD_API UndoParameters : public Value {
 public:
  using Reply = UndoReply;
  static const char* Method() { return "Undo"; }
  UndoParameters& lens(const std::string& value);
  UndoParameters& lease(const std::string& value);
};

/// The answer to Home.
class LENSD_API HomeReply : public Value {
 public:
  std::vector<MoveResult> moves() const;
};

/// Searches for the reference of one axis, or of every axis that has one.
class LENSD_API HomeParameters : public Value {
 public:
  using Reply = HomeReply;
  static const char* Method() { return "Home"; }
  HomeParameters& lens(const std::string& value);
  HomeParameters& axis(const std::string& value);
  HomeParameters& lease(const std::string& value);
};

/// The answer to SetPosition.
class LENSD_API SetPositionReply : public Value {
 public:
};

/// Feature "setPosition". Says where an axis stands that counts its steps and has no reference to search; it moves
/// nothing. From now on its positions count from there, and that is kept: over a restart, and over a loss of power as
/// `restore` of its configuration says. The position is rounded to the axis' resolution. Unsupported: it can be homed,
/// an encoder measures where it stands, or its positions are no counts. Busy: it moves, or a search for focus is under
/// way. OutOfRange: that is not on its travel. Timeout: the device did not say what it counts. NotKept: nothing has
/// changed, because it could not be written.
class LENSD_API SetPositionParameters : public Value {
 public:
  using Reply = SetPositionReply;
  static const char* Method() { return "SetPosition"; }
  SetPositionParameters& lens(const std::string& value);
  SetPositionParameters& axis(const std::string& value);
  SetPositionParameters& position(double value);
  SetPositionParameters& lease(const std::string& value);
};

/// The answer to Stop.
class LENSD_API StopReply : public Value {
 public:
};

/// Stops one axis and any autofocus, or everything the lens does; without `lens` every lens. It acts as soon as it is
/// read, whatever else its connection waits for. Every call that was read before it, on any connection, and moves what
/// is stopped answers Cancelled; its own answer says that the motors were told, and Status' `moving` when they rest,
/// for they brake. Unsupported: what moves cannot stop midway (`canStop`), and travels on. With `latch` no axis of
/// these lenses moves until ResetFaults: until then Status has `latched`, and Move, Home, Autofocus, FocusMap,
/// AutofocusBegin, MeasureBacklash, PresetRecall, Undo, SetExposure and a Plan with `apply` answer Cancelled at once,
/// however often they are repeated. Where it stops every lens, an error is that of one of them; the others are stopped
/// all the same.
class LENSD_API StopParameters : public Value {
 public:
  using Reply = StopReply;
  static const char* Method() { return "Stop"; }
  StopParameters& lens(const std::string& value);
  StopParameters& axis(const std::string& value);
  StopParameters& latch(bool value);
};

/// The answer to ResetFaults.
class LENSD_API ResetFaultsReply : public Value {
 public:
};

/// Ends the latch of Stop, whatever axis is named, and clears the faults that axes complain of, once their cause is
/// gone: one axis', or those of the whole lens. Nothing moves. A fault that the device does not let go of stays and is
/// still told by Status, so that an answer without an error does not say that the device is well, or there. Unsupported
/// where the axis that was named takes no such command.
class LENSD_API ResetFaultsParameters : public Value {
 public:
  using Reply = ResetFaultsReply;
  static const char* Method() { return "ResetFaults"; }
  ResetFaultsParameters& lens(const std::string& value);
  ResetFaultsParameters& axis(const std::string& value);
  ResetFaultsParameters& lease(const std::string& value);
};

/// The answer to TakeLease.
class LENSD_API TakeLeaseReply : public Value {
 public:
  std::string lens() const;
  std::string lease() const;
};

/// Keeps every other client from moving the lens and from changing its calibration, presets, faults and exposure;
/// reading its state and stopping it stay open to all. Without forMs (at most a day) the lease ends with this
/// connection, else with that time. Calls on this connection may move the lens; calls on others give `lease`, the key
/// in the answer. Leased: another client has it. Who has it already, by this connection or by giving the key as
/// `lease`, renews it: the key stays, holder and end are those of this call. An administrator takes it from its holder
/// with `takeOver`: its old key is worth nothing then. While an autofocus or a measurement of backlash of another
/// client goes on it is Busy, or ends that with `stop`.
class LENSD_API TakeLeaseParameters : public Value {
 public:
  using Reply = TakeLeaseReply;
  static const char* Method() { return "TakeLease"; }
  TakeLeaseParameters& lens(const std::string& value);
  TakeLeaseParameters& forMs(double value);
  TakeLeaseParameters& lease(const std::string& value);
  TakeLeaseParameters& takeOver(bool value);
  TakeLeaseParameters& stop(bool value);
};

/// The answer to Hold.
class LENSD_API HoldReply : public Value {
 public:
  std::int64_t untilNs() const;
  bool atRest() const;
};

/// Feature "hold". Whoever exposes with another program's camera keeps the lens from being corrected meanwhile: until
/// untilNs (CLOCK_MONOTONIC, an hour from now at most) what lensd does by itself waits, which is following the
/// temperature, and the next search of an autofocus with `track`. It is no lease: commands of clients are carried out
/// as always, and Stop stops. A correction that has begun goes on to its end: atRest says whether nothing moves and
/// nothing is searched for, so that the exposure may begin. With `more` it answers at once, and again when its time is
/// over. Each connection has one hold a lens, and another call moves its end. It ends then, by Release, with its
/// connection, and when the lens is opened anew.
class LENSD_API HoldParameters : public Value {
 public:
  using Reply = HoldReply;
  static const char* Method() { return "Hold"; }
  HoldParameters& lens(const std::string& value);
  HoldParameters& untilNs(std::int64_t value);
};

/// The answer to Release.
class LENSD_API ReleaseReply : public Value {
 public:
};

/// Feature "hold". Ends the hold of this connection; harmless where there is none. What has waited is done now, unless
/// another one holds.
class LENSD_API ReleaseParameters : public Value {
 public:
  using Reply = ReleaseReply;
  static const char* Method() { return "Release"; }
  ReleaseParameters& lens(const std::string& value);
};

/// The answer to DropLease.
class LENSD_API DropLeaseReply : public Value {
 public:
};

/// Ends a lease that this connection took or whose key is given; harmless where there is none. Leased: it is another
/// client's.
class LENSD_API DropLeaseParameters : public Value {
 public:
  using Reply = DropLeaseReply;
  static const char* Method() { return "DropLease"; }
  DropLeaseParameters& lens(const std::string& value);
  DropLeaseParameters& lease(const std::string& value);
};

/// The answer to Plan.
class LENSD_API PlanReply : public Value {
 public:
  PlanAnswer plan() const;
  std::optional<PlanAnswer> nearest() const;
  std::vector<MoveResult> applied() const;
  std::optional<PlanAnswer> reached() const;
  std::optional<PlanRequest> request() const;
};

/// Finds the position of this lens' motors that meets every limit, and with `apply` moves there. The lens is what it is
/// now: zoom, breathing, temperature, filter. Tolerances cover at least what the motors keep at the position chosen.
/// `nearest` is the position that comes closest where some setting would do and no position does (then the conflict is
/// "positions"). `reached` is how the limits fare where the motors ended, from what is measured of the lens then and
/// within the bounds of all its axes. With `showRequest` the answer has the request as it was understood, depths from
/// the lens centre at that position.
class LENSD_API PlanParameters : public Value {
 public:
  using Reply = PlanReply;
  static const char* Method() { return "Plan"; }
  PlanParameters& lens(const std::string& value);
  PlanParameters& request(const PlanRequest& value);
  PlanParameters& apply(bool value);
  PlanParameters& showRequest(bool value);
  PlanParameters& lease(const std::string& value);
};

/// The answer to Autofocus.
class LENSD_API AutofocusReply : public Value {
 public:
  std::optional<AutofocusProgress> progress() const;
  std::optional<AutofocusResult> autofocus() const;
};

/// Brings a region of the picture into focus, or refuses and puts the lens back. Without a region the camera's own is
/// used; without a method auto is. Methods: auto, defocus, sweep, moving, stars, exhaustive, coarse-fine, golden-
/// section, fibonacci, hill-climb, sweep-parabola, sweep-gaussian, sweep-hyperbola, contrast-scan; docs/interface.md
/// says what each does and needs. Of several `regions` the policy takes the answer: nearest (also when left out),
/// farthest, or widest, by half a depth of field. With `track` (needs `more`) it goes on: it holds focus on the one
/// region, whose subject may move while it is searched for, moves the lens only where the scene has changed, answers
/// each search with `autofocus`, and never ends by itself. It keeps to `range`, whose distances start where
/// distanceFrom says, and goes by `step`, which not every method does (InvalidRequest); both are OutOfRange where this
/// lens cannot. A search may take deadlineMs (an hour at most); when left out, as long as one of the whole range takes,
/// and at least 20000. OutOfRange: so short that the search cannot end; the message says what it needs. Busy: another
/// autofocus is under way on this lens, or its backlash is measured. Feature "searchConditions": it searches under
/// `conditions` (not with `track`), which are set before its first frame and taken back whatever its end is, before it
/// answers; then focus goes on by the shift that was measured between them and how the lens stands otherwise, whose
/// standard deviation counts in that of the answer. A stop moves nothing: an axis that it stops, or that another
/// command came for, stays, and the error says so. What could not be taken back makes the answer notRestored. Both ways
/// take time beside deadlineMs. Unsupported: a condition that this lens cannot be brought to, or that its camera could
/// not be brought back from.
class LENSD_API AutofocusParameters : public Value {
 public:
  using Reply = AutofocusReply;
  static const char* Method() { return "Autofocus"; }
  AutofocusParameters& lens(const std::string& value);
  AutofocusParameters& region(const Region& value);
  AutofocusParameters& method(const std::string& value);
  AutofocusParameters& regions(const std::vector<Region>& value);
  AutofocusParameters& policy(const std::string& value);
  AutofocusParameters& track(bool value);
  AutofocusParameters& range(const FocusRange& value);
  AutofocusParameters& step(const FocusStep& value);
  AutofocusParameters& distanceFrom(const std::string& value);
  AutofocusParameters& deadlineMs(double value);
  AutofocusParameters& lease(const std::string& value);
  AutofocusParameters& conditions(const SearchConditions& value);
};

/// The answer to FocusMap.
class LENSD_API FocusMapReply : public Value {
 public:
  std::optional<AutofocusProgress> progress() const;
  std::optional<FocusMapResult> map() const;
};

/// Feature "focusMap". Finds out where each region of a grid is in focus (columns 5 and rows 4 when left out; from 2 to
/// 12), by one search of the range with frames of the lens' own camera, fits a plane and a bowl to them and goes to
/// where the frame as a whole is least out of focus; or refuses and puts the lens back. Regions without texture and
/// those off the surface are named and left out. range, distanceFrom and deadlineMs are as of Autofocus, and so is
/// Busy. Progress is that of an autofocus without samples; watchers are told of an autofocus by the method "map".
/// Unsupported: no camera, or a lens whose extension is not known (uncalibrated, liquid).
class LENSD_API FocusMapParameters : public Value {
 public:
  using Reply = FocusMapReply;
  static const char* Method() { return "FocusMap"; }
  FocusMapParameters& lens(const std::string& value);
  FocusMapParameters& columns(std::int64_t value);
  FocusMapParameters& rows(std::int64_t value);
  FocusMapParameters& range(const FocusRange& value);
  FocusMapParameters& distanceFrom(const std::string& value);
  FocusMapParameters& deadlineMs(double value);
  FocusMapParameters& lease(const std::string& value);
};

/// The answer to AutofocusBegin.
class LENSD_API AutofocusBeginReply : public Value {
 public:
  std::int64_t session() const;
  AutofocusStep next() const;
};

/// Begins an autofocus whose frames come from the caller, for a camera that another program owns. It answers when the
/// lens stands where the first frame is wanted. Answer `next` with AutofocusFrame, or with AutofocusScore where
/// `scores` is true; each of them answers with the next setting reached, or with `autofocus`, the end. pixelUm is the
/// pitch of the pixels sent; without it the one of the lens' own camera counts; if there is none auto is the sweep. The
/// region is a part of the frames that will be sent; all of them when left out. The session belongs to this connection
/// and ends with it; it ends by itself after deadlineMs (an hour at most). When left out, that is as long as a search
/// of the whole range takes with frames coming as they have so far, at least 60000 and at most an hour. range, step,
/// distanceFrom and Busy as of Autofocus.
class LENSD_API AutofocusBeginParameters : public Value {
 public:
  using Reply = AutofocusBeginReply;
  static const char* Method() { return "AutofocusBegin"; }
  AutofocusBeginParameters& lens(const std::string& value);
  AutofocusBeginParameters& region(const Region& value);
  AutofocusBeginParameters& method(const std::string& value);
  AutofocusBeginParameters& pixelUm(double value);
  AutofocusBeginParameters& scores(bool value);
  AutofocusBeginParameters& deadlineMs(double value);
  AutofocusBeginParameters& regions(const std::vector<Region>& value);
  AutofocusBeginParameters& policy(const std::string& value);
  AutofocusBeginParameters& range(const FocusRange& value);
  AutofocusBeginParameters& step(const FocusStep& value);
  AutofocusBeginParameters& distanceFrom(const std::string& value);
  AutofocusBeginParameters& lease(const std::string& value);
};

/// The answer to AutofocusPixels.
class LENSD_API AutofocusPixelsReply : public Value {
 public:
  std::int64_t received() const;
};

/// A piece of the pixels of the next frame as base64, in order: offset and received count bytes. A frame is at most 8
/// MiB (OutOfRange). Offset 0 begins anew.
class LENSD_API AutofocusPixelsParameters : public Value {
 public:
  using Reply = AutofocusPixelsReply;
  static const char* Method() { return "AutofocusPixels"; }
  AutofocusPixelsParameters& session(std::int64_t value);
  AutofocusPixelsParameters& offset(std::int64_t value);
  AutofocusPixelsParameters& data(const std::string& value);
};

/// The answer to AutofocusFrame.
class LENSD_API AutofocusFrameReply : public Value {
 public:
  std::optional<AutofocusStep> next() const;
  std::optional<AutofocusResult> autofocus() const;
};

/// The frame wanted, after its pixels; `data` is the last piece of them and may be all of them. Rows are strideBytes
/// apart (without gaps when left out). Sample = light^(1/gamma), 1 when left out. Exposure times are on
/// CLOCK_MONOTONIC. A frame that cannot be used (exposed too early, too small) is refused with InvalidRequest, and the
/// same one is still wanted.
class LENSD_API AutofocusFrameParameters : public Value {
 public:
  using Reply = AutofocusFrameReply;
  static const char* Method() { return "AutofocusFrame"; }
  AutofocusFrameParameters& session(std::int64_t value);
  AutofocusFrameParameters& widthPx(std::int64_t value);
  AutofocusFrameParameters& heightPx(std::int64_t value);
  AutofocusFrameParameters& strideBytes(std::int64_t value);
  AutofocusFrameParameters& format(const std::string& value);
  AutofocusFrameParameters& gamma(double value);
  AutofocusFrameParameters& exposureStartNs(std::int64_t value);
  AutofocusFrameParameters& exposureEndNs(std::int64_t value);
  AutofocusFrameParameters& data(const std::string& value);
};

/// The answer to AutofocusScore.
class LENSD_API AutofocusScoreReply : public Value {
 public:
  std::optional<AutofocusStep> next() const;
  std::optional<AutofocusResult> autofocus() const;
};

/// How sharp the frame wanted is: any value above 0 that rises with focus. sigma is its standard deviation from frame
/// to frame, a hundredth of it when left out.
class LENSD_API AutofocusScoreParameters : public Value {
 public:
  using Reply = AutofocusScoreReply;
  static const char* Method() { return "AutofocusScore"; }
  AutofocusScoreParameters& session(std::int64_t value);
  AutofocusScoreParameters& sharpness(double value);
  AutofocusScoreParameters& sigma(double value);
  AutofocusScoreParameters& exposureStartNs(std::int64_t value);
  AutofocusScoreParameters& exposureEndNs(std::int64_t value);
};

/// The answer to AutofocusEnd.
class LENSD_API AutofocusEndReply : public Value {
 public:
};

/// Ends a session before its answer: the lens stops where it is.
class LENSD_API AutofocusEndParameters : public Value {
 public:
  using Reply = AutofocusEndReply;
  static const char* Method() { return "AutofocusEnd"; }
  AutofocusEndParameters& session(std::int64_t value);
};

/// The answer to Snapshot.
class LENSD_API SnapshotReply : public Value {
 public:
  std::string data() const;
  std::int64_t offset() const;
  std::int64_t size() const;
  std::optional<FrameInfo> frame() const;
  std::optional<PictureInfo> picture() const;
};

/// One new frame: all of it or `region`, fitted into scaleTo where that is smaller (it keeps its shape), as `encoding`
/// says (png when left out). Needs `more`: the picture comes in pieces of at most 384 KiB, in order, each as base64 in
/// `data`; offset and size count bytes of the whole. The first reply carries `frame` and `picture`. The frame is
/// exposed once the lens has come to rest; with inMotion right away, and `frame` says whether an axis moved.
class LENSD_API SnapshotParameters : public Value {
 public:
  using Reply = SnapshotReply;
  static const char* Method() { return "Snapshot"; }
  SnapshotParameters& lens(const std::string& value);
  SnapshotParameters& inMotion(bool value);
  SnapshotParameters& region(const Region& value);
  SnapshotParameters& scaleTo(const Size& value);
  SnapshotParameters& encoding(const std::string& value);
};

/// The answer to GetExposure.
class LENSD_API GetExposureReply : public Value {
 public:
  ExposureInfo exposure() const;
};

/// How the camera of a lens exposes, as the camera says.
class LENSD_API GetExposureParameters : public Value {
 public:
  using Reply = GetExposureReply;
  static const char* Method() { return "GetExposure"; }
  GetExposureParameters& lens(const std::string& value);
};

/// The answer to SetExposure.
class LENSD_API SetExposureReply : public Value {
 public:
  ExposureInfo exposure() const;
};

/// Sets exposure time, gain or both for the frames that start from now on, and answers with what the camera says it has
/// then: it may have rounded. OutOfRange tells the range where it is known; Unsupported: it cannot be set, or there is
/// no camera; Busy: autofocus is comparing pictures of this camera. It is set until the camera is switched off or a
/// client sets it again.
class LENSD_API SetExposureParameters : public Value {
 public:
  using Reply = SetExposureReply;
  static const char* Method() { return "SetExposure"; }
  SetExposureParameters& lens(const std::string& value);
  SetExposureParameters& exposureMs(double value);
  SetExposureParameters& gain(double value);
  SetExposureParameters& lease(const std::string& value);
};

/// The answer to View.
class LENSD_API ViewReply : public Value {
 public:
  std::optional<FrameInfo> frame() const;
  std::optional<PictureInfo> picture() const;
  std::optional<std::int64_t> dropped() const;
  std::optional<std::string> data() const;
  std::optional<std::int64_t> fd() const;
  std::int64_t offset() const;
  std::int64_t size() const;
};

/// Frames as they come, until the connection closes; needs `more`. Each is a picture as of Snapshot, with `frame` and
/// `picture` in its first reply, at most maxRateHz of them a second (all when left out). While the lens moves they come
/// too, unless inMotion is false. A view moves nothing and waits for nothing: a frame that comes while the one before
/// is still being made, or while its client has not taken what was sent, is dropped; `dropped`, in the first reply of a
/// picture, counts them since the view began. Frames that the camera itself lost are missing in frame.sequence. While
/// autofocus uses a camera that makes frames on demand the view shows the frames that autofocus takes. When the lens or
/// its camera goes, the view ends with the error that tells why. At most 16 views are open at a time, another is Busy.
/// With `fd` a picture is one reply and no base64: `fd` is the index (always 0) of the open file that came with the
/// reply's first byte (SCM_RIGHTS on the Unix socket). It is memory of `size` bytes, open for reading and sealed: no
/// process can write to it or resize it; mmap(2) or pread(2) it. The client gives the frame back by closing the file
/// and unmapping it (what is not taken from the socket with recvmsg(2) the kernel closes: that counts too). While it
/// has three that it has not given back, read or not, new frames are dropped; and all clients together may hold 256
/// MiB.
class LENSD_API ViewParameters : public Value {
 public:
  using Reply = ViewReply;
  static const char* Method() { return "View"; }
  ViewParameters& lens(const std::string& value);
  ViewParameters& maxRateHz(double value);
  ViewParameters& region(const Region& value);
  ViewParameters& scaleTo(const Size& value);
  ViewParameters& encoding(const std::string& value);
  ViewParameters& inMotion(bool value);
  ViewParameters& fd(bool value);
};

}  // namespace v1
}  // namespace lensd

#endif
