"""lensd from Python: `with lensd.Lens(name="cam") as lens: lens.focus("2m")`. `lensd.aio.Lens` is the same for asyncio.

docs/clients.md shows how; docs/interface.md is the interface that all of it stands on."""
from . import aio, calls, lens_errors, types
from ._lens import Events, Lease, Lens, Presets
from ._protocol import Call
from ._streams import Stream, View
from .client_errors import BrokenReply, DeadlinePassed, NotReached, SocketFailed, SocketRefused, Unavailable, UnknownError
from .errors import LensdError
from .lens_errors import *  # noqa: F401,F403
from .pictures import Frame, Picture, Score, Stack
from .quantities import blurred, sharp
from .types import CalibrationPoint, FocusRange, FocusStep, PlanRequest, Region, Size, Target

__all__ = ["BrokenReply", "CalibrationPoint", "Call", "DeadlinePassed", "Events", "FocusRange", "FocusStep", "Frame", "Lease", "Lens",
           "LensdError", "NotReached", "Picture", "PlanRequest", "Presets", "Region", "Score", "Size", "SocketFailed", "SocketRefused",
           "Stack", "Stream", "Target", "Unavailable", "UnknownError", "View", "aio", "blurred", "calls", "sharp", "types"]
__all__ += lens_errors.__all__
