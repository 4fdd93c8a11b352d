"""Connections of one Lens, asyncio. Each call has one for itself meanwhile, so that calls never wait for each other."""
from __future__ import annotations

from typing import List, TypeVar

from ._aio_connection import Connection
from ._protocol import Call, Deadline

R = TypeVar("R")
IDLE = 4  # kept open for the next call


async def ask(connection: Connection, call: Call[R], deadline: Deadline) -> R:
    """One call and its answer. Whoever gets an exception that is no answer of lensd closes the connection."""
    await connection.send(call.encoded(), deadline)
    return call.decoded(await connection.receive(deadline))


class Pool:
    """Opens connections and keeps those that are free."""

    def __init__(self, path: str) -> None:
        self._path = path
        self._idle: List[Connection] = []
        self._closed = False

    async def open(self, deadline: Deadline) -> Connection:
        """One that nobody else had before."""
        return await Connection.open(self._path, deadline)

    async def take(self, deadline: Deadline) -> Connection:
        while True:
            try:
                connection = self._idle.pop()
            except IndexError:
                return await self.open(deadline)
            if not connection.is_stale():
                return connection
            await connection.close()

    async def give(self, connection: Connection) -> None:
        """Takes one back on which nothing is under way."""
        if self._closed or len(self._idle) >= IDLE:
            await connection.close()
        else:
            self._idle.append(connection)

    async def call(self, call: Call[R], timeout_s: float) -> R:
        deadline = Deadline(timeout_s)
        connection = await self.take(deadline)
        try:
            await connection.send(call.encoded(), deadline)
            message = await connection.receive(deadline)
        except BaseException:
            await connection.close()
            raise
        await self.give(connection)
        return call.decoded(message)

    async def close(self) -> None:
        self._closed = True
        while self._idle:
            await self._idle.pop().close()
