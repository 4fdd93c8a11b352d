"""Calls with several replies, blocking: streams of them, and pictures put together out of them.

Written by script/client-types from clients/python/lensd/_aio_streams.py: change that, not this."""
from __future__ import annotations

from typing import Iterator, Generic, Optional, TypeVar

from . import calls
from ._connection import Connection
from ._pool import Pool
from ._protocol import Call, Deadline
from .errors import LensdError
from .pictures import Assembly, Picture

R = TypeVar("R")


class Stream(Generic[R]):
    """The replies of one call as they come, on a connection of its own. `timeout_s` is for each of them.

    It begins with the first reply asked for, or where it is entered (`with`), and ends with its last reply or where it is left or
    closed; close() may come from elsewhere and ends the iteration."""

    def __init__(self, pool: Pool, call: Call[R], timeout_s: float) -> None:
        self._pool, self._call, self._timeout_s = pool, call, timeout_s
        self._connection: Optional[Connection] = None
        self._waiting = self._over = False

    def _begun(self, deadline: Deadline) -> Connection:
        if self._connection is None:
            self._connection = self._pool.take(deadline)
            self._connection.send(self._call.encoded(more=True), deadline)
        return self._connection

    def __enter__(self) -> Stream[R]:
        try:
            self._begun(Deadline(self._timeout_s))
        except BaseException:
            self._end()
            raise
        return self

    def __exit__(self, *unused: object) -> None:
        self.close()

    def __iter__(self) -> Iterator[R]:
        return self

    def __next__(self) -> R:
        if self._over:
            raise StopIteration
        self._waiting = True
        try:
            deadline = Deadline(self._timeout_s)
            message = (self._begun(deadline)).receive(deadline)
            reply = self._call.decoded(message)
        except BaseException as error:
            was_closed = self._over and isinstance(error, LensdError)
            self._end()
            if was_closed:
                raise StopIteration from None
            raise
        finally:
            self._waiting = False
        if not message.continues:
            self._over, connection, self._connection = True, self._connection, None
            if connection is not None:
                self._pool.give(connection)
        return reply

    def take_file(self) -> int:
        """The file that came with the last reply."""
        assert self._connection is not None
        return self._connection.receiver.take_file()

    def _end(self) -> None:
        self._over, connection, self._connection = True, self._connection, None
        if connection is not None:
            connection.close()

    def close(self) -> None:
        """Ends the call: lensd sees the connection close."""
        self._over = True
        if self._waiting and self._connection is not None:
            self._connection.shut()
        else:
            self._end()


class View:
    """Pictures as they come. At most three of those that came as files are out at a time: keep what you need by copying it."""

    def __init__(self, stream: Stream[calls.ViewReply]) -> None:
        self._stream = stream
        self._assembly = Assembly()

    def __enter__(self) -> View:
        self._stream.__enter__()
        return self

    def __exit__(self, *unused: object) -> None:
        self.close()

    def __iter__(self) -> Iterator[Picture]:
        return self

    def __next__(self) -> Picture:
        while True:
            reply = self._stream.__next__()
            file = self._stream.take_file() if reply.fd is not None else None
            picture = self._assembly.add(reply, file)
            if picture is not None:
                return picture

    def close(self) -> None:
        """Ends the view. Pictures that came live on."""
        self._stream.close()
