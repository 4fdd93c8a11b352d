"""The types of io.lensd.Lens. Names are those of docs/interface.md in snake_case; an enumeration may get values later.

Written by script/client-types from proto/io.lensd.Lens.varlink: change that, not this."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Optional

# The motorised parts of a lens.
Axis = Literal["focus", "iris", "zoom", "filter"]

# Units of native positions. position: counts places, as of a filter wheel.
Unit = Literal["steps", "dioptres", "fNumber", "millimetres", "position"]

# Where distances that people give start.
DistanceFrom = Literal["lens", "sensor", "front"]

# How far focus positions can be trusted, and with them extensions, vergences and their bounds. uncalibrated: they go by
# nominal figures. Bounds hold only as far as these do: their error is not known, and no bound counts it, but for a
# focalLengthTolerance. approximate: by a calibration whose error was not measured, or beyond what it measured.
# calibrated: within what was measured. F-numbers and focal lengths are nominal whatever the grade, and so are their
# bounds, unless the calibration has them (`toml` of GetCalibration).
Grade = Literal["uncalibrated", "approximate", "calibrated"]

# What a lens is doing. backlash: its backlash is being measured, whatever single moves and frames that takes.
Activity = Literal["idle", "moving", "homing", "autofocus", "backlash", "snapshot"]

# Whether a lens answers. connecting: its device is being opened. hung: that has taken 15 s, or a call to the device 10
# s, and nothing has come back; who waited for it was told so, a motor that was moving may go on, and the device is
# opened anew beside that, unless three such calls hang already: then one has to come back first. absent: it is not
# there. wrongDevice: what is there is not what is configured, or the calibration that is kept for it is another lens';
# it is tried again at least every 10 s, so once the file is mended nothing needs to be said. In all states but
# connected `error` says why (and names the file), nothing moves and nothing is homed as far as is known, and axes are
# told as they were last known: none, if the lens never answered.
Connection = Literal["connected", "connecting", "hung", "absent", "wrongDevice"]


@dataclass(frozen=True, slots=True, kw_only=True)
class DaemonMetrics:
    """What lensd as a whole has to do."""

    # When lensd began.
    since_ns: int
    # Writes and reads of files that wait for their turn.
    files_waiting: int
    # Long plans that wait for their turn.
    plans_waiting: int
    # Failures for which the command of `on_failure` was run.
    failures_told: int
    # Those of them for which it could not be run, failed, or was ended because it took too long.
    failures_not_told: int
    # Failures for which it was not run at all, because they came too fast.
    failures_dropped: int

# What a client may do. observe: ask, look on, and stop what moves: every client that may connect. move: all that moves
# a lens, and presets, leases and exposure. administer: calibrations and the configuration too. Each includes those
# before it.
Role = Literal["observe", "move", "administer"]

# Who moved an axis. external: another program, or a hand.
MovedBy = Literal["lensd", "external"]

# Which of several regions in focus gives the answer. widest: the depth that most of them agree on.
Policy = Literal["nearest", "farthest", "widest"]

# Why a move is not reached or not verified, or what its reader should know. counted: steps were counted, not measured.
# noFeedback: the device tells no position of its own. positionUnknown: there is no reference, or (SetPosition) the axis
# has lost count: a move to a position then is never reached, and one by so many steps is, from wherever it stood.
# backlash: not all of it was taken up, or it is not known. missed: came to rest elsewhere as often as it was tried.
# external: another program took the axis away. fault: the device complains. stalled: its position ceased to change,
# which is a motor that is stuck or a readback that is; the bound then reaches to where the axis was sent, until the
# position changes again. late: not there by the deadline. noReference: homing found none. focusLost: focus could not
# follow a zoom. exposure: the exposure could not follow the iris. notKept: it arrived, and its position is not on disk
# (`kept`).
MoveCause = Literal[
    "counted", "noFeedback", "positionUnknown", "backlash", "missed", "external", "fault", "stalled", "late",
    "noReference", "focusLost", "exposure", "notKept"]

# Why an autofocus believes its answer (found) or refuses. noTexture: nothing changes with focus. tooBright: the sensor
# is overexposed. severalDepths: parts of the region differ. endOfTravel: sharpest at an end. subjectMoved: subject or
# camera moved. ambiguous: several distances look alike. unclear: noise or light leave no clear answer. uncalibrated:
# the method needs optics, f-number and pixels that are known. placeUnknown: where the frames were taken is not known
# well enough. deadline: none came in time. missed: the lens did not get where it was sent. sameFrame: a frame was the
# one before, though the lens had moved between. Feature "searchConditions": notRestored: it found focus under the
# conditions of the search and the lens stays there, but they could not be taken back, or focus not go on by the shift.
# Feature "badFrames": lateFrames: frames show where the lens was before, even when one is thrown away after each move.
AutofocusCause = Literal[
    "found", "noTexture", "tooBright", "severalDepths", "endOfTravel", "subjectMoved", "ambiguous", "unclear",
    "uncalibrated", "placeUnknown", "deadline", "missed", "sameFrame", "notRestored", "lateFrames"]

# Why backlash was not measured, or is not in force. notFocused: autofocus refused. noPeak: no clear peak of sharpness.
# noRoom: the soft limits leave none. tooLarge: focus was not found again coming from above. unsteady: the sweeps
# disagree. missed: the lens did not get where it was sent. configured: the configuration says otherwise and stays in
# force.
BacklashCause = Literal["notFocused", "noPeak", "noRoom", "tooLarge", "unsteady", "missed", "configured"]

# Why there is no stack. tooFar, tooNear: an end of the depths is out of reach. tolerance: what is not known of the lens
# leaves nothing of the depth of focus. diffraction: at every f-number it exceeds a limit. tooMany: it would take more
# shots than lensd counts.
StackCause = Literal["tooFar", "tooNear", "tolerance", "diffraction", "tooMany"]

# Feature "direction". Which way focus counts: nearPositive: larger native positions focus nearer; nearNegative:
# farther.
FocusDirection = Literal["nearPositive", "nearNegative"]

# Feature "direction". Who says so; of several the one that stands first here is believed. configured: `direction` of
# [lens.focus]. calibration: measured distances. seen: a measurement of the direction alone (KeepDirection). driver: a
# standard, or the maker of the device.
DirectionFrom = Literal["configured", "calibration", "seen", "driver"]


@dataclass(frozen=True, slots=True, kw_only=True)
class AxisInfo:
    """One axis as built and configured."""

    # Which one.
    axis: Axis
    # Unit of native positions.
    unit: Unit
    # Lowest native target accepted, soft limits included.
    minimum: float
    # Highest native target accepted, soft limits included.
    maximum: float
    # Native units between neighbouring targets: a target is rounded to one. Where an axis stands need not be one, as
    # before its first move, or after someone else's.
    resolution: float
    # What a position tells: none (what was commanded), echo (the device repeats its target), counts (steps it made, as
    # far as none was lost) or encoder (where it is, measured on what moves).
    feedback: Literal["none", "echo", "counts", "encoder"]
    # A reference can be searched for.
    can_home: bool
    # Absolute moves are refused until homed.
    needs_home: bool
    # A motion can be ended midway.
    can_stop: bool
    # Feature "direction". Of focus; null: nobody says. Then whatever goes by distance, extension or "nearer" is
    # Unsupported.
    direction: Optional[FocusDirection] = None
    # Feature "direction". Who says so; null where nobody does.
    direction_from: Optional[DirectionFrom] = None
    # Feature "direction". What the driver goes by, for people ("the V4L2 standard"); null where it is not the driver
    # who says so.
    direction_by: Optional[str] = None
    # Feature "setPosition". Of an axis that counts its steps and has no reference to search: SetPosition has said where
    # it stands. False: its positions are what the device reports. Null: something else tells where it stands, or the
    # lens has never answered.
    referenced: Optional[bool] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class OpticsInfo:
    """What is known of the optics."""

    # Focal length.
    focal_length_mm: float
    # Smallest f-number, the widest opening.
    f_number_min: float
    # Largest f-number.
    f_number_max: float
    # Sensor distance beyond the focal length at the far end of focus.
    extension_min_mm: float
    # Sensor distance beyond the focal length at the near end of focus.
    extension_max_mm: float
    # Distance between the principal planes; counts in distances from the sensor.
    principal_gap_mm: float
    # Exit pupil diameter over entrance pupil diameter.
    pupil_factor: float
    # Where distances given by people start.
    distance_from: DistanceFrom
    # How far the sensor may be from where a focus step says: half a step.
    sensor_tolerance_um: float
    # How far the f-number may be from what an iris step says, as a ratio: half a step.
    f_number_tolerance: float
    # Longest focal length of a zoom, null where it does not zoom.
    focal_length_max_mm: Optional[float] = None
    # How far the focal length may be from what is stated, as a ratio; 0 where the configuration does not say.
    focal_length_tolerance: Optional[float] = None
    # How far focus positions can be trusted.
    grade: Grade
    # Greatest error of the calibration in extension, null where it is not known.
    calibration_error_um: Optional[float] = None
    # File the calibration is kept in, as `file` of CalibrationInfo; null where none is kept.
    calibration_file: Optional[str] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraInfo:
    """The camera behind the lens."""

    # Driver that serves it.
    driver: str
    # As the camera names itself.
    model: str
    # Serial number, null where there is none.
    serial: Optional[str] = None
    # Width of a frame.
    width_px: int
    # Height of a frame.
    height_px: int
    # Significant bits a sample.
    bits: int
    # Pixel pitch on the sensor, null when unknown.
    pixel_um: Optional[float] = None
    # Frames a second, null when unknown.
    frame_rate_hz: Optional[float] = None
    # Its pictures have colour, by the format that it sends. Otherwise they are luminance.
    colour: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class LeftOut:
    """Feature "leftOut". A part that a device lists and that cannot be used, as was found when it was opened: the lens
    goes without. It is looked for again when the device is opened again, as by Reload. What the configuration names is
    never left out: without it the lens is absent or wrongDevice."""

    # The name of an axis, or camera (its pictures), exposure, or gain.
    part: str
    # Why it cannot be used.
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class LensInfo:
    """One configured lens."""

    # Name in the configuration.
    name: str
    # Driver that serves it.
    driver: str
    # As the lens names itself, null before it has been there.
    model: Optional[str] = None
    # Serial number, null where there is none.
    serial: Optional[str] = None
    # Its axes.
    axes: list[AxisInfo]
    # Null when nothing is known: such a lens works in native units only.
    optics: Optional[OpticsInfo] = None
    # Null when there is no camera.
    camera: Optional[CameraInfo] = None
    # Feature "leftOut". Parts that its devices have and that cannot be used; empty when all is well.
    left_out: list[LeftOut]


@dataclass(frozen=True, slots=True, kw_only=True)
class AxisStatus:
    """One axis now."""

    # Which one.
    axis: Axis
    # Native position.
    position: float
    # Native position it was last told to go to.
    target: float
    # A motion is under way.
    moving: bool
    # The position refers to a known reference, and nothing has put that in doubt, such as lensd killed in mid-move, or
    # a lens that does not answer.
    homed: bool
    # The lens does not answer, and the position is the last that was known.
    last_known: Optional[bool] = None
    # Largest difference between the native position and where the mechanism stands, while it stands. Null while the
    # lens does not answer.
    position_bound: Optional[float] = None
    # Who moved it last, null when it has not been moved since lensd began.
    moved_by: Optional[MovedBy] = None
    # What the device complains of; null when all is well.
    fault: Optional[str] = None
    # Feature "setPosition". True: it counts its steps, may have lost count of them, and has no reference to search, so
    # that nobody knows where it stands. It moves in its own steps; what needs a calibration or a place that was kept is
    # NotHomed until SetPosition says where it stands.
    position_unknown: Optional[bool] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Counters:
    """What went wrong on the way to a lens and its camera since lensd has opened them. None ever falls."""

    # Frames damaged, incomplete, or missing between two that came.
    frames_lost: int
    # Frames that came more than a whole frame time after they were due by the one before: the next one was due by then.
    frames_late: int
    # Packets of a network camera that never came.
    packets_lost: int
    # Packets of a network camera that came when asked for again.
    packets_resent: int
    # Questions that were not answered, or against the rules of the protocol; those repeated with success included.
    bus_errors: int
    # Readings of the lens' thermometer that cannot be, and were left out.
    temperatures_left_out: Optional[int] = None
    # Feature "badFrames". Of framesLost those that came and could not be used: incomplete, torn, of another size, or no
    # picture to the decoder.
    frames_damaged: Optional[int] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Histogram:
    """How long something took, by how long: counts[i] took at most upToMs[i] and longer than upToMs[i-1]; the last of
    counts, one more than there are bounds, took longer than all of these."""

    # The bounds, rising.
    up_to_ms: list[float]
    # How many took so long.
    counts: list[int]
    # How many there were in all.
    count: int
    # How long all of them took together.
    sum_ms: float


@dataclass(frozen=True, slots=True, kw_only=True)
class LensMetrics:
    """What a lens has done since lensd began, or since it is configured as it is now."""

    # Name of the lens.
    lens: str
    # Moves and homings that ended by themselves: neither stopped nor displaced.
    moves: int
    # Those of them that arrived.
    moves_reached: int
    # Those of them whose arrival was measured.
    moves_verified: int
    # Those of them that came to rest elsewhere, as often as they were tried.
    moves_missed: Optional[int] = None
    # Searches for focus that ended by themselves.
    autofocuses: int
    # Those of them that were sure.
    autofocuses_focused: int
    # Frames that came whole.
    frames: int
    # Feature "badFrames". Those of them that are shown and measured though they have bytes too many, or no end marker
    # (JPEG).
    frames_flawed: Optional[int] = None
    # Calls that were answered with an error because of this lens, or of what it was doing.
    refused: Optional[int] = None
    # Times that its device was opened.
    openings: Optional[int] = None
    # Times that the work on this lens failed, so that it was closed and opened anew.
    failures: Optional[int] = None
    # Commands that wait now until the lens takes them.
    commands_waiting: Optional[int] = None
    # How long commands waited for that.
    wait_ms: Optional[Histogram] = None
    # How long the moves and homings took that ended by themselves, until they had settled.
    settle_ms: Optional[Histogram] = None
    # What went wrong.
    counters: Counters

# What lensd keeps of a lens on disk.
KeptFile = Literal["positions", "calibration"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Unwritten:
    """A file that is older than the truth: what was to be written could not be, and is tried again every second or
    sooner. Where lensd ends before that works, it begins with what the file says: positions are then not known."""

    # Which one.
    file: KeptFile
    # When it could not be written for the first time.
    since_ns: int
    # Why not; it names the file.
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class LensStatus:
    """One lens now."""

    # Name in the configuration.
    name: str
    # The device answers. If not, what follows of its axes is the last that was known, and nothing moves or is homed.
    connected: bool
    # The same with the reason; `error` has it in words.
    connection: Connection
    # A stop holds: nothing moves until ResetFaults.
    latched: Optional[bool] = None
    # Feature "hold". Until when what lensd does by itself waits, by the longest of the holds; null where there is none.
    hold_until_ns: Optional[int] = None
    # What is to be known of the files this lens was opened with: damaged (then it goes without, and a copy is kept), or
    # edited by hand. A calibration that is written since takes its warning away. Also what of its device is not as it
    # should be and costs no part of it, such as an autofocus of its own that could not be switched off.
    warnings: Optional[list[str]] = None
    # Files on disk that are older than what is told here; empty when all is well.
    unwritten: Optional[list[Unwritten]] = None
    # What is wrong, null when all is well.
    error: Optional[str] = None
    # What it is doing.
    activity: Activity
    # Step of the activity, from 1; 0 where it has no steps.
    step: int
    # Steps expected in all; 0 when not known.
    steps_expected: int
    # Its axes.
    axes: list[AxisStatus]
    # Feature "leftOut". As in LensInfo.
    left_out: list[LeftOut]
    # Vergence the lens is focused at, null where the optics or the place of focus are not known.
    vergence_d: Optional[float] = None
    # The same as a distance, null also when infinite or past infinity.
    focal_plane_m: Optional[float] = None
    # Sensor distance beyond the focal length, null where the optics or the place of focus are not known.
    extension_mm: Optional[float] = None
    # F-number, null when unknown.
    f_number: Optional[float] = None
    # Focal length, zoom and breathing counted; null when unknown.
    focal_length_mm: Optional[float] = None
    # How much nearer to the scene the lens centre stands than at the shortest focal length: what distances from the
    # lens are longer by than those from its centre. Null when unknown.
    centre_shift_mm: Optional[float] = None
    # How far this focus position can be trusted, null without optics.
    grade: Optional[Grade] = None
    # Error of the calibration at this focus position, in extension; null where it is not known.
    calibration_error_um: Optional[float] = None
    # Temperature of the lens, null when it has no sensor: the newest reading that can be, by `range_c` and
    # `max_c_per_min` of [lens.temperature].
    temperature_c: Optional[float] = None
    # Why what its sensor reports since then is left out, null when nothing is. `temperaturesLeftOut` of the counters
    # says how often that was.
    temperature_fault: Optional[str] = None
    # What went wrong on the way to it.
    counters: Optional[Counters] = None
    # Who has it alone, null: it is everybody's.
    lease: Optional[LeaseInfo] = None
    # When the device was read; 0: it never was.
    read_at_ns: int
    # Feature "stateBounds". The true vergence of the plane in focus is within this of vergenceD, as far as Grade says;
    # the tolerance of the focal length counts. Null where that is, and while focus moves.
    vergence_bound_d: Optional[float] = None
    # Feature "stateBounds". The true f-number is within this of fNumber, as far as Grade says. Null where that is, and
    # while the iris moves.
    f_number_bound: Optional[float] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Target:
    """Where an axis should go: exactly one field. distanceM, vergenceD and extensionMm are for focus, fNumber for the
    iris; position, relative and nearer are for every axis that has native units."""

    # Distance of the focal plane from where distanceFrom of Move says.
    distance_m: Optional[float] = None
    # Vergence of the focal plane at the lens centre.
    vergence_d: Optional[float] = None
    # Sensor distance beyond the focal length.
    extension_mm: Optional[float] = None
    # F-number.
    f_number: Optional[float] = None
    # Focal length at extension 0, without breathing. Zoom only.
    focal_length_mm: Optional[float] = None
    # Absolute native position.
    position: Optional[float] = None
    # Native steps from where the axis stands.
    relative: Optional[float] = None
    # Native steps toward nearer focus, whatever the wiring; negative is farther. Focus only.
    nearer: Optional[float] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class MoveResult:
    """A finished move or homing."""

    # Name of the lens.
    lens: str
    # Which axis.
    axis: Axis
    # It arrived, as far as the device can tell.
    reached: bool
    # It came to rest: the settling time has passed after arrival.
    settled: bool
    # Arrival was measured: by an encoder on what moves, or because the axis stands at its reference. Steps that are
    # counted are no measurement: then the move is reached, within the bound.
    verified: bool
    # Native position at the end.
    position: float
    # Where it stands is on disk, and known again after a power cut. Null: nothing is kept, or it did not arrive.
    kept: Optional[bool] = None
    # Largest difference between the stated and the true native position.
    position_bound: Optional[float] = None
    # Vergence the lens is focused at; of focus, where the optics are known.
    vergence_d: Optional[float] = None
    # F-number; of the iris, where the optics are known.
    f_number: Optional[float] = None
    # Focal length at extension 0, without breathing; of a zoom whose optics are known.
    focal_length_mm: Optional[float] = None
    # Sensor distance beyond the focal length; of focus, where the optics are known.
    extension_mm: Optional[float] = None
    # Largest difference between the stated and the true extension, as far as Grade says; where extensionMm is told.
    extension_bound_um: Optional[float] = None
    # It came to rest elsewhere, as often as it was tried.
    missed: Optional[bool] = None
    # external: another program took the axis elsewhere meanwhile; it was left there.
    moved_by: MovedBy
    # Largest difference between the stated and the true vergence of the plane in focus, as far as Grade says; the
    # tolerance of the focal length counts. Where vergenceD is told.
    vergence_bound_d: Optional[float] = None
    # Largest difference between the stated and the true focal length, as far as Grade says; where focalLengthMm is
    # told.
    focal_length_bound_mm: Optional[float] = None
    # A zoom that kept the plane in focus: the sensor was within this of where that plane is sharp, all the way.
    tracking_bound_um: Optional[float] = None
    # A zoom that kept the plane in focus: vergence of that plane.
    kept_d: Optional[float] = None
    # An iris move that kept the brightness: exposure time from now on, null where it was left alone.
    exposure_ms: Optional[float] = None
    # An iris move that kept the brightness: brightness now over brightness before; other than 1 where the camera's
    # limits stood in the way: its shortest and longest exposure, and its frame time, unless the exposure was longer
    # already.
    brightness_ratio: Optional[float] = None
    # Why it is not reached or not verified; null when there is nothing to say.
    cause: Optional[MoveCause] = None
    # The same in words.
    reason: Optional[str] = None
    # From the start of the command to its end.
    elapsed_ms: float


@dataclass(frozen=True, slots=True, kw_only=True)
class MoveProgress:
    """A move under way."""

    # Which axis.
    axis: Axis
    # Native position.
    position: float
    # Native target.
    target: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Region:
    """A rectangle of the frame as fractions of its width and height, from the upper left corner."""

    # Left edge, 0 to 1.
    x: float
    # Upper edge, 0 to 1.
    y: float
    # Width, above 0, to 1.
    w: float
    # Height, above 0, to 1.
    h: float


@dataclass(frozen=True, slots=True, kw_only=True)
class FocusRange:
    """The part of the travel in which autofocus takes its frames: from one place of focus to another, in either order,
    ends included. Each is a target of focus; relative ones count from where the lens stands when the search is asked
    for. Where the lens stands outside it, it goes to the nearer end first. Taking up backlash may go beyond an end,
    without frames."""

    # One end.
    from_: Target
    # The other end.
    to: Target


@dataclass(frozen=True, slots=True, kw_only=True)
class FocusStep:
    """How far apart the frames of a search's first pass are at most: exactly one field."""

    # Native steps.
    relative: Optional[float] = None
    # Extension. Where the optics are known, and not of liquid lenses.
    extension_um: Optional[float] = None
    # Change of the blur's diameter. Where extensionUm can be said, and f-number and pixels are known.
    blur_px: Optional[float] = None

# How the lens was during a frame of an autofocus. standing: at rest, its backlash taken up. moving: on its way.
# backlashOpen: at rest, having come against its approach direction; such a frame says where to look and is no answer.
SampleState = Literal["standing", "moving", "backlashOpen"]


@dataclass(frozen=True, slots=True, kw_only=True)
class AutofocusSample:
    """A frame of an autofocus, as one of its regions saw it."""

    # Number of the frame, from 1.
    frame: int
    # Which of the regions asked for, from 0.
    region: int
    # How the lens was.
    state: SampleState
    # Native focus position at mid-exposure.
    position: float
    # The true position was within this of it, null when not known.
    position_bound: Optional[float] = None
    # Vergence in focus there, null where the optics are not known, and of liquid lenses.
    vergence_d: Optional[float] = None
    # Sharpness: gradient energy without that of the noise over squared brightness, which is about 0 where nothing can
    # be seen; or what AutofocusScore said. Comparable within a run; earlier ones change where a later frame shows that
    # a part of the region has to be left out of all.
    score: float
    # Standard deviation of score from frame to frame.
    score_sigma: float
    # Exposure, on CLOCK_MONOTONIC.
    exposure_start_ns: int
    # Its end.
    exposure_end_ns: int

# What an answer rests on. sharpness: the top of the sharpness curve. blur: that, and how blurred the frames around it
# are: the two agree. stars: where points of light are smallest.
FoundBy = Literal["sharpness", "blur", "stars"]


@dataclass(frozen=True, slots=True, kw_only=True)
class AutofocusStars:
    """Points of light in the frame at the answer."""

    # How many were measured: those that touch another one or the frame's edge are not.
    count: int
    # How many of them are too bright for the sensor.
    clipped: int
    # Median of their half-flux radii: the circle about a star's centroid that holds half of its light. Of those that
    # are not clipped; null where all are.
    hfr_px: Optional[float] = None
    # Median of their full widths at half maximum, of Gaussians fitted to them. Null where all are clipped, or none has
    # that shape.
    fwhm_px: Optional[float] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class AutofocusSubject:
    """What an autofocus came to focus on."""

    # Which of the regions asked for, from 0.
    region: int
    # What it was found by.
    found_by: FoundBy
    # Native focus position at which all frames together place the focus. The lens stands near it: no motion is spent on
    # what is a small part of the depth of field.
    position: float
    # Vergence of the subject, null where the optics are not known, and of liquid lenses.
    vergence_d: Optional[float] = None
    # The same as a distance from the lens centre, null also when infinite or past it.
    focal_plane_m: Optional[float] = None
    # Standard deviation of vergenceD.
    sigma_d: Optional[float] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class AutofocusProgress:
    """An autofocus under way."""

    # Frames used so far.
    frames: int
    # Moves made so far.
    moves: int
    # Frames the method expects to need in all; 0 when not known.
    frames_expected: int
    # Native focus position of the last frame.
    position: float
    # Sharpness of the last frame relative to the first, null when not known.
    sharpness: Optional[float] = None
    # The curve so far, region by region, frames as they were taken: the newest 1000.
    samples: list[AutofocusSample]


@dataclass(frozen=True, slots=True, kw_only=True)
class AutofocusCandidate:
    """A place where something is in focus, where there is more than one."""

    # Which of the regions asked for, from 0.
    region: int
    # Native focus position.
    position: float
    # Vergence in focus there, null where the optics are not known, and of liquid lenses.
    vergence_d: Optional[float] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchConditions:
    """Feature "searchConditions". Under what to search, where that is not how the lens stands; what is left out stays
    as it is."""

    # Exposure time.
    exposure_ms: Optional[float] = None
    # Gain, in the unit of the camera's gain as GetExposure tells it.
    gain: Optional[float] = None
    # F-number.
    f_number: Optional[float] = None
    # Native position of the filter.
    filter_position: Optional[float] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class ShiftSize:
    """Feature "searchConditions". How far focus is from where it is under another condition: in extension where the
    optics are known, else in native units of focus."""

    # Extension that focus needs more; null where it is told in native units.
    extension_um: Optional[float] = None
    # Standard deviation of that.
    sigma_um: Optional[float] = None
    # Native units that focus is higher; null where it is told in extension.
    size: Optional[float] = None
    # Standard deviation of that.
    size_sigma: Optional[float] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class FocusShift:
    """Feature "searchConditions". The shift of focus from one f-number to another, or from one filter to another, as it
    was measured."""

    # F-number that it is from, null where it is of filters.
    from_f_number: Optional[float] = None
    # F-number that it is to.
    to_f_number: Optional[float] = None
    # Filter that it is from, null where it is of f-numbers.
    from_filter: Optional[float] = None
    # Filter that it is to.
    to_filter: Optional[float] = None
    # Focal length that a zoom had, null where it does not zoom.
    focal_length_mm: Optional[float] = None
    # How far.
    shift: ShiftSize
    # Pairs of searches that it was measured by; 0 where a person said it.
    pairs: int
    # When, null where it does not say.
    made: Optional[str] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchedUnder:
    """Feature "searchConditions". What became of the conditions of a search."""

    # Exposure time of its frames, as the camera said; null where none was asked for.
    exposure_ms: Optional[float] = None
    # Gain, likewise.
    gain: Optional[float] = None
    # F-number of the search, null where it is not known.
    f_number: Optional[float] = None
    # Where the filter stood, null where there is none.
    filter_position: Optional[float] = None
    # All is again as it was before the search.
    restored: bool
    # What is not, and why; null where all is.
    stays: Optional[str] = None
    # What focus went on by, from where the search found it to where it is without the conditions; 0 where they do not
    # change focus. Null: by nothing.
    shift: Optional[ShiftSize] = None
    # Why by nothing: not measured, as it says then. Null where there is nothing to say.
    shift_reason: Optional[str] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class FocusShiftProgress:
    """How far a measurement of a shift has come."""

    # The search under way, from 1.
    search: int
    # Searches in all.
    searches_expected: int
    # Frames used so far.
    frames: int


@dataclass(frozen=True, slots=True, kw_only=True)
class FocusShiftResult:
    """A finished measurement of a shift."""

    # Name of the lens.
    lens: str
    # It was measured, and is kept.
    measured: bool
    # What it is, null where it was not measured: then what was known before stays.
    shift: Optional[FocusShift] = None
    # Frames it took.
    frames: int
    # Time it took.
    elapsed_ms: float
    # Why the search refused that ended it, null where it was measured.
    cause: Optional[AutofocusCause] = None
    # The same in words, null where it was measured.
    reason: Optional[str] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class AutofocusResult:
    """A finished autofocus."""

    # Name of the lens.
    lens: str
    # It is sure. Otherwise it refused, and the lens is back where it was, unless it is notRestored.
    focused: bool
    # Method used.
    method: str
    # Frames used.
    frames: int
    # Moves made.
    moves: int
    # From the start of the command to its end.
    elapsed_ms: float
    # Vergence where the lens now stands, null where the optics are not known, and of liquid lenses.
    vergence_d: Optional[float] = None
    # Standard deviation of the answer, null where vergenceD is, or refused.
    sigma_d: Optional[float] = None
    # Native focus position at the end.
    position: float
    # 0 to 1.
    confidence: float
    # Why it believes the answer, or why it refused.
    cause: AutofocusCause
    # The same in words.
    reason: str
    # What there was to choose from: one for each of several regions in focus, or the depths found in a region that was
    # refused for having several. Absent where there is no choice.
    candidates: Optional[list[AutofocusCandidate]] = None
    # What was focused on, null where it refused.
    subject: Optional[AutofocusSubject] = None
    # The curve of this search, as in AutofocusProgress.
    samples: list[AutofocusSample]
    # The regions looked at: those asked for, else the camera's own.
    regions: list[Region]
    # Feature "stars". What was focused on by the method stars, null where it was another.
    stars: Optional[AutofocusStars] = None
    # Feature "searchConditions". What became of the conditions of the search; null where it had none of its own.
    conditions: Optional[SearchedUnder] = None
    # Feature "learned". What it knew of the lens' blur and what it saw of it; null where both is nothing.
    slope: Optional[AutofocusSlope] = None
    # Feature "badFrames". Frames that were not used: black, torn, or of a place where the lens was before. They count
    # in frames, and samples has none of them. Absent where there are none.
    frames_left_out: Optional[list[AutofocusLeftOut]] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class AutofocusLeftOut:
    """Feature "badFrames". A frame of an autofocus that was not used; another one was taken in its place."""

    # Number of the frame, from 1.
    frame: int
    # Native focus position that it was taken at.
    position: float
    # Why, in words.
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class KnownSlope:
    """Feature "learned". The blur that a step of focus makes, over what the configuration and the calibration tell, as
    earlier autofocus runs have shown it."""

    # Their mean.
    factor: float
    # Between this and `high` the next run is expected, with 95 %.
    low: float
    # See `low`.
    high: float
    # Number of runs that it is learned from: 3 to 10, the newest that were made with iris and zoom where they stand.
    runs: int
    # Feature "learnedSides". Blur grows at most so many times as fast on one side of focus as on the other, with 95 %:
    # near 1, a search may do with three frames. Null: fewer than three of the runs have shown it.
    uneven: Optional[float] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class AutofocusSlope:
    """Feature "learned". The blur that a step of focus makes, in one autofocus."""

    # As its frames showed it, over what is told; null where they did not.
    shown: Optional[float] = None
    # As earlier runs had shown it: the search went by this instead of what is told. Null: by what is told.
    known: Optional[KnownSlope] = None
    # The two contradict each other, as with another lens: what was learned is forgotten, if focus was found.
    another_lens: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class FocusMapCell:
    """Feature "focusMap". One region of a focus map."""

    # Its column from the left, from 0.
    column: int
    # Its row from the top, from 0.
    row: int
    # The region.
    region: Region
    # Its middle, as a fraction of the frame's width from the left.
    x: float
    # Its middle, as a fraction of the frame's height from the top.
    y: float
    # found, or why it is not known where it is in focus.
    cause: AutofocusCause
    # The same in words.
    reason: str
    # Native focus position at which it is in focus, null where cause is not found.
    position: Optional[float] = None
    # Vergence in focus there, null where position is.
    vergence_d: Optional[float] = None
    # Extension there beyond that at which the frame as a whole is least out of focus; null where position is, or where
    # there is no surface.
    extension_um: Optional[float] = None
    # Standard deviation of that by this region's own frames, null where position is.
    sigma_um: Optional[float] = None
    # Extension there beyond the fitted surface, null where extensionUm is.
    off_um: Optional[float] = None
    # It is too far off to lie on the surface, and was left out of the fit.
    outlier: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class FocusTilt:
    """Feature "focusMap". How best focus changes along one side of the frame. The angles are two readings of the same:
    each would explain all of it."""

    # Extension of best focus at the right edge beyond that at the left; down: at the lower edge beyond the upper.
    rise_um: float
    # Standard deviation of that.
    sigma_um: float
    # Angle of the sensor that explains it, positive where the side that shows the right (lower) edge of the picture is
    # too near to the lens; null where the pixels' size is not known.
    sensor_deg: Optional[float] = None
    # Standard deviation of that.
    sensor_sigma_deg: Optional[float] = None
    # Angle of the target that explains it, positive where its right (lower) edge is nearer; null where sensorDeg is,
    # and where the target is so far away that no angle would.
    target_deg: Optional[float] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class FocusSurface:
    """Feature "focusMap". The smooth surface that best focus lies on over the frame: a plane and a bowl."""

    # The plane's slope along the frame's width: a turn about the vertical (y) axis.
    across: FocusTilt
    # Along its height: a turn about the horizontal (x) axis.
    down: FocusTilt
    # Extension of best focus in the corners beyond the middle, null where too few regions tell.
    curvature_um: Optional[float] = None
    # Standard deviation of that.
    curvature_sigma_um: Optional[float] = None
    # Standard deviation by which regions are off the surface beyond their own sigmaUm. It counts in the errors above.
    scatter_um: float
    # The region that is farthest out of focus where the lens now stands is so by this, by the surface.
    left_um: float
    # Diameter of the blur there, null where the f-number or the pixels' size are not known.
    left_px: Optional[float] = None
    # How many regions it was fitted to.
    used: int


@dataclass(frozen=True, slots=True, kw_only=True)
class FocusMapResult:
    """Feature "focusMap". A finished focus map."""

    # Name of the lens.
    lens: str
    # It is sure. Otherwise it refused, and the lens is back where it was.
    mapped: bool
    # Why it believes the map, or why it refused.
    cause: AutofocusCause
    # The same in words.
    reason: str
    # Columns of the grid.
    columns: int
    # Rows of the grid.
    rows: int
    # The regions, row by row. Empty where the search did not come to its end.
    cells: list[FocusMapCell]
    # What was fitted to them, null where it refused.
    surface: Optional[FocusSurface] = None
    # Size of the target on the sensor over its own, from vergenceD; null where it refused.
    magnification: Optional[float] = None
    # Frames used.
    frames: int
    # Moves made.
    moves: int
    # From the start of the command to its end.
    elapsed_ms: float
    # Native focus position at the end: where the frame as a whole is least out of focus.
    position: float
    # Vergence in focus there.
    vergence_d: Optional[float] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class AutofocusStep:
    """Where an autofocus session wants its next frame. The lens stands there."""

    # Number of the frame, from 1.
    frame: int
    # Frames the method expects to need in all; 0 when not known.
    frames_expected: int
    # Native focus position.
    position: float
    # Sensor distance beyond the focal length, null where the optics are not known.
    extension_mm: Optional[float] = None
    # Vergence the lens is focused at, null where the optics are not known.
    vergence_d: Optional[float] = None
    # When it had come to rest there: exposures that begin now or later will do.
    settled_at_ns: int
    # The curve so far, as in AutofocusProgress.
    samples: list[AutofocusSample]

# How the pixels of a frame are written: one byte, or two with the lower byte first, of which so many bits count.
PixelFormat = Literal["mono8", "mono10le", "mono12le", "mono16le"]

# What a gain is counted in. native: as the camera counts it; of GenICam cameras that is mostly dB.
GainUnit = Literal["dB", "native"]


@dataclass(frozen=True, slots=True, kw_only=True)
class ExposureInfo:
    """How a camera exposes, and what it can be set to."""

    # Name of the lens.
    lens: str
    # Exposure time as the camera says it is set, null where it does not say.
    exposure_ms: Optional[float] = None
    # The exposure time can be set.
    can_set_exposure: bool
    # Shortest that can be set, null when unknown.
    exposure_min_ms: Optional[float] = None
    # Longest that can be set, null when unknown.
    exposure_max_ms: Optional[float] = None
    # From one that can be set to the next, counted from the shortest; null where any can be, or when unknown.
    exposure_step_ms: Optional[float] = None
    # Gain as the camera says it is set, null where it does not say.
    gain: Optional[float] = None
    # The gain can be set.
    can_set_gain: bool
    # Lowest that can be set, null where it cannot.
    gain_min: Optional[float] = None
    # Highest that can be set, null where it cannot.
    gain_max: Optional[float] = None
    # From one that can be set to the next, counted from the lowest; null where any can be, or when unknown.
    gain_step: Optional[float] = None
    # What gain is counted in, null where it cannot be set.
    gain_unit: Optional[GainUnit] = None

# How a picture is written. png: colour where there is any, 8 or 16 bits, others scaled to the full range of 16. jpeg:
# for eyes, 8 bits, its light brought to the gamma of a screen. raw: the samples as they are, row after row without
# gaps, one byte each up to 8 bits, beyond that two with the lower byte first; of a colour picture red, green, blue.
# gray8: the luminance, a byte each, at the frame's own gamma. rgb8: red, green and blue, a byte each, at the frame's
# own gamma; refused with Unsupported where the camera has no colour.
Encoding = Literal["png", "jpeg", "raw", "gray8", "rgb8"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Size:
    """A size in pixels."""

    # Width, at least 1.
    width_px: int
    # Height, at least 1.
    height_px: int


@dataclass(frozen=True, slots=True, kw_only=True)
class PictureInfo:
    """A picture made of a frame."""

    # How it is written.
    encoding: Encoding
    # Left edge of the part of the frame that it shows, in pixels of the frame.
    left_px: int
    # Upper edge of it.
    top_px: int
    # Width of the picture.
    width_px: int
    # Height of the picture.
    height_px: int
    # Samples a pixel: 1 is luminance, 3 is red, green, blue.
    channels: int
    # Significant bits a sample.
    bits: int
    # Sample = light^(1/gamma); 1 is linear light.
    gamma: float
    # How many samples of the luminance of that part lie in each of 64 equal parts of the full scale, before it was made
    # smaller. Of every row, or of every second, third ... where it has more than a million pixels. Only in View.
    histogram: Optional[list[int]] = None
    # How sharp that part is, before it was made smaller: gradient energy without noise over squared mean light, to be
    # compared between frames of one scene. A little below 0 where there is hardly more than noise. Only in View; null
    # below 3 pixels a side.
    sharpness: Optional[float] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class AxisDuring:
    """One axis during an exposure."""

    # Which one.
    axis: Axis
    # Native position, the middle of where it was.
    position: float
    # Largest difference between that and where the mechanism stood at any time of the exposure.
    position_bound: float
    # It moved, or had not settled.
    moving: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameInfo:
    """A frame of the camera, and the lens during its exposure."""

    # Width of the frame.
    width_px: int
    # Height of the frame.
    height_px: int
    # Significant bits a sample of the camera.
    bits: int
    # Sample = light^(1/gamma); 1 is linear light.
    gamma: float
    # Counts the camera's frames, lost ones included.
    sequence: int
    # Exposure time.
    exposure_ms: float
    # When the exposure began.
    exposure_start_ns: Optional[int] = None
    # When it ended.
    exposure_end_ns: Optional[int] = None
    # Sensor distance beyond the focal length, null where the optics or the place of focus are not known.
    extension_mm: Optional[float] = None
    # The true extension during the exposure was within this of it, as far as Grade says; null where that is.
    extension_bound_um: Optional[float] = None
    # F-number, null when unknown.
    f_number: Optional[float] = None
    # The true f-number was within this of it, as far as Grade says; null when unknown.
    f_number_bound: Optional[float] = None
    # An axis moved during the exposure.
    moving: bool
    # Every axis during the exposure.
    axes: list[AxisDuring]


@dataclass(frozen=True, slots=True, kw_only=True)
class Depth:
    """Where something is along the axis from the lens centre: exactly one field."""

    # Distance, above 0.
    distance_m: Optional[float] = None
    # Vergence; 0 is infinity.
    vergence_d: Optional[float] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class DepthInterval:
    """Every depth between two ends, in either order; equal ends are one depth."""

    # One end.
    one_end: Depth
    # The other end.
    other_end: Depth


@dataclass(frozen=True, slots=True, kw_only=True)
class BlurLimit:
    """A limit on the blur of a subject."""

    # Its name in answers and conflicts, another one for each limit; its place in the list, such as limits[0], when left
    # out. focus, fNumber and extension are refused; depth and positions are not, but stand for something else in
    # `conflict`.
    name: Optional[str] = None
    # sharp: the blur is at most limitUm at every depth; blurred: at least.
    kind: Literal["sharp", "blurred"]
    # Diameter of the blur disk on the sensor, above 0; one pixel when both this and limitPx are left out.
    limit_um: Optional[float] = None
    # The same in pixels.
    limit_px: Optional[float] = None
    # Where the subject is.
    depths: list[DepthInterval]
    # Side of the focal plane a blurred subject lies on: behind is farther than the plane. Either when left out. It does
    # not count for sharp ones.
    side: Optional[Literal["either", "behind", "front"]] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanRequestField:
    """PlanRequest.PlanRequestField"""

    width_m: float
    distance_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanRequest:
    """A question to the planner. What is left out is the lens' own as it stands now: its focal length, breathing,
    ranges, pixel, calibration, and the bounds within which its motors keep their word."""

    # Where distances start. As configured when left out.
    distance_from: Optional[DistanceFrom] = None
    # Focal length a zoom shall go to. Where it stands when left out.
    focal_length_mm: Optional[float] = None
    # Instead, any focal length from this one ...
    focal_length_min_mm: Optional[float] = None
    # ... to this one: the best for the limits is chosen.
    focal_length_max_mm: Optional[float] = None
    # Instead, the focal length at which a field of this width fills the sensor, focused there.
    field: Optional[PlanRequestField] = None
    # Width of the sensor for `field` (without that it does not count); the camera's when left out.
    sensor_width_mm: Optional[float] = None
    # The fewest shots that together keep every sharp limit, instead of one setting.
    stack: Optional[bool] = None
    # apertureMin, apertureMax and stops are diameters in millimetres, not f-numbers. False when left out.
    apertures_are_diameters: Optional[bool] = None
    # Low end of the apertures.
    aperture_min: Optional[float] = None
    # High end of the apertures.
    aperture_max: Optional[float] = None
    # The only apertures there are; replaces the range. An empty list counts as left out.
    stops: Optional[list[float]] = None
    # Low end of the sensor distance beyond the focal length.
    extension_min_mm: Optional[float] = None
    # High end of it.
    extension_max_mm: Optional[float] = None
    # Where the focal plane must be; anywhere when left out.
    focus: Optional[Depth] = None
    # The plan holds for every sensor position within this of its own. What is less than the motors keep, also below 0,
    # stands for what they keep; so too of fNumberTolerance.
    sensor_tolerance_um: Optional[float] = None
    # The plan holds for every f-number within this ratio of its own.
    f_number_tolerance: Optional[float] = None
    # Counts diffraction at this wavelength in sharp limits.
    wavelength_nm: Optional[float] = None
    # How diffraction is counted, where a wavelength is given. By the Airy disk when left out.
    diffraction: Optional[Literal["airy", "mtf50"]] = None
    # Exit pupil diameter over entrance pupil diameter.
    pupil_factor: Optional[float] = None
    # What is best: light (smallest f-number), sharp (smallest worst ratio of blur to limit) or depth (greatest depth of
    # field at `focus`). Light when left out.
    objective: Optional[Literal["light", "sharp", "depth"]] = None
    # Blur that still counts as sharp for the objective depth, which needs it and `focus`; otherwise it does not count.
    blur_limit_um: Optional[float] = None
    # The same in pixels.
    blur_limit_px: Optional[float] = None
    # Pixel pitch.
    pixel_um: Optional[float] = None
    # What the camera model may leave out.
    model_tolerance_um: Optional[float] = None
    # The same in pixels.
    model_tolerance_px: Optional[float] = None
    # The limits.
    limits: Optional[list[BlurLimit]] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanLimit:
    """How one limit fares, tolerances included."""

    # Its name.
    name: str
    # Near end of its depths.
    near_d: Optional[float] = None
    # Far end of its depths.
    far_d: Optional[float] = None
    # The limit.
    limit_um: Optional[float] = None
    # Greatest blur for a sharp limit, least for a blurred one.
    worst_um: Optional[float] = None
    # Where that is.
    at_d: Optional[float] = None
    # worstUm/limitUm, or its inverse for a blurred limit: it holds when at most 1.
    ratio: Optional[float] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class StackShot:
    """One picture of a focus stack."""

    # The f-number, the same for all shots of a stack.
    f_number: float
    # Sensor distance beyond the focal length.
    extension_mm: float
    # Focal length there.
    focal_length_mm: float
    # Width of the field there at the distance of `field`.
    field_width_m: Optional[float] = None
    # Near end of what this shot keeps sharp.
    near_d: Optional[float] = None
    # Far end of it.
    far_d: Optional[float] = None
    # Image size over object size at the focal plane.
    magnification: float
    # Native position of focus, null where there is no such motor.
    focus_position: Optional[float] = None
    # Native position of the iris, null where there is no such motor.
    iris_position: Optional[float] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanAnswerDepthOfField:
    """PlanAnswer.PlanAnswerDepthOfField"""

    near_d: Optional[float] = None
    far_d: Optional[float] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanAnswerRelaxed:
    """PlanAnswer.PlanAnswerRelaxed"""

    f_number: Optional[float] = None
    extension_mm: Optional[float] = None
    focal_plane_d: Optional[float] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanAnswer:
    """The planner's answer. An infeasible one has `conflict` and `relax`, a feasible one all the others but those of a
    stack, which has `shots` alone, with `field` the framing of the first beside them, or `reason` where there can be
    none."""

    # There is such a setting.
    feasible: bool
    # The f-number: the focal length at extension 0 over the opening.
    f_number: Optional[float] = None
    # Focal length, zoom and breathing counted.
    focal_length_mm: Optional[float] = None
    # Width of the field at the distance of `field`.
    field_width_m: Optional[float] = None
    # Native position of focus, null where there is no such motor.
    focus_position: Optional[float] = None
    # Native position of the iris, null where there is no such motor.
    iris_position: Optional[float] = None
    # Native position of the zoom, where it moves.
    zoom_position: Optional[float] = None
    # The shots of a stack, from far to near.
    shots: Optional[list[StackShot]] = None
    # Why there can be no stack.
    cause: Optional[StackCause] = None
    # The same in words.
    reason: Optional[str] = None
    # Diameter of the entrance pupil.
    aperture_diameter_mm: Optional[float] = None
    # F-number that counts for light at this magnification.
    working_f_number: Optional[float] = None
    # The same for a lens that transmits everything.
    t_stop: Optional[float] = None
    # Light on the axis relative to an aperture as wide as its distance from the sensor: (A/Z)^2.
    light_paraxial: Optional[float] = None
    # The same exactly, 4 sin^2 of half the angle below.
    light_exact: Optional[float] = None
    # Angle the aperture subtends at the sensor.
    subtended_angle_deg: Optional[float] = None
    # Image size over object size at the focal plane.
    magnification: Optional[float] = None
    # Sensor distance beyond the focal length.
    extension_mm: Optional[float] = None
    # Lens centre to sensor.
    sensor_distance_mm: Optional[float] = None
    # The focal plane.
    focal_plane_d: Optional[float] = None
    # The same as a distance, null at infinity and past it.
    focal_plane_m: Optional[float] = None
    # The same from the sensor mark.
    focus_from_sensor_m: Optional[float] = None
    # Worst ratio of all limits.
    worst_ratio: Optional[float] = None
    # Camera model used: the simplest that is good enough.
    model: Optional[str] = None
    # Bound on what that model leaves out of the blur that was asked about: geometric blur alone without a wavelength.
    model_error_um: Optional[float] = None
    # Not told by lensd. `lensctl plan` without a lens says it where no wavelength is given: the diffraction disk at 550
    # nm and this plan's working f-number, which no limit counts.
    diffraction_um: Optional[float] = None
    # The limits, in the order asked.
    limits: Optional[list[PlanLimit]] = None
    # What is acceptably sharp, for the objective depth.
    depth_of_field: Optional[PlanAnswerDepthOfField] = None
    # Names that together are infeasible; without any one of them there is a plan. Beside names of limits: focus
    # (`focus` of the request), fNumber (apertureMin, apertureMax, stops, or the lens' own), extension (extensionMinMm,
    # extensionMaxMm, or the lens' own), depth (what the objective depth asks for), positions (those the motors can
    # take: see Plan).
    conflict: Optional[list[str]] = None
    # Smallest factor on all limits that makes it feasible, null when none does. Where the conflict is "positions": the
    # worst ratio of `nearest`.
    relax: Optional[float] = None
    # The setting that this factor allows, null where `relax` is. Where the conflict is "positions" its numbers are 0
    # and mean nothing: `nearest` is that setting.
    relaxed: Optional[PlanAnswerRelaxed] = None
    # Something the reader should know.
    note: Optional[str] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class FoundDevice:
    """Something plugged into this machine that a driver would take."""

    # The driver.
    driver: str
    # As the device names itself.
    model: str
    # Serial number, null where it has none.
    serial: Optional[str] = None
    # Where it is: a device node or an address; null where it has none.
    node: Optional[str] = None
    # It offers a lens.
    lens: bool
    # It offers a camera.
    camera: bool
    # Lines to paste into the configuration.
    config: str
    # Why the daemon could not open it now and what to do; null when it could.
    problem: Optional[str] = None
    # Lens of the configuration that has it; null when none has.
    used_by: Optional[str] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class FailedSearch:
    """A driver that could not search."""

    # The driver.
    driver: str
    # Why.
    message: str


@dataclass(frozen=True, slots=True, kw_only=True)
class LeaseInfo:
    """Who has a lens for itself."""

    # The program, process and user that took it, or renewed it last.
    holder: str
    # When it ends, null: with the connection it was taken on.
    until_ns: Optional[int] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Progress:
    """How far something has come: exactly one field is set."""

    # An axis is under way.
    move: Optional[MoveProgress] = None
    # An autofocus is, with the lens' own camera or in a session.
    autofocus: Optional[AutofocusProgress] = None
    # A measurement of backlash is.
    backlash: Optional[BacklashProgress] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultChange:
    """An axis complains of something, or of nothing any more."""

    # Which one.
    axis: Axis
    # What the device complains of, null: of nothing any more.
    fault: Optional[str] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class ThermometerChange:
    """The readings of a thermometer are left out, or are believed again."""

    # Why they are left out, null: they are believed again.
    fault: Optional[str] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class LeaseChange:
    """A lease changed. renewed: by the same holder, or its lens was opened anew and it goes on. takenOver: by another
    one, who gave its key."""

    # What became of it.
    change: Literal["taken", "renewed", "takenOver", "ended"]
    # Who has it, or had it.
    holder: str
    # When it ends or would have ended, null: with the connection it was taken on.
    until_ns: Optional[int] = None
    # Why it ended, otherwise null. dropped: by a call of DropLease. expired: its time was over. disconnected: the
    # connection it was taken on closed. reopened: the configuration was read again, and has no such lens any more.
    cause: Optional[Literal["dropped", "expired", "disconnected", "reopened"]] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrationChange:
    """The calibration of a lens changed, its backlash included: GetCalibration tells what is in force."""

    # How far it can be trusted now.
    grade: Grade
    # Greatest error in extension, null where it is not known.
    error_um: Optional[float] = None
    # It could be written. False: it is forgotten when lensd ends.
    kept: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class PresetChange:
    """The presets of a lens changed."""

    # saved: in place of what had this label, if anything had.
    change: Literal["saved", "removed"]
    # Which one.
    label: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ListChange:
    """What there is changed. opened: the lens answers, and what List says of it may be new. gone: it does not answer.
    added, removed, reopened: by Reload."""

    # What changed.
    change: Literal["opened", "gone", "added", "removed", "reopened"]
    # Whether it answers now, null where Reload changed the list.
    connection: Optional[Connection] = None
    # Why, null where there is nothing to say.
    reason: Optional[str] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Event:
    """Something that happened to a lens: exactly one of the fields from `status` on is set. status and progress are
    passing: a newer one of the same lens (and axis) stands for those that were left out before it. All others are
    lasting: none is left out. Both numbers count what happened to this lens in this run of lensd, whether a client
    looked on or not, and rise within a stream; lensd opens a lens anew without counting anew. From one event of a lens
    to the next of it that a client was told, also over another connection, as long as `instance` is the same: the
    difference of `sequence` is how many events it was not told, the second one itself included, and that of `lasting`
    how many of these were lasting. (The states that a stream begins with are no events of their own: nothing is to be
    taken off there.) Within one stream none of those left out is lasting."""

    # Name of this run of lensd, as in List. Another one: lensd began anew, and so did the numbers; it cannot be told
    # what happened meanwhile.
    instance: str
    # The lens it happened to.
    lens: str
    # Counts all events of this lens. The states that a stream begins with happen at no time of their own: they carry
    # the number of what happened last, 0 where nothing has.
    sequence: int
    # How many of those, up to this one, are lasting.
    lasting: int
    # The state of a lens: first of every lens, then at each change, and before every lasting event that goes with a
    # change.
    status: Optional[LensStatus] = None
    # Something has come further.
    progress: Optional[Progress] = None
    # A move or homing ended by itself. One that was stopped or displaced has no result: its caller alone is told.
    move: Optional[MoveResult] = None
    # An autofocus ended by itself.
    autofocus: Optional[AutofocusResult] = None
    # A measurement of backlash ended by itself, or backlash was said.
    backlash: Optional[BacklashResult] = None
    # An axis complains, or not any more.
    fault: Optional[FaultChange] = None
    # What the lens' thermometer reports cannot be, or can be again.
    thermometer: Optional[ThermometerChange] = None
    # A lease changed.
    lease: Optional[LeaseChange] = None
    # The calibration changed.
    calibration: Optional[CalibrationChange] = None
    # The presets changed.
    preset: Optional[PresetChange] = None
    # Lenses came or went.
    list: Optional[ListChange] = None
    # Feature "refocus". lensd has corrected focus by itself, or tried to.
    refocus: Optional[Refocus] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class EventMark:
    """Up to where a stream has told of a lens, as in Event."""

    # The lens.
    lens: str
    # `sequence` of the last event of it.
    sequence: int
    # `lasting` of the last event of it.
    lasting: int


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrationPoint:
    """A focus position whose focus is known: exactly one of the distance, the vergence and the extension."""

    # Native focus position.
    position: float
    # Distance of what is in focus there, from where distanceFrom of Calibrate says.
    distance_m: Optional[float] = None
    # Vergence of what is in focus there, at the lens centre.
    vergence_d: Optional[float] = None
    # Sensor distance beyond the focal length there.
    extension_mm: Optional[float] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrationInfo:
    """The calibration of a lens as it is in force."""

    # Name of the lens.
    lens: str
    # How far focus can be trusted now. `toml` may name another grade: where it has no curve of focus (backlash alone),
    # or none for the conditions of this moment.
    grade: Grade
    # Greatest error in extension, null where it is not known.
    error_um: Optional[float] = None
    # File it is kept in, which may not be there yet; null: it is not kept, and forgotten at the daemon's end. A path
    # that is not absolute starts where lensd was started.
    file: Optional[str] = None
    # What is kept: curves, backlash, or both. Null: nothing.
    toml: Optional[str] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class BacklashResult:
    """What is known of the backlash of an axis."""

    # Name of the lens.
    lens: str
    # Which axis.
    axis: Axis
    # It is known now. False: it could not be measured, and what was known before stays.
    known: bool
    # It was measured; otherwise the user stated it.
    measured: bool
    # Native units that a reversal loses.
    size: Optional[float] = None
    # Low end of the 95 % confidence interval.
    size_low: Optional[float] = None
    # High end of the 95 % confidence interval: as much is taken up at every reversal.
    size_high: Optional[float] = None
    # Frames it took.
    frames: int
    # Time it took.
    elapsed_ms: float
    # Why it was not measured, or what keeps it from being in force; null when there is nothing to say.
    cause: Optional[BacklashCause] = None
    # The same in words.
    reason: Optional[str] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class BacklashProgress:
    """A measurement of backlash under way."""

    # Sweep, from 1.
    sweep: int
    # Sweeps expected in all.
    sweeps_expected: int
    # Frames used so far.
    frames: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Preset:
    """A lens state under a label."""

    # Its label.
    label: str
    # When it was saved: date and time, UTC.
    saved: str
    # Native position of focus, null: no such axis.
    focus_position: Optional[float] = None
    # The same of the iris.
    iris_position: Optional[float] = None
    # The same of the zoom.
    zoom_position: Optional[float] = None
    # Place of the filter wheel.
    filter_position: Optional[float] = None
    # Focus was approached moving toward larger positions.
    approach_up: bool
    # Vergence of the plane in focus, null where the optics or the place of focus were not known.
    vergence_d: Optional[float] = None
    # The true one was within this of it, as far as Grade says.
    vergence_bound_d: Optional[float] = None
    # The same plane as a distance, null at infinity and past it.
    focal_plane_m: Optional[float] = None
    # F-number.
    f_number: Optional[float] = None
    # Focal length at extension 0, without breathing.
    focal_length_mm: Optional[float] = None
    # Temperature of the lens.
    temperature_c: Optional[float] = None
    # How far the focus position could be trusted.
    grade: Grade


@dataclass(frozen=True, slots=True, kw_only=True)
class RecallResult:
    """A preset recalled."""

    # Name of the lens.
    lens: str
    # The preset.
    label: str
    # Every axis is where the preset had it.
    reached: bool
    # The plane in focus is within this of the one that was saved; null where the preset or the lens has no vergence.
    vergence_bound_d: Optional[float] = None
    # Focus is within this of the place that was saved, in native units; told where vergenceBoundD is not.
    position_bound: Optional[float] = None
    # What was moved, in order.
    moves: list[MoveResult]
    # Something the reader should know.
    note: Optional[str] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class FocusAtValue:
    """Feature "focusAt". One coordinate that is not the lens's own, such as that of a stage: as the client names and
    counts it."""

    # Its name.
    name: str
    # Its value.
    value: float
    # Its unit, null where it has none.
    unit: Optional[str] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class FocusAtSample:
    """Feature "focusAt". Focus as it was found at one place."""

    # The place.
    at: list[FocusAtValue]
    # Native position of focus, as it was found.
    position: float
    # Standard deviation of that.
    sigma: float
    # By how much what it says of this moment is off the surface; null where there is no surface.
    off: Optional[float] = None
    # It is too far off to lie on the surface, and was left out of the fit.
    outlier: bool
    # Temperature that it was found at, null where there is no thermometer.
    temperature_c: Optional[float] = None
    # Where the zoom stood, null where there is none.
    zoom_position: Optional[float] = None
    # Where the filter stood, null where there is none.
    filter_position: Optional[float] = None
    # F-number that it was found at, null where it is not known.
    f_number: Optional[float] = None
    # When: date and time, UTC.
    made: str


@dataclass(frozen=True, slots=True, kw_only=True)
class FocusAtSurface:
    """Feature "focusAt". What is known of focus over coordinates that are not the lens's own."""

    # Name of the lens.
    lens: str
    # The samples, oldest first. The first has the number 1.
    samples: list[FocusAtSample]
    # There is a surface through them now.
    fitted: bool
    # Why there is none; null where there is.
    reason: Optional[str] = None
    # The least of each coordinate that the surface covers; null where there is none.
    low: Optional[list[FocusAtValue]] = None
    # The greatest of each.
    high: Optional[list[FocusAtValue]] = None
    # It is curved, not a plane; null where there is none.
    curved: Optional[bool] = None
    # Standard deviation by which samples are off the surface beyond their own; null where there is none.
    scatter: Optional[float] = None
    # What the temperature has added to the samples since, on average; null where there is no surface.
    correction: Optional[float] = None
    # Where another sample would tell most: an outlier again, once, else where the surface is least sure. Null: nowhere,
    # or there is no surface.
    next: Optional[list[FocusAtValue]] = None
    # What the samples do not tell, and which to forget; null where there is nothing to say.
    note: Optional[str] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class FocusAtPlace:
    """Feature "focusAt". Focus as the surface has it at one place."""

    # The place.
    at: list[FocusAtValue]
    # Native position of focus.
    position: float
    # Standard deviation of that.
    sigma: float
    # Vergence in focus there, null where the optics are not known.
    vergence_d: Optional[float] = None
    # Standard deviation of that, null where vergenceD is.
    sigma_d: Optional[float] = None
    # What the samples do not tell, null where there is nothing to say.
    note: Optional[str] = None

# Feature "refocus". What starts a correction of focus: a change of temperature, a time that is over, another filter,
# lost sharpness.
RefocusCause = Literal["temperature", "time", "filter", "sharpness"]

# Feature "refocus". How one ended: focus was moved by what was learned or measured; searched and found; the search was
# refused, and the lens is back where it was; or neither, because a stop, a command or a failure of the lens ended it.
RefocusEnd = Literal["moved", "searched", "refused", "failed"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Refocus:
    """Feature "refocus". One correction of focus that lensd made by itself, or tried to ([lens.refocus] of the
    configuration)."""

    # Name of the lens.
    lens: str
    # When it ended.
    at_ns: int
    # What started it.
    cause: RefocusCause
    # How it ended.
    end: RefocusEnd
    # Why that way, for people.
    reason: str
    # Temperature then, null where there is no thermometer.
    temperature_c: Optional[float] = None
    # Where focus stands since, null where that is not known.
    position: Optional[float] = None
    # By how much extension it was moved; null where it was searched, or the optics are not known.
    by_um: Optional[float] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class DriftResult:
    """Feature "refocus". What one autofocus has told of focus and temperature."""

    # Results with the same number are of the same thing under the same conditions.
    subject: int
    # Temperature then.
    temperature_c: float
    # Extension of the position where focus was found, corrected for no temperature.
    extension_um: float
    # Standard deviation of that.
    sigma_um: float
    # By how much it is off what the coefficient says; 0 where there is none.
    off_um: float
    # It does not go with the others, and was left out.
    outlier: bool
    # When: date and time, UTC.
    made: str


@dataclass(frozen=True, slots=True, kw_only=True)
class FocusDrift:
    """Feature "refocus". How focus goes with the temperature, learned from autofocus results alone."""

    # Micrometres of extension gained per degree at one focus position, as `um_per_c` of [lens.temperature] has it.
    um_per_c: float
    # Its 95 % interval.
    low_um_per_c: float
    # Its upper end.
    high_um_per_c: float
    # Lowest temperature that it was learned at.
    coldest_c: float
    # Highest temperature that it was learned at.
    hottest_c: float
    # Number of results that it was learned from.
    results: int


@dataclass(frozen=True, slots=True, kw_only=True)
class RefocusState:
    """Feature "refocus". What lensd does by itself to keep a lens in focus."""

    # Name of the lens.
    lens: str
    # An autofocus has reached focus, and lensd looks after it.
    active: bool
    # Why it does not, or what a correction that is due waits for; null where neither is so.
    reason: Optional[str] = None
    # What was learned; null where that is too little.
    drift: Optional[FocusDrift] = None
    # What is missing then.
    drift_reason: Optional[str] = None
    # What it was learned from, oldest first; at most 200. The first has the number 1.
    results: list[DriftResult]
    # The newest correction since the lens was configured; null where there was none.
    last: Optional[Refocus] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class LearnedRun:
    """Feature "learned". What one autofocus has shown of the blur that a step of focus makes."""

    # That blur over the one that the configuration and the calibration told at that time.
    shown: float
    # Native focus position at the end.
    position: float
    # Pixels of blur that a native unit of focus makes there.
    blur_px_per_unit: float
    # Pitch of the pixels as it was told.
    pixel_um: float
    # Where the iris stood, null where the lens has no motorised one.
    iris_position: Optional[float] = None
    # Where the zoom stood, likewise.
    zoom_position: Optional[float] = None
    # The frames were those of a client (AutofocusBegin).
    frames_from_outside: bool
    # Feature "learnedSides". Blur at extensions above that of focus over blur as far below it; null where too few
    # frames were taken to tell.
    above_over_below: Optional[float] = None
    # It counts for a search as the lens stands now, with iris and zoom there and with frames from where the newest run
    # had them.
    holds: bool
    # When that was (UTC), for people.
    made: str


@dataclass(frozen=True, slots=True, kw_only=True)
class LearnedState:
    """Feature "learned". What autofocus has taught lensd of a lens."""

    # Name of the lens.
    lens: str
    # What the next search goes by, as the lens stands now and with frames from where the newest run had them (the lens'
    # own camera, or a client); null: by what is told.
    known: Optional[KnownSlope] = None
    # Why that is null, or that the file of it cannot be read and nothing more is kept; null otherwise.
    reason: Optional[str] = None
    # What it was learned from, oldest first; at most 200.
    runs: list[LearnedRun]


@dataclass(frozen=True, slots=True, kw_only=True)
class UndoResult:
    """A lens brought back."""

    # Name of the lens.
    lens: str
    # There was something to undo, and every axis is where it was.
    undone: bool
    # The plane in focus is within this of the one before; null where the lens had no vergence then, or has none now.
    vergence_bound_d: Optional[float] = None
    # Focus is within this of its place before, in native units; told where vergenceBoundD is not.
    position_bound: Optional[float] = None
    # What was moved, in order.
    moves: list[MoveResult]
    # Something the reader should know: why nothing was undone, for instance.
    note: Optional[str] = None
