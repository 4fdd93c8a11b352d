"""Every method of io.lensd.Lens as a Call, for `Lens.call` and `Lens.stream` of both variants. Parameters that are None
are left out; `lens` and `lease` are then filled in by the Lens.

Written by script/client-types from proto/io.lensd.Lens.varlink: change that, not this."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

from ._protocol import Call
from .types import (
    AutofocusProgress, AutofocusResult, AutofocusStep, Axis, BacklashProgress, BacklashResult, CalibrationInfo,
    CalibrationPoint, DaemonMetrics, DistanceFrom, Encoding, Event, ExposureInfo, FailedSearch, FocusAtPlace,
    FocusAtSurface, FocusAtValue, FocusDirection, FocusMapResult, FocusRange, FocusShift, FocusShiftProgress,
    FocusShiftResult, FocusStep, FoundDevice, FrameInfo, LearnedState, LensInfo, LensMetrics, LensStatus, MoveProgress,
    MoveResult, PictureInfo, PixelFormat, PlanAnswer, PlanRequest, Policy, Preset, RecallResult, RefocusState, Region,
    SearchConditions, Size, Target, UndoResult)


@dataclass(frozen=True, slots=True, kw_only=True)
class ListReply:
    """The answer to List."""

    lenses: list[LensInfo]
    instance: str
    features: list[str]


def list_() -> Call[ListReply]:
    """Every configured lens; the name of this run of lensd, another one at each start; and the names of what was added
    to this interface since 1.0."""
    return Call("io.lensd.Lens.List", {}, ListReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class DevicesReply:
    """The answer to Devices."""

    devices: list[FoundDevice]
    failed: list[FailedSearch]


def devices() -> Call[DevicesReply]:
    """What is plugged in, as far as drivers can search for it: buses without names (RS-485) and distant networks are
    not searched. Disturbs nothing that is in use; takes up to some seconds."""
    return Call("io.lensd.Lens.Devices", {}, DevicesReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class ReloadReply:
    """The answer to Reload."""

    added: list[str]
    removed: list[str]
    reopened: list[str]
    unchanged: list[str]


def reload() -> Call[ReloadReply]:
    """Reads the configuration again. Lenses whose configuration is the same go on undisturbed, also where a file that
    it names has changed; one whose configuration is another one stops, answers its callers with Cancelled, and is
    opened anew; it keeps its lease. A configuration with a mistake is refused whole (BadConfiguration), and all stays
    as it is. Unsupported: lensd has none. Busy: that was done too often, or too much waits to be read. `added`,
    `removed`, `reopened` and `unchanged` are names of lenses. Feature "leftOut": a lens of which a part was left out
    because its device, or the way to it, failed is opened anew too."""
    return Call("io.lensd.Lens.Reload", {}, ReloadReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class StatusReply:
    """The answer to Status."""

    lenses: list[LensStatus]


def status(*, lens: Optional[str] = None) -> Call[StatusReply]:
    """The state of one lens, or of all when `lens` is left out. With `more`: now, and then each change of a lens."""
    return Call("io.lensd.Lens.Status", {"lens": lens}, StatusReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class MetricsReply:
    """The answer to Metrics."""

    lenses: list[LensMetrics]
    daemon: Optional[DaemonMetrics] = None


def metrics(*, lens: Optional[str] = None) -> Call[MetricsReply]:
    """What one lens has done and what went wrong, or all of them when `lens` is left out; and lensd itself."""
    return Call("io.lensd.Lens.Metrics", {"lens": lens}, MetricsReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class MonitorReply:
    """The answer to Monitor."""

    event: Event


def monitor(*, lens: Optional[str] = None, min_interval_ms: Optional[float] = None) -> Call[MonitorReply]:
    """What happens to one lens, or to all when `lens` is left out, also to those that are added later. Needs `more`;
    ends by itself when the one lens is taken out of the configuration (LensNotFound). States and progress come at least
    minIntervalMs apart (10 to 10000; 40 when left out), and only once the caller has read what came before: of each
    lens the newest state, of each of its axes and procedures the newest progress. Everything else comes at once, each
    time, with what waited to be told of that lens before it. Overrun: even that came faster than it was read."""
    return Call("io.lensd.Lens.Monitor", {"lens": lens, "minIntervalMs": min_interval_ms}, MonitorReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class MoveReply:
    """The answer to Move."""

    progress: Optional[MoveProgress] = None
    move: Optional[MoveResult] = None


def move(*, axis: Axis, target: Target, lens: Optional[str] = None, distance_from: Optional[DistanceFrom] = None,
         keep_focus: Optional[bool] = None, tracking_tolerance_um: Optional[float] = None, keep_brightness:
         Optional[bool] = None, lease: Optional[str] = None) -> Call[MoveReply]:
    """Moves one axis and answers when it has settled. distanceFrom says where distanceM starts and counts for nothing
    else; the configuration decides when it is left out. With `more`, `progress` comes until `move` ends the call.
    keepFocus is for the zoom: focus follows so that the plane in focus stays, off by at most trackingToleranceUm (which
    counts for nothing else) on the way: two pixels of blur when left out. What steps, backlash and calibration leave
    unknown counts as well: where that alone takes most of it, trackingBoundUm of the answer is larger. keepBrightness
    is for the iris: the exposure follows."""
    return Call("io.lensd.Lens.Move", {"lens": lens, "axis": axis, "target": target, "distanceFrom": distance_from,
                "keepFocus": keep_focus, "trackingToleranceUm": tracking_tolerance_um, "keepBrightness":
                keep_brightness, "lease": lease}, MoveReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class GetCalibrationReply:
    """The answer to GetCalibration."""

    calibration: CalibrationInfo


def get_calibration(*, lens: Optional[str] = None) -> Call[GetCalibrationReply]:
    """The calibration of a lens."""
    return Call("io.lensd.Lens.GetCalibration", {"lens": lens}, GetCalibrationReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrateReply:
    """The answer to Calibrate."""

    calibration: CalibrationInfo


def calibrate(*, lens: Optional[str] = None, toml: Optional[str] = None, points: Optional[list[CalibrationPoint]] =
              None, distance_from: Optional[DistanceFrom] = None, error_um: Optional[float] = None, approximate:
              Optional[bool] = None, made: Optional[str] = None, remove: Optional[bool] = None, lease: Optional[str] =
              None) -> Call[CalibrateReply]:
    """Changes it, by exactly one of three: a whole file (`toml`); a focus curve for the zoom, filter and temperature of
    this moment from `points`, several of which may be of the same depth; or back to the nominal figures (`remove`). The
    other parameters count with `points` alone: errorUm is the curve's error, estimated from at least four depths when
    left out; `approximate` says that it is not measured; `made` is a remark that is kept. It is kept in the file the
    configuration names, else in the daemon's state folder. Busy: an axis moves. BadData: what `toml` says. OutOfRange:
    a distance too short to be in front of the lens. InvalidRequest: a depth inside the focal length. NotKept: it is in
    force, and could not be written."""
    return Call("io.lensd.Lens.Calibrate", {"lens": lens, "toml": toml, "points": points, "distanceFrom": distance_from,
                "errorUm": error_um, "approximate": approximate, "made": made, "remove": remove, "lease": lease},
                CalibrateReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasureBacklashReply:
    """The answer to MeasureBacklash."""

    progress: Optional[BacklashProgress] = None
    backlash: Optional[BacklashResult] = None


def measure_backlash(*, lens: Optional[str] = None, axis: Optional[Axis] = None, size: Optional[float] = None, pairs:
                     Optional[int] = None, region: Optional[Region] = None, lease: Optional[str] = None) -> Call[MeasureBacklashReply]:
    """Measures the backlash of focus on a region of the picture (the camera's own when left out), by 3 to 100 pairs of
    sweeps (5 when left out), or takes that of any axis from `size`, in native units: then pairs and region do not
    count. It is kept with the calibration. With `more`, `progress` comes until `backlash` ends the call. Busy: an axis
    moves, or an autofocus is under way. OutOfRange: a size above a tenth of the travel."""
    return Call("io.lensd.Lens.MeasureBacklash", {"lens": lens, "axis": axis, "size": size, "pairs": pairs, "region":
                region, "lease": lease}, MeasureBacklashReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasureFocusShiftReply:
    """The answer to MeasureFocusShift."""

    progress: Optional[FocusShiftProgress] = None
    shift: Optional[FocusShiftResult] = None


def measure_focus_shift(*, conditions: SearchConditions, lens: Optional[str] = None, pairs: Optional[int] = None,
                        region: Optional[Region] = None, lease: Optional[str] = None) -> Call[MeasureFocusShiftReply]:
    """Feature "searchConditions". Measures how focus shifts from `conditions`, which have exactly one of fNumber and
    filterPosition (and the exposure that goes with it), to the conditions that the lens is in: 3 to 20 pairs of
    searches (5 when left out) by sweep on a region of the picture, which must stay as it is. It is kept with the
    calibration, in place of what was measured for the same pair; an Autofocus with such conditions goes on by it. With
    `more`, `progress` comes until `shift` ends the call. Busy: an axis moves, or an autofocus is under way. Otherwise
    as Autofocus."""
    return Call("io.lensd.Lens.MeasureFocusShift", {"lens": lens, "conditions": conditions, "pairs": pairs, "region":
                region, "lease": lease}, MeasureFocusShiftReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class ListFocusShiftsReply:
    """The answer to ListFocusShifts."""

    shifts: list[FocusShift]


def list_focus_shifts(*, lens: Optional[str] = None) -> Call[ListFocusShiftsReply]:
    """Feature "searchConditions". The shifts of focus that were measured of a lens."""
    return Call("io.lensd.Lens.ListFocusShifts", {"lens": lens}, ListFocusShiftsReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class RemoveFocusShiftReply:
    """The answer to RemoveFocusShift."""


def remove_focus_shift(*, lens: Optional[str] = None, from_f_number: Optional[float] = None, to_f_number:
                       Optional[float] = None, from_filter: Optional[float] = None, to_filter: Optional[float] = None,
                       lease: Optional[str] = None) -> Call[RemoveFocusShiftReply]:
    """Feature "searchConditions". Forgets the shift between two f-numbers or between two filters, whichever way round.
    InvalidRequest: none is known of them."""
    return Call("io.lensd.Lens.RemoveFocusShift", {"lens": lens, "fromFNumber": from_f_number, "toFNumber": to_f_number,
                "fromFilter": from_filter, "toFilter": to_filter, "lease": lease}, RemoveFocusShiftReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class FocusAtAddReply:
    """The answer to FocusAtAdd."""

    surface: FocusAtSurface


def focus_at_add(*, at: list[FocusAtValue], lens: Optional[str] = None, position: Optional[float] = None, sigma:
                 Optional[float] = None, lease: Optional[str] = None) -> Call[FocusAtAddReply]:
    """Feature "focusAt". Adds a sample to the surface of focus: the newest Autofocus or session that was sure, as it
    found focus at the place `at`, or `position` with its standard deviation `sigma`. One autofocus makes one sample.
    One to three coordinates, always the same and in the same order. It is kept with the calibration. Unsupported: the
    zoom, the filter, the wavelength or the side that focus is approached from are others than those of the samples, or
    the temperature is, by more than 2 C, and the lens has no coefficient that is used. OutOfRange: 30 samples are kept
    already, or focus cannot stand there. InvalidRequest: no autofocus to take; other coordinates. Busy: an axis moves.
    NotHomed: an axis has lost its reference. NotKept: it is in force, and could not be written."""
    return Call("io.lensd.Lens.FocusAtAdd", {"lens": lens, "at": at, "position": position, "sigma": sigma, "lease":
                lease}, FocusAtAddReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class FocusAtGetReply:
    """The answer to FocusAtGet."""

    surface: FocusAtSurface
    place: Optional[FocusAtPlace] = None


def focus_at_get(*, lens: Optional[str] = None, at: Optional[list[FocusAtValue]] = None) -> Call[FocusAtGetReply]:
    """Feature "focusAt". What is known, and with `at` where focus lies there, as FocusAt has it. OutOfRange,
    Unsupported: as of FocusAt."""
    return Call("io.lensd.Lens.FocusAtGet", {"lens": lens, "at": at}, FocusAtGetReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class FocusAtReply:
    """The answer to FocusAt."""

    place: FocusAtPlace
    move: MoveResult


def focus_at(*, at: list[FocusAtValue], lens: Optional[str] = None, lease: Optional[str] = None) -> Call[FocusAtReply]:
    """Feature "focusAt". Moves focus to where the surface has it at a place. OutOfRange: outside the samples, or too
    few of them. Unsupported: other conditions than those of the samples, as of FocusAtAdd. Otherwise as Move."""
    return Call("io.lensd.Lens.FocusAt", {"lens": lens, "at": at, "lease": lease}, FocusAtReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class FocusAtForgetReply:
    """The answer to FocusAtForget."""

    removed: Optional[bool] = None


def focus_at_forget(*, lens: Optional[str] = None, sample: Optional[int] = None, lease: Optional[str] = None) -> Call[FocusAtForgetReply]:
    """Feature "focusAt". Forgets all samples, or one of them, by its number from 1. InvalidRequest: there is no such
    sample. NotKept: it is in force, and could not be written. `removed` says that there was something to forget."""
    return Call("io.lensd.Lens.FocusAtForget", {"lens": lens, "sample": sample, "lease": lease}, FocusAtForgetReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class GetRefocusReply:
    """The answer to GetRefocus."""

    refocus: RefocusState


def get_refocus(*, lens: Optional[str] = None) -> Call[GetRefocusReply]:
    """Feature "refocus". What lensd does by itself to keep a lens in focus, and what it has learned for that."""
    return Call("io.lensd.Lens.GetRefocus", {"lens": lens}, GetRefocusReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class ForgetDriftReply:
    """The answer to ForgetDrift."""


def forget_drift(*, lens: Optional[str] = None, result: Optional[int] = None, lease: Optional[str] = None) -> Call[ForgetDriftReply]:
    """Feature "refocus". Forgets what was learned of focus and temperature, or one result of that, by its number from
    1. InvalidRequest: there is no such result. NotKept: it is in force, and could not be written."""
    return Call("io.lensd.Lens.ForgetDrift", {"lens": lens, "result": result, "lease": lease}, ForgetDriftReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class GetLearnedReply:
    """The answer to GetLearned."""

    learned: LearnedState


def get_learned(*, lens: Optional[str] = None) -> Call[GetLearnedReply]:
    """Feature "learned". What autofocus has taught lensd of a lens: the blur that a step of focus makes. Disconnected:
    the lens has not been there since lensd began; of one that has gone it is told."""
    return Call("io.lensd.Lens.GetLearned", {"lens": lens}, GetLearnedReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class ForgetLearnedReply:
    """The answer to ForgetLearned."""


def forget_learned(*, lens: Optional[str] = None, lease: Optional[str] = None) -> Call[ForgetLearnedReply]:
    """Feature "learned". Forgets all of it: the next searches go by what is told, and learn anew. NotKept: it is in
    force, and could not be written."""
    return Call("io.lensd.Lens.ForgetLearned", {"lens": lens, "lease": lease}, ForgetLearnedReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class KeepDirectionReply:
    """The answer to KeepDirection."""


def keep_direction(*, lens: Optional[str] = None, direction: Optional[FocusDirection] = None, lease: Optional[str] =
                   None) -> Call[KeepDirectionReply]:
    """Feature "direction". Remembers, also when lensd is restarted, which way focus counts, as a measurement of this
    device has shown it (`lensctl setup --at` makes one); null forgets it. It counts from now on where neither the
    configuration nor a calibration says another; where they do, `warnings` of LensStatus tells of it. Unsupported: no
    motorised focus. Busy: an axis moves, or an autofocus is under way. NotKept: it is in force, and could not be
    written."""
    return Call("io.lensd.Lens.KeepDirection", {"lens": lens, "direction": direction, "lease": lease},
                KeepDirectionReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class PresetSaveReply:
    """The answer to PresetSave."""

    preset: Preset


def preset_save(*, label: str, lens: Optional[str] = None, lease: Optional[str] = None) -> Call[PresetSaveReply]:
    """Saves the state of a lens under a label, in place of what was there. Busy: an axis moves. NotKept: nothing was
    saved. OutOfRange: 1000 are saved already. NotHomed: an axis has lost its reference, so nobody knows where it
    stands."""
    return Call("io.lensd.Lens.PresetSave", {"lens": lens, "label": label, "lease": lease}, PresetSaveReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class PresetListReply:
    """The answer to PresetList."""

    presets: list[Preset]


def preset_list(*, lens: Optional[str] = None) -> Call[PresetListReply]:
    """The presets of a lens, in the order of their labels. BadData, DeviceError: the file they are kept in cannot be
    read."""
    return Call("io.lensd.Lens.PresetList", {"lens": lens}, PresetListReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class PresetRecallReply:
    """The answer to PresetRecall."""

    recall: RecallResult


def preset_recall(*, label: str, lens: Optional[str] = None, lease: Optional[str] = None) -> Call[PresetRecallReply]:
    """Brings zoom, filter, iris and focus back to the same optical state: by today's calibration and temperature.
    PresetNotFound: there is none of that label. BadData, DeviceError: as of PresetList."""
    return Call("io.lensd.Lens.PresetRecall", {"lens": lens, "label": label, "lease": lease}, PresetRecallReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class PresetRemoveReply:
    """The answer to PresetRemove."""


def preset_remove(*, label: str, lens: Optional[str] = None, lease: Optional[str] = None) -> Call[PresetRemoveReply]:
    """Forgets a preset. PresetNotFound: there is none of that label. NotKept: it is still there. BadData, DeviceError:
    as of PresetList."""
    return Call("io.lensd.Lens.PresetRemove", {"lens": lens, "label": label, "lease": lease}, PresetRemoveReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class UndoReply:
    """The answer to Undo."""

    undo: UndoResult


def undo(*, lens: Optional[str] = None, lease: Optional[str] = None) -> Call[UndoReply]:
    """Feature "undo". Brings zoom, filter, iris and focus back to the optical state in which the lens last stood before
    it was brought where it is, by whichever client; once more: forth again. What counts as one step is a whole call: an
    autofocus, a recall, a plan that was applied. lensd knows the last two states of a lens since it began, and forgets
    them at its end. NotHomed: an axis has lost its reference."""
    return Call("io.lensd.Lens.Undo", {"lens": lens, "lease": lease}, UndoReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class HomeReply:
    """The answer to Home."""

    moves: list[MoveResult]


def home(*, lens: Optional[str] = None, axis: Optional[Axis] = None, lease: Optional[str] = None) -> Call[HomeReply]:
    """Searches for the reference of one axis, or of every axis that has one."""
    return Call("io.lensd.Lens.Home", {"lens": lens, "axis": axis, "lease": lease}, HomeReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class SetPositionReply:
    """The answer to SetPosition."""


def set_position(*, axis: Axis, position: float, lens: Optional[str] = None, lease: Optional[str] = None) -> Call[SetPositionReply]:
    """Feature "setPosition". Says where an axis stands that counts its steps and has no reference to search; it moves
    nothing. From now on its positions count from there, and that is kept: over a restart, and over a loss of power as
    `restore` of its configuration says. The position is rounded to the axis' resolution. Unsupported: it can be homed,
    an encoder measures where it stands, or its positions are no counts. Busy: it moves, or a search for focus is under
    way. OutOfRange: that is not on its travel. Timeout: the device did not say what it counts. NotKept: nothing has
    changed, because it could not be written."""
    return Call("io.lensd.Lens.SetPosition", {"lens": lens, "axis": axis, "position": position, "lease": lease},
                SetPositionReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class StopReply:
    """The answer to Stop."""


def stop(*, lens: Optional[str] = None, axis: Optional[Axis] = None, latch: Optional[bool] = None) -> Call[StopReply]:
    """Stops one axis and any autofocus, or everything the lens does; without `lens` every lens. It acts as soon as it
    is read, whatever else its connection waits for. Every call that was read before it, on any connection, and moves
    what is stopped answers Cancelled; its own answer says that the motors were told, and Status' `moving` when they
    rest, for they brake. Unsupported: what moves cannot stop midway (`canStop`), and travels on. With `latch` no axis
    of these lenses moves until ResetFaults: until then Status has `latched`, and Move, Home, Autofocus, FocusMap,
    AutofocusBegin, MeasureBacklash, PresetRecall, Undo, SetExposure and a Plan with `apply` answer Cancelled at once,
    however often they are repeated. Where it stops every lens, an error is that of one of them; the others are stopped
    all the same."""
    return Call("io.lensd.Lens.Stop", {"lens": lens, "axis": axis, "latch": latch}, StopReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class ResetFaultsReply:
    """The answer to ResetFaults."""


def reset_faults(*, lens: Optional[str] = None, axis: Optional[Axis] = None, lease: Optional[str] = None) -> Call[ResetFaultsReply]:
    """Ends the latch of Stop, whatever axis is named, and clears the faults that axes complain of, once their cause is
    gone: one axis', or those of the whole lens. Nothing moves. A fault that the device does not let go of stays and is
    still told by Status, so that an answer without an error does not say that the device is well, or there. Unsupported
    where the axis that was named takes no such command."""
    return Call("io.lensd.Lens.ResetFaults", {"lens": lens, "axis": axis, "lease": lease}, ResetFaultsReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class TakeLeaseReply:
    """The answer to TakeLease."""

    lens: str
    lease: str


def take_lease(*, lens: Optional[str] = None, for_ms: Optional[float] = None, lease: Optional[str] = None, take_over:
               Optional[bool] = None, stop: Optional[bool] = None) -> Call[TakeLeaseReply]:
    """Keeps every other client from moving the lens and from changing its calibration, presets, faults and exposure;
    reading its state and stopping it stay open to all. Without forMs (at most a day) the lease ends with this
    connection, else with that time. Calls on this connection may move the lens; calls on others give `lease`, the key
    in the answer. Leased: another client has it. Who has it already, by this connection or by giving the key as
    `lease`, renews it: the key stays, holder and end are those of this call. An administrator takes it from its holder
    with `takeOver`: its old key is worth nothing then. While an autofocus or a measurement of backlash of another
    client goes on it is Busy, or ends that with `stop`."""
    return Call("io.lensd.Lens.TakeLease", {"lens": lens, "forMs": for_ms, "lease": lease, "takeOver": take_over,
                "stop": stop}, TakeLeaseReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class HoldReply:
    """The answer to Hold."""

    until_ns: int
    at_rest: bool


def hold(*, until_ns: int, lens: Optional[str] = None) -> Call[HoldReply]:
    """Feature "hold". Whoever exposes with another program's camera keeps the lens from being corrected meanwhile:
    until untilNs (CLOCK_MONOTONIC, an hour from now at most) what lensd does by itself waits, which is following the
    temperature, and the next search of an autofocus with `track`. It is no lease: commands of clients are carried out
    as always, and Stop stops. A correction that has begun goes on to its end: atRest says whether nothing moves and
    nothing is searched for, so that the exposure may begin. With `more` it answers at once, and again when its time is
    over. Each connection has one hold a lens, and another call moves its end. It ends then, by Release, with its
    connection, and when the lens is opened anew."""
    return Call("io.lensd.Lens.Hold", {"lens": lens, "untilNs": until_ns}, HoldReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class ReleaseReply:
    """The answer to Release."""


def release(*, lens: Optional[str] = None) -> Call[ReleaseReply]:
    """Feature "hold". Ends the hold of this connection; harmless where there is none. What has waited is done now,
    unless another one holds."""
    return Call("io.lensd.Lens.Release", {"lens": lens}, ReleaseReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class DropLeaseReply:
    """The answer to DropLease."""


def drop_lease(*, lens: Optional[str] = None, lease: Optional[str] = None) -> Call[DropLeaseReply]:
    """Ends a lease that this connection took or whose key is given; harmless where there is none. Leased: it is another
    client's."""
    return Call("io.lensd.Lens.DropLease", {"lens": lens, "lease": lease}, DropLeaseReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanReply:
    """The answer to Plan."""

    plan: PlanAnswer
    nearest: Optional[PlanAnswer] = None
    applied: Optional[list[MoveResult]] = None
    reached: Optional[PlanAnswer] = None
    request: Optional[PlanRequest] = None


def plan(*, request: PlanRequest, lens: Optional[str] = None, apply: Optional[bool] = None, show_request: Optional[bool]
         = None, lease: Optional[str] = None) -> Call[PlanReply]:
    """Finds the position of this lens' motors that meets every limit, and with `apply` moves there. The lens is what it
    is now: zoom, breathing, temperature, filter. Tolerances cover at least what the motors keep at the position chosen.
    `nearest` is the position that comes closest where some setting would do and no position does (then the conflict is
    "positions"). `reached` is how the limits fare where the motors ended, from what is measured of the lens then and
    within the bounds of all its axes. With `showRequest` the answer has the request as it was understood, depths from
    the lens centre at that position."""
    return Call("io.lensd.Lens.Plan", {"lens": lens, "request": request, "apply": apply, "showRequest": show_request,
                "lease": lease}, PlanReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class AutofocusReply:
    """The answer to Autofocus."""

    progress: Optional[AutofocusProgress] = None
    autofocus: Optional[AutofocusResult] = None


def autofocus(*, lens: Optional[str] = None, region: Optional[Region] = None, method: Optional[str] = None, regions:
              Optional[list[Region]] = None, policy: Optional[Policy] = None, track: Optional[bool] = None, range:
              Optional[FocusRange] = None, step: Optional[FocusStep] = None, distance_from: Optional[DistanceFrom] =
              None, deadline_ms: Optional[float] = None, lease: Optional[str] = None, conditions:
              Optional[SearchConditions] = None) -> Call[AutofocusReply]:
    """Brings a region of the picture into focus, or refuses and puts the lens back. Without a region the camera's own
    is used; without a method auto is. Methods: auto, defocus, sweep, moving, stars, exhaustive, coarse-fine, golden-
    section, fibonacci, hill-climb, sweep-parabola, sweep-gaussian, sweep-hyperbola, contrast-scan; docs/interface.md
    says what each does and needs. Of several `regions` the policy takes the answer: nearest (also when left out),
    farthest, or widest, by half a depth of field. With `track` (needs `more`) it goes on: it holds focus on the one
    region, whose subject may move while it is searched for, moves the lens only where the scene has changed, answers
    each search with `autofocus`, and never ends by itself. It keeps to `range`, whose distances start where
    distanceFrom says, and goes by `step`, which not every method does (InvalidRequest); both are OutOfRange where this
    lens cannot. A search may take deadlineMs (an hour at most); when left out, as long as one of the whole range takes,
    and at least 20000. OutOfRange: so short that the search cannot end; the message says what it needs. Busy: another
    autofocus is under way on this lens, or its backlash is measured. Feature "searchConditions": it searches under
    `conditions` (not with `track`), which are set before its first frame and taken back whatever its end is, before it
    answers; then focus goes on by the shift that was measured between them and how the lens stands otherwise, whose
    standard deviation counts in that of the answer. A stop moves nothing: an axis that it stops, or that another
    command came for, stays, and the error says so. What could not be taken back makes the answer notRestored. Both ways
    take time beside deadlineMs. Unsupported: a condition that this lens cannot be brought to, or that its camera could
    not be brought back from."""
    return Call("io.lensd.Lens.Autofocus", {"lens": lens, "region": region, "method": method, "regions": regions,
                "policy": policy, "track": track, "range": range, "step": step, "distanceFrom": distance_from,
                "deadlineMs": deadline_ms, "lease": lease, "conditions": conditions}, AutofocusReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class FocusMapReply:
    """The answer to FocusMap."""

    progress: Optional[AutofocusProgress] = None
    map: Optional[FocusMapResult] = None


def focus_map(*, lens: Optional[str] = None, columns: Optional[int] = None, rows: Optional[int] = None, range:
              Optional[FocusRange] = None, distance_from: Optional[DistanceFrom] = None, deadline_ms: Optional[float] =
              None, lease: Optional[str] = None) -> Call[FocusMapReply]:
    """Feature "focusMap". Finds out where each region of a grid is in focus (columns 5 and rows 4 when left out; from 2
    to 12), by one search of the range with frames of the lens' own camera, fits a plane and a bowl to them and goes to
    where the frame as a whole is least out of focus; or refuses and puts the lens back. Regions without texture and
    those off the surface are named and left out. range, distanceFrom and deadlineMs are as of Autofocus, and so is
    Busy. Progress is that of an autofocus without samples; watchers are told of an autofocus by the method "map".
    Unsupported: no camera, or a lens whose extension is not known (uncalibrated, liquid)."""
    return Call("io.lensd.Lens.FocusMap", {"lens": lens, "columns": columns, "rows": rows, "range": range,
                "distanceFrom": distance_from, "deadlineMs": deadline_ms, "lease": lease}, FocusMapReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class AutofocusBeginReply:
    """The answer to AutofocusBegin."""

    session: int
    next: AutofocusStep


def autofocus_begin(*, lens: Optional[str] = None, region: Optional[Region] = None, method: Optional[str] = None,
                    pixel_um: Optional[float] = None, scores: Optional[bool] = None, deadline_ms: Optional[float] =
                    None, regions: Optional[list[Region]] = None, policy: Optional[Policy] = None, range:
                    Optional[FocusRange] = None, step: Optional[FocusStep] = None, distance_from: Optional[DistanceFrom]
                    = None, lease: Optional[str] = None) -> Call[AutofocusBeginReply]:
    """Begins an autofocus whose frames come from the caller, for a camera that another program owns. It answers when
    the lens stands where the first frame is wanted. Answer `next` with AutofocusFrame, or with AutofocusScore where
    `scores` is true; each of them answers with the next setting reached, or with `autofocus`, the end. pixelUm is the
    pitch of the pixels sent; without it the one of the lens' own camera counts; if there is none auto is the sweep. The
    region is a part of the frames that will be sent; all of them when left out. The session belongs to this connection
    and ends with it; it ends by itself after deadlineMs (an hour at most). When left out, that is as long as a search
    of the whole range takes with frames coming as they have so far, at least 60000 and at most an hour. range, step,
    distanceFrom and Busy as of Autofocus."""
    return Call("io.lensd.Lens.AutofocusBegin", {"lens": lens, "region": region, "method": method, "pixelUm": pixel_um,
                "scores": scores, "deadlineMs": deadline_ms, "regions": regions, "policy": policy, "range": range,
                "step": step, "distanceFrom": distance_from, "lease": lease}, AutofocusBeginReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class AutofocusPixelsReply:
    """The answer to AutofocusPixels."""

    received: int


def autofocus_pixels(*, session: int, offset: int, data: str) -> Call[AutofocusPixelsReply]:
    """A piece of the pixels of the next frame as base64, in order: offset and received count bytes. A frame is at most
    8 MiB (OutOfRange). Offset 0 begins anew."""
    return Call("io.lensd.Lens.AutofocusPixels", {"session": session, "offset": offset, "data": data},
                AutofocusPixelsReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class AutofocusFrameReply:
    """The answer to AutofocusFrame."""

    next: Optional[AutofocusStep] = None
    autofocus: Optional[AutofocusResult] = None


def autofocus_frame(*, session: int, width_px: int, height_px: int, format: PixelFormat, exposure_start_ns: int,
                    exposure_end_ns: int, stride_bytes: Optional[int] = None, gamma: Optional[float] = None, data:
                    Optional[str] = None) -> Call[AutofocusFrameReply]:
    """The frame wanted, after its pixels; `data` is the last piece of them and may be all of them. Rows are strideBytes
    apart (without gaps when left out). Sample = light^(1/gamma), 1 when left out. Exposure times are on
    CLOCK_MONOTONIC. A frame that cannot be used (exposed too early, too small) is refused with InvalidRequest, and the
    same one is still wanted."""
    return Call("io.lensd.Lens.AutofocusFrame", {"session": session, "widthPx": width_px, "heightPx": height_px,
                "strideBytes": stride_bytes, "format": format, "gamma": gamma, "exposureStartNs": exposure_start_ns,
                "exposureEndNs": exposure_end_ns, "data": data}, AutofocusFrameReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class AutofocusScoreReply:
    """The answer to AutofocusScore."""

    next: Optional[AutofocusStep] = None
    autofocus: Optional[AutofocusResult] = None


def autofocus_score(*, session: int, sharpness: float, exposure_start_ns: int, exposure_end_ns: int, sigma:
                    Optional[float] = None) -> Call[AutofocusScoreReply]:
    """How sharp the frame wanted is: any value above 0 that rises with focus. sigma is its standard deviation from
    frame to frame, a hundredth of it when left out."""
    return Call("io.lensd.Lens.AutofocusScore", {"session": session, "sharpness": sharpness, "sigma": sigma,
                "exposureStartNs": exposure_start_ns, "exposureEndNs": exposure_end_ns}, AutofocusScoreReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class AutofocusEndReply:
    """The answer to AutofocusEnd."""


def autofocus_end(*, session: int) -> Call[AutofocusEndReply]:
    """Ends a session before its answer: the lens stops where it is."""
    return Call("io.lensd.Lens.AutofocusEnd", {"session": session}, AutofocusEndReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class SnapshotReply:
    """The answer to Snapshot."""

    data: str
    offset: int
    size: int
    frame: Optional[FrameInfo] = None
    picture: Optional[PictureInfo] = None


def snapshot(*, lens: Optional[str] = None, in_motion: Optional[bool] = None, region: Optional[Region] = None, scale_to:
             Optional[Size] = None, encoding: Optional[Encoding] = None) -> Call[SnapshotReply]:
    """One new frame: all of it or `region`, fitted into scaleTo where that is smaller (it keeps its shape), as
    `encoding` says (png when left out). Needs `more`: the picture comes in pieces of at most 384 KiB, in order, each as
    base64 in `data`; offset and size count bytes of the whole. The first reply carries `frame` and `picture`. The frame
    is exposed once the lens has come to rest; with inMotion right away, and `frame` says whether an axis moved."""
    return Call("io.lensd.Lens.Snapshot", {"lens": lens, "inMotion": in_motion, "region": region, "scaleTo": scale_to,
                "encoding": encoding}, SnapshotReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class GetExposureReply:
    """The answer to GetExposure."""

    exposure: ExposureInfo


def get_exposure(*, lens: Optional[str] = None) -> Call[GetExposureReply]:
    """How the camera of a lens exposes, as the camera says."""
    return Call("io.lensd.Lens.GetExposure", {"lens": lens}, GetExposureReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class SetExposureReply:
    """The answer to SetExposure."""

    exposure: ExposureInfo


def set_exposure(*, lens: Optional[str] = None, exposure_ms: Optional[float] = None, gain: Optional[float] = None,
                 lease: Optional[str] = None) -> Call[SetExposureReply]:
    """Sets exposure time, gain or both for the frames that start from now on, and answers with what the camera says it
    has then: it may have rounded. OutOfRange tells the range where it is known; Unsupported: it cannot be set, or there
    is no camera; Busy: autofocus is comparing pictures of this camera. It is set until the camera is switched off or a
    client sets it again."""
    return Call("io.lensd.Lens.SetExposure", {"lens": lens, "exposureMs": exposure_ms, "gain": gain, "lease": lease},
                SetExposureReply)


@dataclass(frozen=True, slots=True, kw_only=True)
class ViewReply:
    """The answer to View."""

    frame: Optional[FrameInfo] = None
    picture: Optional[PictureInfo] = None
    dropped: Optional[int] = None
    data: Optional[str] = None
    fd: Optional[int] = None
    offset: int
    size: int


def view(*, lens: Optional[str] = None, max_rate_hz: Optional[float] = None, region: Optional[Region] = None, scale_to:
         Optional[Size] = None, encoding: Optional[Encoding] = None, in_motion: Optional[bool] = None, fd:
         Optional[bool] = None) -> Call[ViewReply]:
    """Frames as they come, until the connection closes; needs `more`. Each is a picture as of Snapshot, with `frame`
    and `picture` in its first reply, at most maxRateHz of them a second (all when left out). While the lens moves they
    come too, unless inMotion is false. A view moves nothing and waits for nothing: a frame that comes while the one
    before is still being made, or while its client has not taken what was sent, is dropped; `dropped`, in the first
    reply of a picture, counts them since the view began. Frames that the camera itself lost are missing in
    frame.sequence. While autofocus uses a camera that makes frames on demand the view shows the frames that autofocus
    takes. When the lens or its camera goes, the view ends with the error that tells why. At most 16 views are open at a
    time, another is Busy. With `fd` a picture is one reply and no base64: `fd` is the index (always 0) of the open file
    that came with the reply's first byte (SCM_RIGHTS on the Unix socket). It is memory of `size` bytes, open for
    reading and sealed: no process can write to it or resize it; mmap(2) or pread(2) it. The client gives the frame back
    by closing the file and unmapping it (what is not taken from the socket with recvmsg(2) the kernel closes: that
    counts too). While it has three that it has not given back, read or not, new frames are dropped; and all clients
    together may hold 256 MiB."""
    return Call("io.lensd.Lens.View", {"lens": lens, "maxRateHz": max_rate_hz, "region": region, "scaleTo": scale_to,
                "encoding": encoding, "inMotion": in_motion, "fd": fd}, ViewReply)
