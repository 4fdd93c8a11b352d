"""A lens as devices of Micro-Manager, for `UniMMCore` of pymmcore-plus, which this module alone needs.

    core.loadPyDevice("Focus", FocusStage(lens)); core.initializeDevice("Focus"); core.setFocusDevice("Focus")
    core.loadPyDevice("AF", Autofocus(lens, snap=core.snap, pixel_um=3.45)); core.setProperty("AF", "Run", 1)

Micrometres are those of the sensor distance: 0 is focus at infinity, more is nearer. A lens without known optics counts native
units, `um_per_step` of them."""
from __future__ import annotations

from typing import Any, Callable, Optional

from pymmcore_plus.experimental.unicore import Device, StageDevice

from ._lens import Lens
from .pictures import Frame
from .types import AutofocusResult, AxisStatus, LensStatus, MoveResult, Region


def _reached(move: MoveResult) -> None:
    if not move.reached:
        raise RuntimeError(f"{move.lens}: {move.axis} did not arrive: {move.reason}")


class FocusStage(StageDevice):  # type: ignore[misc]
    """The focus of a lens. A call ends when the motor has settled, and raises where it did not arrive: the device is never busy
    with something that nobody waits for."""

    def __init__(self, lens: Lens, *, um_per_step: Optional[float] = None) -> None:
        super().__init__()
        self._lens, self._um_per_step = lens, um_per_step
        self._zero_um = 0.0  # where the caller's 0 is

    def _focus(self, state: LensStatus) -> AxisStatus:
        return next(axis for axis in state.axes if axis.axis == "focus")

    def _place_um(self) -> float:
        state = self._lens.status()
        if self._um_per_step is not None:
            return self._focus(state).position * self._um_per_step
        if state.extension_mm is None:
            raise RuntimeError(f"{state.name}: {state.error or 'its optics or its place are not known; give um_per_step'}")
        return state.extension_mm * 1000

    def set_position_um(self, val: float) -> None:
        place_um = val + self._zero_um
        if self._um_per_step is not None:
            _reached(self._lens.focus(position=place_um / self._um_per_step))
        else:
            _reached(self._lens.focus(extension_mm=place_um / 1000))

    def get_position_um(self) -> float:
        return self._place_um() - self._zero_um

    def home(self) -> None:
        for move in self._lens.home("focus"):
            _reached(move)

    def stop(self) -> None:
        self._lens.stop("focus")

    def set_origin(self) -> None:
        self.set_adapter_origin_um(0.0)

    def set_adapter_origin_um(self, newZUm: float) -> None:
        self._zero_um = self._place_um() - newZUm

    def busy(self) -> bool:
        """Something moves it, also another program."""
        state = self._lens.status()
        return state.activity != "idle" or self._focus(state).moving


class Autofocus(Device):  # type: ignore[misc]
    """Autofocus of a lens: property "Run" set to 1 does a search, which raises where it is not sure; "Reason" says why, "Score"
    how sure it was. With `snap` (an array of two dimensions) the frames are those of Micro-Manager's camera."""

    def __init__(self, lens: Lens, *, snap: Optional[Callable[[], Any]] = None, pixel_um: Optional[float] = None,
                 region: Optional[Region] = None) -> None:
        super().__init__()
        self._lens, self._snap, self._pixel_um, self._region = lens, snap, pixel_um, region
        self._result: Optional[AutofocusResult] = None
        self.register_property("Method", default_value="auto")
        self.register_property("Run", default_value=0, allowed_values=[0, 1], property_type=int, getter=lambda device: 0,
                               setter=lambda device, value: device.full_focus() if int(value) else None)
        self.register_property("Reason", is_read_only=True, property_type=str,
                               getter=lambda device: device._result.reason if device._result else "not focused yet")
        self.register_property("Score", is_read_only=True, property_type=float,
                               getter=lambda device: device._result.confidence if device._result else 0.0)

    def full_focus(self) -> AutofocusResult:
        """One search; what it found."""
        result = self._found_by_its_camera() if self._snap is None else self._found_by(self._snap)
        self._result = result
        if not result.focused:
            raise RuntimeError(f"{result.lens} is not focused: {result.reason}")
        return result

    def _found_by_its_camera(self) -> AutofocusResult:
        return self._lens.autofocus(method=self.get_property_value("Method"), region=self._region)

    def _found_by(self, snap: Callable[[], Any]) -> AutofocusResult:
        return self._lens.autofocus(method=self.get_property_value("Method"), region=self._region, pixel_um=self._pixel_um,
                                    grab=lambda step: Frame(snap()))

    def busy(self) -> bool:
        return self._lens.status().activity == "autofocus"
