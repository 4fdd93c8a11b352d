"""A lens of lensd, asyncio."""
from __future__ import annotations

import dataclasses
import math
import time
from typing import Any, Awaitable, Callable, List, Mapping, Optional, Sequence, Tuple, TypeVar, Union

from . import calls, quantities
from ._aio_connection import Connection, result_of
from ._aio_pool import Pool, ask
from ._aio_streams import Stream, View
from ._protocol import MOTION_S, QUESTION_S, SEARCH_S, Call, Deadline, socket_path
from .client_errors import BrokenReply, NotReached
from .pictures import Assembly, Frame, Picture, Score, Stack, calls_of
from .types import (AutofocusProgress, AutofocusResult, AutofocusStep, Axis, BlurLimit, CalibrationPoint, DistanceFrom, Encoding,
                    Event, ExposureInfo, FocusMapResult, FocusRange, FocusStep, LensInfo, LensStatus, MoveProgress, MoveResult,
                    PlanRequest, Policy, Preset, RecallResult, Region, Size, StackShot, Target, UndoResult)

R = TypeVar("R")
Grab = Callable[[AutofocusStep], Union[Frame, Score, Awaitable[Union[Frame, Score]]]]
Told = Optional[Callable[[Any], Any]]


class Lease:
    """The lens for this client alone, as long as the block lasts; ends with it, or when this process does."""

    def __init__(self, lens: Lens, taken: Call[calls.TakeLeaseReply]) -> None:
        self._lens, self._taken = lens, taken
        self._connection: Optional[Connection] = None
        self.key = ""

    async def __aenter__(self) -> Lease:
        deadline = Deadline(self._lens.timeout_s)
        connection = await self._lens.pool.open(deadline)
        try:
            reply = await ask(connection, self._taken.filled(lens=self._lens.name), deadline)
        except BaseException:
            await connection.close()
            raise
        self._connection, self.key, self._lens.key = connection, reply.lease, reply.lease
        return self

    async def __aexit__(self, *unused: object) -> None:
        connection, self._connection, self._lens.key = self._connection, None, None
        if connection is None:
            return
        try:
            await ask(connection, calls.drop_lease(lens=self._lens.name, lease=self.key), Deadline(self._lens.timeout_s))
        finally:
            await connection.close()


class Presets:
    """States of a lens under a label, as `lens.presets`."""

    def __init__(self, lens: Lens) -> None:
        self._lens = lens

    async def list(self) -> List[Preset]:
        """Every preset of the lens, by its label."""
        return (await self._lens.call(calls.preset_list())).presets

    async def save(self, label: str) -> calls.PresetSaveReply:
        """Saves focus, iris, zoom and filter as they are, in place of what was there; `note` says where it would not last."""
        return await self._lens.call(calls.preset_save(label=label))

    async def recall(self, label: str, *, timeout_s: float = MOTION_S) -> RecallResult:
        """Brings the saved optical state back; whether it did is in `reached`."""
        return (await self._lens.call(calls.preset_recall(label=label), timeout_s=timeout_s)).recall

    async def remove(self, label: str) -> None:
        """Forgets a preset."""
        await self._lens.call(calls.preset_remove(label=label))


class Lens:
    """One lens of lensd, by name; without a name the only one there is.

    `path` is a path, "unix:PATH", or nothing ($LENSD_SOCKET, else the socket of the service); `rig` is the name of one lensd of
    several (lensd@NAME.service). Nothing is connected before the first call, and calls may be made at the same time.

    `timeout_s` is how long a question may take; calls that move take it themselves (10 minutes when left out; searches as long
    as lensd lets them). `math.inf` is for ever. Whatever goes wrong is a LensdError."""

    def __init__(self, path: Optional[str] = None, name: Optional[str] = None, *, rig: Optional[str] = None,
                 timeout_s: float = QUESTION_S) -> None:
        self.name, self.timeout_s = name, timeout_s
        self.key: Optional[str] = None  # of the lease this client has
        self.pool = Pool(socket_path(path, rig))
        self.presets = Presets(self)

    async def __aenter__(self) -> Lens:
        return self

    async def __aexit__(self, *unused: object) -> None:
        await self.close()

    async def close(self) -> None:
        """Closes what is open and idle; streams are closed by whoever opened them."""
        await self.pool.close()

    # Every method of the interface: lensd.calls has them.

    async def call(self, call: Call[R], *, timeout_s: Optional[float] = None) -> R:
        """Any call that answers once: `lens.call(lensd.calls.preset_save(label="wall"))`. Lens and lease are filled in."""
        usual = MOTION_S if "lease" in call.parameters else self.timeout_s
        return await self.pool.call(self._filled(call), usual if timeout_s is None else timeout_s)

    def stream(self, call: Call[R], *, timeout_s: float = math.inf) -> Stream[R]:
        """Any call that answers several times. `timeout_s` is for each answer."""
        return Stream(self.pool, self._filled(call), timeout_s)

    def _filled(self, call: Call[R]) -> Call[R]:
        return call.filled(lens=self.name, lease=self.key)

    async def _followed(self, call: Call[Any], part: str, progress: Told, timeout_s: float) -> Any:
        """The result in `part` of the answer; what comes before it goes to `progress`."""
        if progress is None:
            result = getattr(await self.call(call, timeout_s=timeout_s), part)
        else:
            result, deadline = None, Deadline(timeout_s)
            async with self.stream(call, timeout_s=timeout_s) as replies:
                async for reply in replies:
                    if reply.progress is not None:
                        await result_of(progress, reply.progress)
                        deadline.left_s()  # of the whole call, though each reply came in time
                    result = getattr(reply, part) or result
        if result is None:
            raise BrokenReply(f"lensd ended {call.method} without a result")
        return result

    # What there is, and how it stands.

    async def list(self) -> List[LensInfo]:
        """Every lens of this lensd."""
        return (await self.call(calls.list_())).lenses

    async def status(self) -> LensStatus:
        """How this lens stands."""
        found = await self.statuses()
        if len(found) != 1:
            raise ValueError("say which lens: Lens(name=...); there are " + ", ".join(each.name for each in found))
        return found[0]

    async def statuses(self) -> List[LensStatus]:
        """How this lens stands; without a name how all of them do."""
        return (await self.call(calls.status())).lenses

    async def wait_idle(self, timeout_s: float = MOTION_S) -> LensStatus:
        """Waits until the lens does nothing any more, whoever told it what it does, and says how it stands."""
        deadline = Deadline(timeout_s)
        async with self.stream(calls.status(), timeout_s=timeout_s) as replies:
            async for reply in replies:
                if len(reply.lenses) != 1:
                    raise ValueError("say which lens: Lens(name=...)")
                state = reply.lenses[0]
                if state.activity == "idle" and not any(axis.moving for axis in state.axes):
                    return state
                deadline.left_s()
        raise BrokenReply("a stream of states ended by itself")

    def monitor(self, *, min_interval_ms: Optional[float] = None, timeout_s: float = math.inf) -> Events:
        """What happens to this lens, or to all, as it happens. `with lens.monitor() as events: for event in events: ...`"""
        return Events(self.stream(calls.monitor(min_interval_ms=min_interval_ms), timeout_s=timeout_s))

    # Motion.

    async def move(self, axis: Axis, target: Target, *, distance_from: Optional[DistanceFrom] = None,
                   keep_focus: Optional[bool] = None, tracking_tolerance_um: Optional[float] = None,
                   keep_brightness: Optional[bool] = None, progress: Optional[Callable[[MoveProgress], Any]] = None,
                   timeout_s: float = MOTION_S) -> MoveResult:
        """Moves one axis and says where it ended; whether it arrived is in `reached`."""
        result: MoveResult = await self._followed(
            calls.move(axis=axis, target=target, distance_from=distance_from, keep_focus=keep_focus,
                       tracking_tolerance_um=tracking_tolerance_um, keep_brightness=keep_brightness), "move", progress, timeout_s)
        return result

    async def focus(self, where: Optional[str] = None, *, distance_m: Optional[float] = None, vergence_d: Optional[float] = None,
                    extension_mm: Optional[float] = None, position: Optional[float] = None, relative: Optional[float] = None,
                    nearer: Optional[float] = None, distance_from: Optional[DistanceFrom] = None,
                    progress: Optional[Callable[[MoveProgress], Any]] = None, timeout_s: float = MOTION_S) -> MoveResult:
        """Moves focus to what lensctl would read ("2m", "1.2D", "inf", "@1200", "+50", "near:10") or to one number by its unit."""
        text, origin = quantities.without_origin(where) if isinstance(where, str) else (where, None)
        target = quantities.target_of("focus", text, quantities.focus_target, "2m", distance_m=distance_m, vergence_d=vergence_d,
                                      extension_mm=extension_mm, position=position, relative=relative, nearer=nearer)
        return await self.move("focus", target, distance_from=origin or distance_from, progress=progress, timeout_s=timeout_s)

    async def aperture(self, where: Union[str, float, None] = None, *, f_number: Optional[float] = None,
                       position: Optional[float] = None, relative: Optional[float] = None, keep_brightness: Optional[bool] = None,
                       progress: Optional[Callable[[MoveProgress], Any]] = None, timeout_s: float = MOTION_S) -> MoveResult:
        """Moves the iris: "f/2.8", "2.8", 2.8, "@12", or one number by its name."""
        text = f"f/{where}" if isinstance(where, (int, float)) and not isinstance(where, bool) else where
        target = quantities.target_of("aperture", text, quantities.aperture_target, "f/2.8", f_number=f_number, position=position,
                                      relative=relative)
        return await self.move("iris", target, keep_brightness=keep_brightness, progress=progress, timeout_s=timeout_s)

    async def zoom(self, where: Optional[str] = None, *, focal_length_mm: Optional[float] = None, position: Optional[float] = None,
                   relative: Optional[float] = None, keep_focus: Optional[bool] = None, tracking_tolerance_um: Optional[float] = None,
                   progress: Optional[Callable[[MoveProgress], Any]] = None, timeout_s: float = MOTION_S) -> MoveResult:
        """Moves the zoom: "35mm", "@120", or one number by its name. With keep_focus the plane in focus stays."""
        target = quantities.target_of("zoom", where, quantities.zoom_target, "35mm", focal_length_mm=focal_length_mm,
                                      position=position, relative=relative)
        return await self.move("zoom", target, keep_focus=keep_focus, tracking_tolerance_um=tracking_tolerance_um, progress=progress,
                               timeout_s=timeout_s)

    async def home(self, axis: Optional[Axis] = None, *, timeout_s: float = MOTION_S) -> List[MoveResult]:
        """Searches for the reference of one axis, or of all that have one."""
        return (await self.call(calls.home(axis=axis), timeout_s=timeout_s)).moves

    async def undo(self, *, timeout_s: float = MOTION_S) -> UndoResult:
        """Brings the lens back to where it was before the last command that moved it, by any client; a second undo reverts the
        first. Whether it did is in `undone`."""
        return (await self.call(calls.undo(), timeout_s=timeout_s)).undo

    async def stop(self, axis: Optional[Axis] = None, *, latch: Optional[bool] = None, timeout_s: Optional[float] = None) -> None:
        """Stops the lens (without a name: every lens), whatever other calls wait for: on a connection of its own."""
        deadline = Deadline(self.timeout_s if timeout_s is None else timeout_s)
        connection = await self.pool.open(deadline)
        try:
            await ask(connection, calls.stop(lens=self.name, axis=axis, latch=latch), deadline)
        finally:
            await connection.close()

    def lease(self, *, for_ms: Optional[float] = None, take_over: Optional[bool] = None, stop: Optional[bool] = None) -> Lease:
        """`with lens.lease(): ...`: nobody else moves the lens meanwhile."""
        return Lease(self, calls.take_lease(for_ms=for_ms, take_over=take_over, stop=stop))

    async def plan(self, wanted: Union[PlanRequest, Sequence[BlurLimit]], *, apply: Optional[bool] = None,
                   show_request: Optional[bool] = None, timeout_s: float = MOTION_S) -> calls.PlanReply:
        """What setting keeps every limit (`lensd.sharp`, `lensd.blurred`); with `apply` the lens goes there."""
        request = wanted if isinstance(wanted, PlanRequest) else PlanRequest(limits=[*wanted])
        return await self.call(calls.plan(request=request, apply=apply, show_request=show_request), timeout_s=timeout_s)

    async def stack(self, wanted: Union[PlanRequest, Sequence[BlurLimit]], *, keep_brightness: Optional[bool] = None,
                    region: Optional[Region] = None, encoding: Encoding = "raw", timeout_s: float = MOTION_S) -> Stack:
        """Takes the fewest pictures that together keep every limit (`lensd.sharp`), and puts the lens back where it stood; there
        are none where `plan.feasible` is false. An error (NotReached: an axis missed the place of a shot) leaves the lens where it
        is. `timeout_s` is for each move."""
        request = wanted if isinstance(wanted, PlanRequest) else PlanRequest(limits=[*wanted])
        framing = (request.focal_length_mm, request.focal_length_min_mm, request.focal_length_max_mm, request.field)
        if any(each is not None for each in framing):
            raise ValueError("a stack is taken at the focal length at which the lens stands: move the zoom first, and leave focal "
                             "length and field out of the request")
        plan = (await self.plan(dataclasses.replace(request, stack=True))).plan
        if not plan.feasible:
            return Stack(plan, [], [])
        before = {axis.axis: axis.position for axis in (await self.status()).axes}
        light = await self.exposure() if keep_brightness else None
        pictures, moved = [], {}
        for shot in plan.shots or []:
            for axis, position in _places_of(shot):
                moved[axis] = await self.move(axis, Target(position=position), timeout_s=timeout_s,
                                              keep_brightness=keep_brightness if axis == "iris" else None)
                if not moved[axis].reached:
                    raise NotReached.of(moved[axis])
            pictures.append(await self.snapshot(region=region, encoding=encoding))
        back = []
        for axis in moved:
            back.append(await self.move(axis, Target(position=before[axis]), timeout_s=timeout_s))
        if light is not None and light.can_set_exposure and light.exposure_ms is not None:
            await self.exposure(exposure_ms=light.exposure_ms, gain=light.gain if light.can_set_gain else None)
        return Stack(plan, pictures, back)

    # Camera and calibration.

    async def exposure(self, duration: Optional[str] = None, *, exposure_ms: Optional[float] = None, gain: Optional[float] = None,
                       timeout_s: Optional[float] = None) -> ExposureInfo:
        """Exposure time and gain of the lens' camera. Sets first what is given, "8ms" or "1/250s" or a number by its name, for the
        frames that start from then on; the camera may round, and the answer is what it reports."""
        exposure_ms = quantities.exposure_of(duration, exposure_ms)
        if exposure_ms is None and gain is None:
            return (await self.call(calls.get_exposure(), timeout_s=timeout_s)).exposure
        return (await self.call(calls.set_exposure(exposure_ms=exposure_ms, gain=gain), timeout_s=timeout_s)).exposure

    async def calibrate(self, points: Union[Mapping[float, str], Sequence[CalibrationPoint], None] = None, *,
                        toml: Optional[str] = None, remove: bool = False, keep_measured: bool = True,
                        distance_from: Optional[DistanceFrom] = None, error_um: Optional[float] = None,
                        approximate: Optional[bool] = None, made: Optional[str] = None,
                        timeout_s: Optional[float] = None) -> calls.CalibrateReply:
        """Says which distance each focus position focuses at: `{812: "0.8m", 1630: "2m", 2400: "inf"}`, or CalibrationPoints where
        one position has several depths. Or by `toml`, a whole calibration file; or with `remove` back to the nominal figures
        (`keep_measured`: without losing backlash, focus shifts and the samples of focus-at)."""
        ways = (points is not None) + (toml is not None) + remove
        if ways != 1:
            raise TypeError("calibrate() takes one of points ({812: '0.8m', 2400: 'inf'}), toml (the text of a calibration file) and "
                            "remove=True; the calibration in use is lens.call(lensd.calls.get_calibration())")
        if isinstance(points, Mapping):
            points = [quantities.calibration_point(position, where) for position, where in points.items()]
        call = calls.calibrate(toml=toml, points=None if points is None else [*points], distance_from=distance_from, error_um=error_um,
                               approximate=approximate, made=made, remove=remove or None, keep_measured=keep_measured if remove else None)
        return await self.call(call, timeout_s=timeout_s)

    # Focus by pictures.

    async def autofocus(self, *, grab: Optional[Grab] = None, region: Optional[Region] = None, method: Optional[str] = None,
                        regions: Optional[List[Region]] = None, policy: Optional[Policy] = None,
                        range: Optional[FocusRange] = None, step: Optional[FocusStep] = None,
                        distance_from: Optional[DistanceFrom] = None, deadline_ms: Optional[float] = None,
                        pixel_um: Optional[float] = None, scores: Optional[bool] = None,
                        progress: Optional[Callable[[AutofocusProgress], Any]] = None, timeout_s: float = SEARCH_S) -> AutofocusResult:
        """Brings a region into focus; whether it is sure is in `focused`.

        With `grab` the frames are the caller's: it is called wherever lensd wants one, the lens standing there, and gives a Frame
        that was exposed meanwhile; with `scores` a Score. What it raises ends the search. `pixel_um` is for these frames,
        `progress` for those of the lens' own camera."""
        if grab is None:
            if pixel_um is not None or scores is not None:
                raise ValueError("pixel_um and scores are for frames of your own: give grab")
            result: AutofocusResult = await self._followed(
                calls.autofocus(region=region, method=method, regions=regions, policy=policy, range=range, step=step,
                                distance_from=distance_from, deadline_ms=deadline_ms), "autofocus", progress, timeout_s)
            return result
        return await self._session(calls.autofocus_begin(
            region=region, method=method, regions=regions, policy=policy, range=range, step=step, distance_from=distance_from,
            deadline_ms=deadline_ms, pixel_um=pixel_um, scores=scores), grab, Deadline(timeout_s))

    async def focus_map(self, *, columns: Optional[int] = None, rows: Optional[int] = None, range: Optional[FocusRange] = None,
                        distance_from: Optional[DistanceFrom] = None, deadline_ms: Optional[float] = None,
                        progress: Optional[Callable[[AutofocusProgress], Any]] = None, timeout_s: float = SEARCH_S) -> FocusMapResult:
        """Where each region of a grid is in focus, and the tilt and curvature fitted to them; whether it is sure is in `mapped`."""
        result: FocusMapResult = await self._followed(
            calls.focus_map(columns=columns, rows=rows, range=range, distance_from=distance_from, deadline_ms=deadline_ms), "map",
            progress, timeout_s)
        return result

    async def _session(self, begin: Call[calls.AutofocusBeginReply], grab: Grab, deadline: Deadline) -> AutofocusResult:
        """A session belongs to its connection: to close that ends the search."""
        connection = await self.pool.take(deadline)
        try:
            begun = await ask(connection, self._filled(begin), deadline)
            wanted: Optional[AutofocusStep] = begun.next
            result: Optional[AutofocusResult] = None
            while wanted is not None:
                start_ns = time.monotonic_ns()
                shown: Any = await result_of(grab, wanted)
                answer: Any = None
                for call in calls_of(begun.session, shown, start_ns, time.monotonic_ns()):
                    answer = await ask(connection, call, deadline)
                wanted, result = answer.next, answer.autofocus
            if result is None:
                raise BrokenReply("lensd ended an autofocus without a result")
        except BaseException:
            await connection.close()
            raise
        await self.pool.give(connection)
        return result

    # Pictures.

    async def snapshot(self, *, in_motion: Optional[bool] = None, region: Optional[Region] = None, scale_to: Optional[Size] = None,
                       encoding: Encoding = "raw", timeout_s: Optional[float] = None) -> Picture:
        """One new frame, with all its bits and in colour where there is any; `encoding` asks for less ("gray8", "rgb8"), or for the
        bytes of a file ("png", "jpeg")."""
        assembly, picture = Assembly(), None
        call = calls.snapshot(in_motion=in_motion, region=region, scale_to=scale_to, encoding=encoding)
        async with self.stream(call, timeout_s=self.timeout_s if timeout_s is None else timeout_s) as replies:
            async for reply in replies:
                picture = assembly.add(reply, None)
        if picture is None:
            raise BrokenReply("a picture ended before its last byte")
        return picture

    def view(self, *, max_rate_hz: Optional[float] = None, region: Optional[Region] = None, scale_to: Optional[Size] = None,
             encoding: Encoding = "gray8", in_motion: Optional[bool] = None, files: bool = True,
             timeout_s: Optional[float] = None) -> View:
        """Pictures as they come: `with lens.view(max_rate_hz=30) as view: for picture in view: ...`. With `files` each lies in
        memory that lensd wrote, and nothing is copied. `timeout_s` is for each picture."""
        call = calls.view(max_rate_hz=max_rate_hz, region=region, scale_to=scale_to, encoding=encoding, in_motion=in_motion,
                          fd=True if files else None)
        return View(self.stream(call, timeout_s=self.timeout_s if timeout_s is None else timeout_s))


def _places_of(shot: StackShot) -> List[Tuple[Axis, float]]:
    """Where the motors go for a shot, in this order."""
    places: List[Tuple[Axis, Optional[float]]] = [("iris", shot.iris_position), ("focus", shot.focus_position)]
    return [(axis, position) for axis, position in places if position is not None]


class Events:
    """What happens, one Event after the other; without the envelope of the stream."""

    def __init__(self, stream: Stream[calls.MonitorReply]) -> None:
        self._stream = stream

    async def __aenter__(self) -> Events:
        await self._stream.__aenter__()
        return self

    async def __aexit__(self, *unused: object) -> None:
        await self.close()

    def __aiter__(self) -> Events:
        return self

    async def __anext__(self) -> Event:
        return (await self._stream.__anext__()).event

    async def close(self) -> None:
        """Ends it; whoever waits for the next event sees the end."""
        await self._stream.close()
