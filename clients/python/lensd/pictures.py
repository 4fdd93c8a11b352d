"""Pictures that came, frames to send, and how both are written on the wire. Nothing here copies pixels that lie in a mapping."""
from __future__ import annotations

import array
import base64
import dataclasses
import mmap
import os
import struct
import sys
import zlib
from typing import Any, Iterator, List, Optional, Union

from . import calls
from ._protocol import PIECE_BYTES, Call
from .client_errors import BrokenReply
from .types import FrameInfo, MoveResult, PictureInfo, PixelFormat, PlanAnswer


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def _png_of(samples: bytes, info: PictureInfo) -> bytes:
    """A PNG as lensd writes it: 8 bits as they are, others scaled to the full range of 16. It says the picture's gamma, for viewers."""
    sample_bits = 8
    if info.bits != 8:
        sample_bits, full = 16, (1 << info.bits) - 1
        words = array.array("H" if info.bits > 8 else "B", samples)
        if info.bits > 8 and sys.byteorder == "big":
            words.byteswap()
        if info.bits != 16:
            table = [(sample * 65535 + full // 2) // full for sample in range(full + 1)]
            table += [65535] * ((1 << 16) - len(table))  # a sample beyond its bits is white
            words = array.array("H", map(table.__getitem__, words))
        if sys.byteorder == "little":
            words.byteswap()
        samples = words.tobytes()
    row = info.width_px * info.channels * sample_bits // 8
    rows = b"".join(b"\0" + samples[at:at + row] for at in range(0, len(samples), row))
    head = struct.pack(">IIBBBBB", info.width_px, info.height_px, sample_bits, 2 if info.channels == 3 else 0, 0, 0, 0)
    return (b"\x89PNG\r\n\x1a\n" + _chunk(b"IHDR", head) + _chunk(b"gAMA", struct.pack(">I", round(100000 / info.gamma)))
            + _chunk(b"IDAT", zlib.compress(rows, 3)) + _chunk(b"IEND", b""))


@dataclasses.dataclass(frozen=True)
class Picture:
    """A picture, the frame it was made of and where the lens was meanwhile.

    `data` is read-only and lies in the memory that lensd wrote (of a view with files) or in bytes (otherwise):
    `numpy.frombuffer(picture.data, numpy.uint8)` and `numpy.asarray(picture)` copy nothing. The memory lives as long as
    any of them. lensd has three pictures of a view out at a time: those that are kept longer hold up the view. A notebook shows
    the picture."""

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

    def __array__(self, dtype: Any = None, copy: Optional[bool] = None) -> Any:
        """For numpy.asarray(picture): the samples, without copying them where neither dtype nor copy asks for that."""
        import numpy  # pylint: disable=import-outside-toplevel
        seen = numpy.asarray(self.samples)
        if dtype is not None and seen.dtype != dtype:
            if copy is False:
                raise ValueError(f"the samples are {seen.dtype}: as {numpy.dtype(dtype)} they are a copy, which copy=False does not allow")
            return seen.astype(dtype)
        return seen.copy() if copy else seen

    def png(self) -> bytes:
        """The bytes of a PNG file with all bits of the picture: 8, or 16 (10 and 12 scaled to their full range), in colour where
        it is. Not of a jpeg."""
        if self.info.encoding == "png":
            return bytes(self.data)
        if self.info.encoding == "jpeg":
            raise ValueError("this picture is a jpeg: save it as .jpg, or ask for snapshot(), which has all bits")
        return _png_of(bytes(self.data), self.info)

    def save(self, path: Union[str, os.PathLike[str]]) -> None:
        """Writes a file: ".png" as of png(), or ".jpg" of a picture that was asked for as jpeg. It is written whole, or not at all
        (OSError), in place of what was there."""
        name = os.fspath(path)
        ending = os.path.splitext(name)[1].lower()
        if ending not in (".png", ".jpg", ".jpeg"):
            raise ValueError(f"{name}: a picture is saved as .png, or as .jpg where it was asked for as jpeg: name such a file")
        if ending != ".png" and self.info.encoding != "jpeg":
            raise ValueError(f"{name}: this picture is {self.info.encoding}: save it as .png, or ask for snapshot(encoding='jpeg')")
        content = self.png() if ending == ".png" else bytes(self.data)
        beside = f"{name}.{os.getpid()}.tmp"
        try:
            with open(beside, "wb") as file:
                file.write(content)
            os.replace(beside, name)
        except OSError as wrong:
            if os.path.exists(beside):
                os.remove(beside)
            raise OSError(wrong.errno, wrong.strerror, name) from None

    def _repr_png_(self) -> Optional[bytes]:
        return None if self.info.encoding == "jpeg" else self.png()

    def _repr_jpeg_(self) -> Optional[bytes]:
        return bytes(self.data) if self.info.encoding == "jpeg" else None

    def close(self) -> None:
        """Gives the memory back now, unless something else still looks at it: then that does, by its end."""
        self.data.release()

    def __enter__(self) -> Picture:
        return self

    def __exit__(self, *unused: object) -> None:
        self.close()


@dataclasses.dataclass(frozen=True)
class Stack:
    """What `Lens.stack` took: a picture for each of `plan.shots`, from far to near; none where plan.feasible is false."""

    plan: PlanAnswer
    pictures: List[Picture]
    back: List[MoveResult]  # the moves that put the lens back

    @property
    def returned(self) -> bool:
        """The lens stands where it stood before."""
        return all(move.reached for move in self.back)


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
