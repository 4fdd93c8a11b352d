"""Pictures that came, frames to send, and how both are written on the wire. Nothing here copies pixels that lie in a mapping."""
from __future__ import annotations

import base64
import dataclasses
import mmap
import os
from typing import Any, Iterator, Optional, Union

from . import calls
from ._protocol import PIECE_BYTES, Call
from .client_errors import BrokenReply
from .types import FrameInfo, PictureInfo, PixelFormat


@dataclasses.dataclass(frozen=True)
class Picture:
    """A picture, the frame it was made of and where the lens was meanwhile.

    `data` is read-only and lies in the memory that lensd wrote (of a view with files) or in bytes (otherwise):
    `numpy.frombuffer(picture.data, numpy.uint8)` and `numpy.asarray(picture.samples)` copy nothing. The memory lives as long as
    any of them. lensd has three pictures of a view out at a time: those that are kept longer hold up the view."""

    frame: FrameInfo
    info: PictureInfo
    dropped: int
    data: memoryview

    @property
    def samples(self) -> memoryview:
        """The samples by row, column and (of colour) channel; of raw, gray8 and rgb8 alone."""
        if self.info.encoding not in ("raw", "gray8", "rgb8"):
            raise ValueError(f"a picture as {self.info.encoding} is a file: its samples are not laid out in memory; ask for raw, gray8 "
                             "or rgb8")
        wide = self.info.encoding == "raw" and self.info.bits > 8
        shape = [self.info.height_px, self.info.width_px] + ([self.info.channels] if self.info.channels > 1 else [])
        return self.data.cast("H" if wide else "B", shape)

    def close(self) -> None:
        """Gives the memory back now, unless something else still looks at it: then that does, by its end."""
        self.data.release()

    def __enter__(self) -> Picture:
        return self

    def __exit__(self, *unused: object) -> None:
        self.close()


class Assembly:
    """Puts pictures together: of pieces of base64, or of one file each."""

    def __init__(self) -> None:
        self._first: Optional[Union[calls.ViewReply, calls.SnapshotReply]] = None
        self._data = bytearray()

    def add(self, reply: Union[calls.ViewReply, calls.SnapshotReply], file: Optional[int]) -> Optional[Picture]:
        """The picture that this reply completes. `file` is closed here."""
        if file is not None:
            return self._picture(reply, self._mapped(file, reply.size))
        if reply.offset != len(self._data) or reply.data is None:
            raise BrokenReply(f"a piece of a picture begins at {reply.offset}, and {len(self._data)} bytes were there")
        if self._first is None:
            self._first = reply
        self._data += base64.b64decode(reply.data)
        if len(self._data) < reply.size:
            return None
        first, data = self._first, memoryview(self._data).toreadonly()
        self._first, self._data = None, bytearray()
        return self._picture(first, data)

    @staticmethod
    def _mapped(file: int, size: int) -> memoryview:
        try:
            return memoryview(mmap.mmap(file, size, prot=mmap.PROT_READ))
        except (OSError, ValueError) as wrong:
            raise BrokenReply(f"the memory of a picture cannot be mapped: {wrong}") from None
        finally:
            os.close(file)

    @staticmethod
    def _picture(reply: Union[calls.ViewReply, calls.SnapshotReply], data: memoryview) -> Picture:
        if reply.frame is None or reply.picture is None:
            raise BrokenReply("a picture came without what it shows")
        dropped = reply.dropped if isinstance(reply, calls.ViewReply) else 0
        return Picture(reply.frame, reply.picture, dropped or 0, data)


@dataclasses.dataclass(frozen=True)
class Frame:
    """A frame of the caller's own camera, for `autofocus(grab=...)`.

    `pixels` is anything that lies in memory row by row: bytes with `width_px` and `height_px`, or an array of two dimensions (of
    numpy, say), which tells them itself. Samples of one byte are mono8, of two mono16le, unless `format` says how many bits
    count. Sample = light^(1/gamma). Without exposure times the frame was exposed while `grab` ran: say them where the camera
    runs on its own, in ns on CLOCK_MONOTONIC (`time.monotonic_ns()`)."""

    pixels: Any
    width_px: Optional[int] = None
    height_px: Optional[int] = None
    format: Optional[PixelFormat] = None
    gamma: Optional[float] = None
    exposure_start_ns: Optional[int] = None
    exposure_end_ns: Optional[int] = None


@dataclasses.dataclass(frozen=True)
class Score:
    """How sharp the caller's frame is, instead of the frame: any value above 0 that rises with focus, with its standard
    deviation from frame to frame."""

    sharpness: float
    sigma: Optional[float] = None
    exposure_start_ns: Optional[int] = None
    exposure_end_ns: Optional[int] = None


def calls_of_frame(session: int, frame: Frame, start_ns: int, end_ns: int) -> Iterator[Call[Any]]:
    """What sends a frame that was exposed between these times: its pixels piece by piece, then the frame."""
    pixels = memoryview(frame.pixels)
    width, height = frame.width_px, frame.height_px
    if pixels.shape is not None and len(pixels.shape) == 2:
        height, width = pixels.shape
    if width is None or height is None:
        raise ValueError("a frame's pixels have two dimensions, or width_px and height_px say them")
    depth: PixelFormat = "mono16le" if pixels.itemsize == 2 else "mono8"
    data = pixels.cast("B") if pixels.c_contiguous else memoryview(pixels.tobytes())
    for offset in range(0, len(data), PIECE_BYTES):
        piece = base64.b64encode(data[offset:offset + PIECE_BYTES]).decode()
        yield calls.autofocus_pixels(session=session, offset=offset, data=piece)
    yield calls.autofocus_frame(
        session=session, width_px=width, height_px=height, format=frame.format or depth, gamma=frame.gamma,
        exposure_start_ns=frame.exposure_start_ns if frame.exposure_start_ns is not None else start_ns,
        exposure_end_ns=frame.exposure_end_ns if frame.exposure_end_ns is not None else end_ns)


def calls_of(session: int, shown: Union[Frame, Score], start_ns: int, end_ns: int) -> Iterator[Call[Any]]:
    """What tells a session of the frame it wanted; the last call is answered with what comes next."""
    if isinstance(shown, Frame):
        yield from calls_of_frame(session, shown, start_ns, end_ns)
        return
    yield calls.autofocus_score(
        session=session, sharpness=shown.sharpness, sigma=shown.sigma,
        exposure_start_ns=shown.exposure_start_ns if shown.exposure_start_ns is not None else start_ns,
        exposure_end_ns=shown.exposure_end_ns if shown.exposure_end_ns is not None else end_ns)
