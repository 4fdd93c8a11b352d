"""One connection to lensd that waits in the calling thread. `_aio_connection` is the same for asyncio."""
from __future__ import annotations

import contextlib
import errno
import socket
import time
from typing import Callable, TypeVar

from ._protocol import Deadline, Message, Receiver
from .client_errors import SocketFailed, SocketRefused, Unavailable
from .errors import LensdError

T = TypeVar("T")
A = TypeVar("A")
CHUNK_BYTES = 256 * 1024
FILES = 16
AGAIN_S = 0.01


def refused(path: str, why: OSError) -> LensdError:
    """Why there is no connection, for people."""
    shown = path.replace("\0", "@")
    if why.errno in (errno.EACCES, errno.EPERM):
        return SocketRefused(f"you may not use the socket {shown}; ask for membership of its group")
    return Unavailable(f"no lensd answers at {shown}: {why.strerror or why}; start it, or name its socket (path, rig or LENSD_SOCKET)")


def gone() -> LensdError:
    return Unavailable("lensd closed the connection without an answer; it has ended or was killed")


def take_chunk(receiver: Receiver, connected: socket.socket) -> None:
    """What has come, with its files, which no child of this process inherits."""
    data, files, _, _ = socket.recv_fds(connected, CHUNK_BYTES, FILES, socket.MSG_CMSG_CLOEXEC)
    receiver.feed(data, list(files))
    if not data:
        raise gone()


def joined(connected: socket.socket, path: str) -> bool:
    """Whether the socket, which must not block, is connected now. Not: lensd's queue is full, and this is to be tried again soon."""
    try:
        connected.connect(path)
        return True
    except BlockingIOError:
        return False
    except OSError as why:
        raise refused(path, why) from None


def is_stale(connected: socket.socket) -> bool:
    """Something came, or lensd has closed, while nothing was asked: such a connection is of no use."""
    try:
        connected.setblocking(False)  # else Python itself waits before it asks
        connected.recv(1, socket.MSG_PEEK)
        return True
    except BlockingIOError:
        return False
    except OSError:
        return True


class Connection:
    """Used by one thread at a time; close() may come from another, and ends what the first one waits for."""

    def __init__(self, connected: socket.socket) -> None:
        self._socket = connected
        self.receiver = Receiver()

    @classmethod
    def open(cls, path: str, deadline: Deadline) -> Connection:
        connected = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            connected.setblocking(False)
            while not joined(connected, path):
                deadline.left_s()
                time.sleep(AGAIN_S)
            return cls(connected)
        except BaseException:
            connected.close()
            raise

    def send(self, data: bytes, deadline: Deadline) -> None:
        self._socket.settimeout(deadline.left_s())
        try:
            self._socket.sendall(data)
        except TimeoutError:
            raise deadline.passed() from None
        except BrokenPipeError:
            pass  # refused at the door: the reason may be waiting to be received
        except OSError as why:
            raise SocketFailed(f"lensd cannot be written to: {why.strerror or why}") from None

    def receive(self, deadline: Deadline) -> Message:
        """The next reply, an error too."""
        while True:
            message = self.receiver.next()
            if message is not None:
                return message
            self._socket.settimeout(deadline.left_s())
            try:
                take_chunk(self.receiver, self._socket)
            except TimeoutError:
                raise deadline.passed() from None
            except OSError as why:
                raise SocketFailed(f"lensd cannot be read from: {why.strerror or why}") from None

    def is_stale(self) -> bool:
        return is_stale(self._socket)

    def shut(self) -> None:
        """Ends what another thread waits for here; that thread closes."""
        with contextlib.suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        self.shut()
        self._socket.close()
        self.receiver.close()


def result_of(function: Callable[[A], T], argument: A) -> T:
    """What a function of the caller's returns."""
    return function(argument)


