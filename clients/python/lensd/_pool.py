"""Connections of one Lens, blocking. Each call has one for itself meanwhile, so that calls never wait for each other.

Written by script/client-types from clients/python/lensd/_aio_pool.py: change that, not this."""
from __future__ import annotations

from typing import List, TypeVar

from ._connection import Connection
from ._protocol import Call, Deadline

R = TypeVar("R")
IDLE = 4  # kept open for the next call


def ask(connection: Connection, call: Call[R], deadline: Deadline) -> R:
    """One call and its answer. Whoever gets an exception that is no answer of lensd closes the connection."""
    connection.send(call.encoded(), deadline)
    return call.decoded(connection.receive(deadline))


class Pool:
    """Opens connections and keeps those that are free."""

    def __init__(self, path: str) -> None:
        self._path = path
        self._idle: List[Connection] = []
        self._closed = False

    def open(self, deadline: Deadline) -> Connection:
        """One that nobody else had before."""
        return Connection.open(self._path, deadline)

    def take(self, deadline: Deadline) -> Connection:
        while True:
            try:
                connection = self._idle.pop()
            except IndexError:
                return self.open(deadline)
            if not connection.is_stale():
                return connection
            connection.close()

    def give(self, connection: Connection) -> None:
        """Takes one back on which nothing is under way."""
        if self._closed or len(self._idle) >= IDLE:
            connection.close()
        else:
            self._idle.append(connection)

    def call(self, call: Call[R], timeout_s: float) -> R:
        deadline = Deadline(timeout_s)
        connection = self.take(deadline)
        try:
            connection.send(call.encoded(), deadline)
            message = connection.receive(deadline)
        except BaseException:
            connection.close()
            raise
        self.give(connection)
        return call.decoded(message)

    def close(self) -> None:
        self._closed = True
        while self._idle:
            self._idle.pop().close()
