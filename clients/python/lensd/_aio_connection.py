"""One connection to lensd for asyncio. `_connection` is the same for threads."""
from __future__ import annotations

import asyncio
import contextlib
import inspect
import socket
from typing import Any, Awaitable, Callable, Optional, TypeVar, Union, cast

from ._connection import AGAIN_S, is_stale, joined, take_chunk
from ._protocol import Deadline, Message, Receiver
from .client_errors import SocketFailed

T = TypeVar("T")
A = TypeVar("A")


class Connection:
    """Used by one task at a time, of the loop it was opened in."""

    def __init__(self, connected: socket.socket) -> None:
        self._socket = connected
        self._waiter: Optional[asyncio.Future[None]] = None
        self.receiver = Receiver()

    @classmethod
    async def open(cls, path: str, deadline: Deadline) -> Connection:
        connected = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            connected.setblocking(False)
            while not joined(connected, path):
                deadline.left_s()
                await asyncio.sleep(AGAIN_S)
            return cls(connected)
        except BaseException:
            connected.close()
            raise

    async def send(self, data: bytes, deadline: Deadline) -> None:
        try:
            async with asyncio.timeout(deadline.left_s()):
                await asyncio.get_running_loop().sock_sendall(self._socket, data)
        except TimeoutError:
            raise deadline.passed() from None
        except BrokenPipeError:
            pass  # refused at the door: the reason may be waiting to be received
        except OSError as why:
            raise SocketFailed(f"lensd cannot be written to: {why.strerror or why}") from None

    async def receive(self, deadline: Deadline) -> Message:
        """The next reply, an error too."""
        while True:
            message = self.receiver.next()
            if message is not None:
                return message
            try:
                take_chunk(self.receiver, self._socket)
            except BlockingIOError:
                await self._readable(deadline)
            except OSError as why:
                raise SocketFailed(f"lensd cannot be read from: {why.strerror or why}") from None

    async def _readable(self, deadline: Deadline) -> None:
        loop = asyncio.get_running_loop()
        self._waiter = loop.create_future()
        loop.add_reader(self._socket, self._wake)
        try:
            async with asyncio.timeout(deadline.left_s()):
                await self._waiter
        except TimeoutError:
            raise deadline.passed() from None
        finally:
            if self._socket.fileno() >= 0:
                loop.remove_reader(self._socket)
            self._waiter = None

    def _wake(self) -> None:
        if self._waiter is not None and not self._waiter.done():
            self._waiter.set_result(None)

    def is_stale(self) -> bool:
        return is_stale(self._socket)

    def shut(self) -> None:
        """Ends what another task waits for here; that task closes."""
        with contextlib.suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)

    async def close(self) -> None:
        self.shut()
        self._socket.close()
        self.receiver.close()


async def result_of(function: Callable[[A], Union[T, Awaitable[T]]], argument: A) -> T:
    """What a function of the caller's returns, or what its coroutine does."""
    result: Any = function(argument)
    return cast(T, await result if inspect.isawaitable(result) else result)
