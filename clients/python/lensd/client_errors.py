"""What goes wrong between this package and lensd."""
from __future__ import annotations

from .errors import LensdError
from .lens_errors import NotPermitted, Timeout
from .types import MoveResult


class Unavailable(LensdError):
    """No lensd answers at that socket, or it went away in the middle of a call."""

    code = "unavailable"
    exit_status = 69


class SocketRefused(NotPermitted):
    """This user may not use the socket of lensd."""


class SocketFailed(LensdError):
    """Reading from the socket or writing to it failed."""

    code = "io"
    exit_status = 74


class DeadlinePassed(Timeout):
    """The call took longer than its `timeout_s`. Its connection is closed: what it asked for may go on (a plain move does)."""


class BrokenReply(LensdError):
    """What came is no answer to the call: another program listens there, or a lensd that breaks its own interface."""

    code = "protocol"
    exit_status = 76


class NotReached(LensdError):
    """An axis did not arrive where a stack needed it. `move` is the move that missed."""

    code = "unavailable"
    exit_status = 69
    move: MoveResult

    @classmethod
    def of(cls, move: MoveResult) -> NotReached:
        """For a move that is not reached."""
        error = cls(f"{move.lens}: {move.axis} did not arrive, so that there is no picture as planned: {move.reason}")
        error.lens, error.axis, error.move = move.lens, move.axis, move
        return error


class UnknownError(LensdError):
    """An error that this package does not know: a newer lensd has it. Its name is `name`."""

    code = "protocol"
    exit_status = 76
    name: str = ""
