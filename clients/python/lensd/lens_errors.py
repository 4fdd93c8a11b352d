"""One exception class for every error of io.lensd.Lens, with the exit status that lensctl ends with.

Written by script/client-types from proto/io.lensd.Lens.varlink and the table of docs/interface.head.md: change that,
not this."""
from __future__ import annotations

from typing import Optional

from .errors import LensdError
from .types import Activity, EventMark, Role


class Cancelled(LensdError):
    """Stopped by a person or by a connection that closed, or lensd is ending. Or a Stop with `latch` holds (Status has
    `latched`): then every call that would move the lens is answered so until ResetFaults, and to repeat it is of no
    use."""

    error_name = "io.lensd.Lens.Cancelled"
    code = "stopped"
    exit_status = 2


class Superseded(LensdError):
    """A newer command took over."""

    error_name = "io.lensd.Lens.Superseded"
    code = "superseded"
    exit_status = 3


class Busy(LensdError):
    """Something else is going on that this command may not interrupt: `activity`, on `axis` where it is one axis, begun
    sinceMs ago by `holder`, the program, process and user. Both are null where no call began it, as when an axis is
    turned by hand. Without an activity lensd itself has too much to do, or 64 connections are open already. Try
    again."""

    error_name = "io.lensd.Lens.Busy"
    code = "busy"
    exit_status = 4
    activity: Optional[Activity] = None
    holder: Optional[str] = None
    since_ms: Optional[float] = None


class Timeout(LensdError):
    """A deadline passed."""

    error_name = "io.lensd.Lens.Timeout"
    code = "timeout"
    exit_status = 5


class Overrun(LensdError):
    """A monitor reads so slowly that it would miss lasting events: it ends after this many replies. `last` is up to
    where it was told everything: a monitor begun anew shows by its first numbers how much was missed."""

    error_name = "io.lensd.Lens.Overrun"
    code = "busy"
    exit_status = 4
    received: Optional[int] = None
    instance: Optional[str] = None
    last: Optional[list[EventMark]] = None


class NotPermitted(LensdError):
    """The client's user may not call this method: it needs the role `role` (observe, move, administer), which the
    members of these groups have. `groups` is empty where only root and the user that lensd runs as have it."""

    error_name = "io.lensd.Lens.NotPermitted"
    code = "not-permitted"
    exit_status = 77
    role: Optional[Role] = None
    groups: Optional[list[str]] = None


class OutOfRange(LensdError):
    """Well formed, but outside what the lens or the model allows: minimum and maximum are what it would take now, both
    ends included, null where there is no such end or it is infinite. They are in `unit`: m, mm, um, D, ms, ns, Hz, px
    or bytes, as the name of the parameter ends, dB or native for a gain (its gainUnit), else one of Unit."""

    error_name = "io.lensd.Lens.OutOfRange"
    code = "out-of-range"
    exit_status = 6


class NotHomed(LensdError):
    """An axis does not know where it stands: home it first, or say where it stands where it has no reference
    (SetPosition). `axis` is null where the device does not say which."""

    error_name = "io.lensd.Lens.NotHomed"
    code = "not-homed"
    exit_status = 7


class Unsupported(LensdError):
    """This lens cannot do that."""

    error_name = "io.lensd.Lens.Unsupported"
    code = "unsupported"
    exit_status = 8


class Leased(LensdError):
    """Another client has the lens' lease: `holder` is the program, process and user that took it, for remainingMs more,
    or (null) until it lets go or its connection closes."""

    error_name = "io.lensd.Lens.Leased"
    code = "leased"
    exit_status = 9
    holder: Optional[str] = None
    remaining_ms: Optional[float] = None


class InvalidRequest(LensdError):
    """The request makes no sense as written: for instance a target with two fields, or no lens named where there are
    several. `parameter` is the path of what is wrong ("target.position", "limits[0].limitPx"), minimum and maximum what
    it may be, both ends included, in `unit`, as in OutOfRange. An end that it may not be ("above 0") stands in the
    message alone."""

    error_name = "io.lensd.Lens.InvalidRequest"
    code = "usage"
    exit_status = 64


class BadData(LensdError):
    """The text of a file says something wrong: of a calibration that was given, or of presets that are kept."""

    error_name = "io.lensd.Lens.BadData"
    code = "bad-data"
    exit_status = 65


class LensNotFound(LensdError):
    """No lens of that name, or no lens at all. `lens` is the name that was asked for."""

    error_name = "io.lensd.Lens.LensNotFound"
    code = "not-found"
    exit_status = 68


class PresetNotFound(LensdError):
    """No preset of that label on this lens."""

    error_name = "io.lensd.Lens.PresetNotFound"
    code = "not-found"
    exit_status = 68
    label: Optional[str] = None


class Disconnected(LensdError):
    """The device is not there."""

    error_name = "io.lensd.Lens.Disconnected"
    code = "unavailable"
    exit_status = 69


class Internal(LensdError):
    """The daemon's own fault."""

    error_name = "io.lensd.Lens.Internal"
    code = "internal"
    exit_status = 70


class NotKept(LensdError):
    """A file that lensd keeps could not be written. What the call changed is in force until lensd ends, where `message`
    says so; otherwise nothing was done."""

    error_name = "io.lensd.Lens.NotKept"
    code = "cannot-write"
    exit_status = 73


class BadConfiguration(LensdError):
    """The configuration has a mistake, or cannot be read: the message says where."""

    error_name = "io.lensd.Lens.BadConfiguration"
    code = "configuration"
    exit_status = 78


class DeviceError(LensdError):
    """Reading from the device or writing to it failed, though it is there."""

    error_name = "io.lensd.Lens.DeviceError"
    code = "io"
    exit_status = 74


class ProtocolError(LensdError):
    """The device broke the rules of its own protocol."""

    error_name = "io.lensd.Lens.ProtocolError"
    code = "protocol"
    exit_status = 76


class InvalidParameter(LensdError):
    """org.varlink.service.InvalidParameter"""

    error_name = "org.varlink.service.InvalidParameter"
    code = "usage"
    exit_status = 64


class ExpectedMore(LensdError):
    """org.varlink.service.ExpectedMore"""

    error_name = "org.varlink.service.ExpectedMore"
    code = "usage"
    exit_status = 64


class InterfaceNotFound(LensdError):
    """org.varlink.service.InterfaceNotFound"""

    error_name = "org.varlink.service.InterfaceNotFound"
    code = "unsupported"
    exit_status = 8


class MethodNotFound(LensdError):
    """org.varlink.service.MethodNotFound"""

    error_name = "org.varlink.service.MethodNotFound"
    code = "unsupported"
    exit_status = 8


class MethodNotImplemented(LensdError):
    """org.varlink.service.MethodNotImplemented"""

    error_name = "org.varlink.service.MethodNotImplemented"
    code = "unsupported"
    exit_status = 8


BY_NAME: dict[str, type[LensdError]] = {each.error_name: each for each in (
    Cancelled, Superseded, Busy, Timeout, Overrun, NotPermitted, OutOfRange, NotHomed, Unsupported, Leased,
    InvalidRequest, BadData, LensNotFound, PresetNotFound, Disconnected, Internal, NotKept, BadConfiguration,
    DeviceError, ProtocolError, InvalidParameter, ExpectedMore, InterfaceNotFound, MethodNotFound, MethodNotImplemented)}
__all__ = [
    "Cancelled", "Superseded", "Busy", "Timeout", "Overrun", "NotPermitted", "OutOfRange", "NotHomed", "Unsupported",
    "Leased", "InvalidRequest", "BadData", "LensNotFound", "PresetNotFound", "Disconnected", "Internal", "NotKept",
    "BadConfiguration", "DeviceError", "ProtocolError", "InvalidParameter", "ExpectedMore", "InterfaceNotFound",
    "MethodNotFound", "MethodNotImplemented"]
