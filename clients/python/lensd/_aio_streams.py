"""Calls with several replies, asyncio: streams of them, and pictures put together out of them."""
from __future__ import annotations

from typing import AsyncIterator, Generic, Optional, TypeVar

from . import calls
from ._aio_connection import Connection
from ._aio_pool import Pool
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

    async def _begun(self, deadline: Deadline) -> Connection:
        if self._connection is None:
            self._connection = await self._pool.take(deadline)
            await self._connection.send(self._call.encoded(more=True), deadline)
        return self._connection

    async def __aenter__(self) -> Stream[R]:
        try:
            await self._begun(Deadline(self._timeout_s))
        except BaseException:
            await self._end()
            raise
        return self

    async def __aexit__(self, *unused: object) -> None:
        await self.close()

    def __aiter__(self) -> AsyncIterator[R]:
        return self

    async def __anext__(self) -> R:
        if self._over:
            raise StopAsyncIteration
        self._waiting = True
        try:
            deadline = Deadline(self._timeout_s)
            message = await (await self._begun(deadline)).receive(deadline)
            reply = self._call.decoded(message)
        except BaseException as error:
            was_closed = self._over and isinstance(error, LensdError)
            await self._end()
            if was_closed:
                raise StopAsyncIteration from None
            raise
        finally:
            self._waiting = False
        if not message.continues:
            self._over, connection, self._connection = True, self._connection, None
            if connection is not None:
                await self._pool.give(connection)
        return reply

    def take_file(self) -> int:
        """The file that came with the last reply."""
        assert self._connection is not None
        return self._connection.receiver.take_file()

    async def _end(self) -> None:
        self._over, connection, self._connection = True, self._connection, None
        if connection is not None:
            await connection.close()

    async def close(self) -> None:
        """Ends the call: lensd sees the connection close."""
        self._over = True
        if self._waiting and self._connection is not None:
            self._connection.shut()
        else:
            await self._end()


class View:
    """Pictures as they come. At most three of those that came as files are out at a time: keep what you need by copying it."""

    def __init__(self, stream: Stream[calls.ViewReply]) -> None:
        self._stream = stream
        self._assembly = Assembly()

    async def __aenter__(self) -> View:
        await self._stream.__aenter__()
        return self

    async def __aexit__(self, *unused: object) -> None:
        await self.close()

    def __aiter__(self) -> AsyncIterator[Picture]:
        return self

    async def __anext__(self) -> Picture:
        while True:
            reply = await self._stream.__anext__()
            file = self._stream.take_file() if reply.fd is not None else None
            picture = self._assembly.add(reply, file)
            if picture is not None:
                return picture

    async def close(self) -> None:
        """Ends the view. Pictures that came live on."""
        await self._stream.close()
