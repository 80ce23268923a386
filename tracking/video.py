"""A video: its frames with their times, its size and rate, and what its file says of itself.

A `Frame` is one decoded picture: its brightness as the codec stored it, its colours only when asked for, in square
pixels. `VideoInfo` is what is known before the frames are read. `Video` reads them in order or by number, and
`backward` in the opposite order.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from itertools import takewhile
from pathlib import Path
from typing import Self

import av
import cv2
import numpy as np

from swimcal.errors import Fault, InputError
from tracking.decoding import COPY_AGAIN, Decoder, NumberedPicture, TimeSource, fault, index_frames, read_packets
from tracking.harmed_frames import lost_frames, missing_at_the_end, suspect_frames

# Frames.
BRIGHTNESS_FIRST = re.compile(r"(yuvj?4\d\dp|nv\d\d|gray)")
"""Pixel formats whose first plane is 8-bit brightness, one byte a pixel."""
DEEP_BRIGHTNESS_FIRST = re.compile(r"(?:yuv4\d\dp|gray)(9|10|12|14|16)(le|be)")
"""Pixel formats whose first plane is brightness in the low bits of two bytes, lowest or highest byte first."""
GRAY_16 = ("gray16le", "gray16be")
"""Pixel formats in which scientific cameras store 10, 12 or 14 bits without saying so."""

HALF_COLOUR = re.compile(r"yuvj?42\dp|nv\d\d|p01[026]")
"""Pixel formats that store colours for every second pixel."""

# Frame rate, size and steps in time.
LONGEST_SPAN = 60
"""Frames a span for the frame rate has at most: stamps rounded to 1 ms then leave it within 0.1 %."""

SQUARE_WITHIN = 1e-3
"""Pixels whose sides differ by no more are square."""
LONG_STEP_S, LONG_STEP = 1.0, 10
"""A step in time is reported from this length on, if it is also this many times the median one …"""
STEADY, STEADY_WITHIN, STEADY_STEP = 0.95, 0.25, 2.5
"""… or, where this share of the steps is the median one to within that, from so many times the median on: part of a
Matroska file that cannot be read is passed over without a word, and shows in the time stamps only."""

# The reader.
LOOKS = 8
"""Frames that are looked at for the depth of gray."""

HELD_BYTES = 2e8
"""Pictures that are held at a time, about."""


@dataclass(frozen=True, eq=False)
class Frame:
    """A frame of a video.

    It stays readable for as long as it is held, and holds one of the decoder's pictures: let go of what is done with.

    Attributes:
        number: its place in order of presentation, from 0.
        time_s: its time from the first frame, from the file's time stamps.
    """

    number: int
    time_s: float
    _picture: av.VideoFrame = field(repr=False)
    _quarter_turns: int = field(default=0, repr=False)
    _square_px: tuple[int, int] | None = field(default=None, repr=False)  # stored width and height in square pixels
    _bits: int = field(default=16, repr=False)  # bits in use of gray in 16

    @cached_property
    def luma(self) -> np.ndarray:
        """(h, w) uint8 brightness, upright, read-only; pixel frame as everywhere (x right, y down).

        A view of the decoder's own memory wherever the video stores 8-bit brightness: nothing is copied, rows are
        further apart than `w` bytes, and a rotated video gives a view with negative or swapped strides (use
        `np.ascontiguousarray` on the part of interest before handing it to OpenCV). Values are as stored: most
        cameras use 16 to 235. Deeper brightness keeps its upper 8 bits; RGB pictures are converted, and pixels that are
        not square stretched.
        """
        luma = np.rot90(self._square(brightness(self._picture, self._bits)), self._quarter_turns)
        luma.flags.writeable = False
        return luma

    def rgb(self) -> np.ndarray:
        """Return (h, w, 3) uint8 colours, upright, a copy; costs several times what decoding costs."""
        if self._picture.format.name in GRAY_16:
            return np.ascontiguousarray(np.repeat(self.luma[..., None], 3, axis=2))
        stored = self._square(self._picture.to_ndarray(format="rgb24"))
        return np.ascontiguousarray(np.rot90(stored, self._quarter_turns))

    def _square(self, stored: np.ndarray) -> np.ndarray:
        """Return the stored picture in square pixels, stretched across if they are wide, along if they are high."""
        return stored if self._square_px is None else cv2.resize(np.ascontiguousarray(stored), self._square_px)

    def yuv(self) -> np.ndarray:
        """Return (h, w, 3) uint8 brightness and the two differences of colour, upright, a copy; a gray video has 128.

        Colours stored for every second pixel are taken to lie in the middle of those that share them.
        """
        if self._picture.format.name in GRAY_16:
            return np.dstack([self.luma, *np.full((2, *self.luma.shape), 128, np.uint8)])
        if not HALF_COLOUR.match(self._picture.format.name):
            stored = np.moveaxis(self._picture.to_ndarray(format="yuv444p"), 0, 2)
        else:
            picture = self._picture.reformat(format="yuv420p")
            size = picture.width, picture.height
            planes = [_plane(picture, np.uint8, number) for number in range(3)]
            stored = np.dstack([planes[0], *(cv2.resize(np.ascontiguousarray(plane), size) for plane in planes[1:])])
        return np.ascontiguousarray(np.rot90(self._square(stored), self._quarter_turns))

    def scaled(self, width_px: int, height_px: int) -> av.VideoFrame:
        """Return the picture in another size, upright, in YUV 4:2:0 (BT.601, which players assume), to be encoded."""
        turned = self._quarter_turns % 2
        stored = (height_px, width_px) if turned else (width_px, height_px)
        picture = self._picture
        if picture.format.name in GRAY_16:
            picture = av.VideoFrame.from_ndarray(np.ascontiguousarray(brightness(picture, self._bits)), format="gray")
        small = picture.reformat(*stored, format="yuv420p", dst_colorspace="ITU601", interpolation="AREA")
        if self._quarter_turns:
            upright: np.ndarray = np.ascontiguousarray(np.rot90(small.to_ndarray(format="rgb24"), self._quarter_turns))
            small = av.VideoFrame.from_ndarray(upright, format="rgb24").reformat(format="yuv420p")
        return small


def bits_used(picture: av.VideoFrame) -> int:
    """Count the bits that a gray picture of 16 uses, as cameras have them: 8 to 16; 16 for all other formats."""
    if picture.format.name not in GRAY_16:
        return 16
    brightest = int(_plane(picture, _two_bytes(picture.format.name)).max())
    return next(bits for bits in (8, 10, 12, 14, 16) if brightest < 2**bits)


def brightness(picture: av.VideoFrame, bits: int = 16) -> np.ndarray:
    """Return (h, w) uint8 brightness of a picture as it is stored; gray in 16 bits uses so many of them."""
    name = picture.format.name
    if BRIGHTNESS_FIRST.fullmatch(name):
        return _plane(picture, np.uint8)
    if deep := DEEP_BRIGHTNESS_FIRST.fullmatch(name):
        used = min(int(deep[1]), bits) if name in GRAY_16 else int(deep[1])
        return _upper_bits(_plane(picture, _two_bytes(name)), used - 8)
    if name in ("p010le", "p012le", "p016le"):  # brightness in the high bits
        return _upper_bits(_plane(picture, np.dtype("<u2")), 8)
    return _plane(picture.reformat(format="gray"), np.uint8)


def _two_bytes(name: str) -> np.dtype:
    return np.dtype(">u2" if name.endswith("be") else "<u2")


def _plane(picture: av.VideoFrame, dtype: np.typing.DTypeLike, number: int = 0) -> np.ndarray:
    """Return (h, w) view of a plane, the first one by default, without the padding of its rows."""
    plane = picture.planes[number]
    pixel = np.dtype(dtype)
    shape, row = (plane.height, plane.width), abs(plane.line_size)
    rows: np.ndarray = np.ndarray(shape, pixel, buffer=memoryview(plane), strides=(row, pixel.itemsize))
    return rows if plane.line_size > 0 else rows[::-1]


def _upper_bits(deep: np.ndarray, shift: int) -> np.ndarray:
    """Return (h, w) uint8 values without their lowest bits; what is beyond 8 bits then is as bright as can be."""
    if shift < 8:
        return np.minimum(np.right_shift(deep, shift), 255).astype(np.uint8)
    return np.right_shift(deep, shift, out=np.empty(deep.shape, np.uint8), casting="unsafe")


@dataclass(frozen=True, eq=False)
class VideoInfo:
    """A video's size, frames and times.

    Attributes:
        width_px, height_px: of the upright picture in square pixels.
        codec: name of the codec: ``"h264"``, ``"hevc"``, ...
        time_s: (n,) time of each frame from the first one, ascending.
        time_source: where the times come from.
        rotation_deg: 0, 90, 180 or 270, by how much the stored picture is turned counterclockwise to be upright.
        pixel_aspect: width over height of a pixel as stored; frames are given in square pixels.
        damage: what opening the file showed to be missing from it; None if nothing.
    """

    file: Path
    width_px: int
    height_px: int
    codec: str
    time_s: np.ndarray
    time_source: TimeSource = TimeSource.PRESENTATION
    rotation_deg: int = 0
    pixel_aspect: float = 1.0
    damage: str | None = None

    @property
    def has_clock(self) -> bool:
        """True if the file tells when its frames were taken; else the times are those of a given or guessed rate."""
        return self.time_source is not TimeSource.FRAME_RATE

    @property
    def is_square(self) -> bool:
        """True if the stored pixels are as wide as high."""
        return abs(self.pixel_aspect - 1) <= SQUARE_WITHIN

    @property
    def frames(self) -> int:
        """Number of frames in the file; `Video.frames` may give fewer if some cannot be decoded."""
        return len(self.time_s)

    @property
    def fps(self) -> float:
        """Frames a second, the median over spans of up to 60 frames; nan for a single frame."""
        span = min(self.frames - 1, LONGEST_SPAN)
        return float(span / np.median(self.time_s[span:] - self.time_s[:-span])) if span > 0 else np.nan

    @property
    def caveats(self) -> tuple[str, ...]:
        """Caveats of results from this video, in sentences without a full stop."""
        caveats = [self.damage] if self.damage else []
        if jump := self._jump():
            caveats.append(jump)
        if self.time_source is TimeSource.DECODING:  # a rate that was given is no caveat
            caveats.append(f"the file has no times of presentation; the frames' times come from {self.time_source}")
        return tuple(caveats)

    def _jump(self) -> str | None:
        """Name the longest step in time if it is far beyond the usual one: frames are missing or stamps are wrong."""
        steps_s = np.diff(self.time_s)
        if not len(steps_s):
            return None
        usual_s = np.median(steps_s)
        steady = np.mean(np.abs(steps_s - usual_s) <= STEADY_WITHIN * usual_s) >= STEADY
        reported_from_s = STEADY_STEP * usual_s if steady else max(LONG_STEP_S, LONG_STEP * usual_s)
        if steps_s.max() <= reported_from_s:
            return None
        return f"time jumps by {steps_s.max():.3f} s after frame {steps_s.argmax()}"


class Video:
    """A video file: its frames in order, or by number.

    Opening goes through the file once without decoding, to number the frames by their time stamps; a frame has
    the same number however it is reached. Whatever the FFmpeg bundled with PyAV decodes can be read. Not for use
    by several threads at once; each thread opens its own.

    >>> with Video(Path("f1_00.mp4")) as video:
    ...     for frame in video.frames():
    ...         track(frame.time_s, frame.luma)

    Attributes:
        info: size, codec and the time of every frame.
        threads: to decode with, 0 for all cores; who works on its frames does well to take no more.
    """

    def __init__(self, path: Path, threads: int = 0, fps: float | None = None) -> None:
        """Open a video; `threads` to decode with, 0 for all cores; `fps` counts where the file holds no times.

        Raises:
            InputError: if the file is missing, is no video or has no frame that can be decoded.
        """
        self._file, self.threads, self._fps = Path(path), threads, fps
        with Decoder(self._file, threads=1) as decoder:  # one thread: nothing beyond the first picture is decoded
            self._survey(decoder.container, decoder.stream)
        self._lost: set[int] = set()
        self._suspect = 0, np.zeros(self.info.frames, bool)  # number of lost frames, and their mask
        self._decoders: dict[int, Decoder] = {}  # decoders that `frame` uses, by their threads

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file; frames already given stay readable."""
        while self._decoders:
            self._decoders.popitem()[1].close()

    @property
    def damage(self) -> str | None:
        """Parts missing from the file, and what of it could not be decoded so far; None if nothing."""
        messages = [part for part in (self.info.damage, lost_frames(self._lost, self._index)) if part]
        return "; ".join(messages) or None

    @property
    def suspect(self) -> np.ndarray:
        """(n,) bool, the frames that could not be decoded so far, and those that may show traces of what is missing.

        Decoders fill in what is missing from other frames: a suspect picture may show an older moment in places. A
        packet that is gone together with its header is not missed, except by the step in time.
        """
        return suspect_frames(self._lost, self._index)

    def is_suspect(self, number: int) -> bool:
        """Tell whether a frame may show traces of those that could not be decoded so far."""
        if len(self._lost) != self._suspect[0]:
            self._suspect = len(self._lost), self.suspect
        return bool(self._suspect[1][number])

    def frames(self, start: int = 0, stop: int | None = None) -> Iterator[Frame]:
        """Yield the readable frames from `start` to before `stop` (None: to the end), in order of presentation.

        Frames that cannot be decoded are left out, the others keep their numbers and times, and `damage` reports it.
        Each call reads the file on its own and closes it when it is done or let go of.

        Raises:
            InputError: if `start` or `stop` are outside the video.
        """
        stop = self.info.frames if stop is None else stop
        if not 0 <= start <= stop <= self.info.frames:
            raise self._no_such_frame(f"frames {start} to {stop}")
        return self._frames(start, stop)

    def frame(self, number: int) -> Frame:
        """Return the frame with a number, exactly the one that `frames` gives under it.

        Raises:
            InputError: if the video has no such frame, or it cannot be decoded.
        """
        if not 0 <= number < self.info.frames:
            raise self._no_such_frame(f"frame {number}")
        for threads in () if number in self._lost else self._attempts:
            if threads not in self._decoders:
                self._decoders[threads] = Decoder(self._file, threads)
            found = next(self._onwards(self._decoders[threads], number), None)
            if found is not None and found.number == number:
                return self._as_frame(found)
        self._lost.add(number)
        where, damage = f"frame {number}", f"damaged data at {self.info.time_s[number]:.3f} s"
        raise InputError([Fault(str(self._file), where, "cannot be decoded", damage, "another frame")])

    @property
    def _attempts(self) -> tuple[int, ...]:
        """Threads to try with: several lose what follows a fault just before the end of a file, one does not."""
        return (1,) if self.threads == 1 else (self.threads, 1)

    def _frames(self, start: int, stop: int) -> Iterator[Frame]:
        """Yield the readable frames; each attempt goes on where the one before ended."""
        wanted = start
        for threads in self._attempts:
            if wanted == stop:
                return
            with Decoder(self._file, threads) as decoder:
                for numbered in takewhile(lambda one: one.number < stop, self._onwards(decoder, wanted)):
                    self._lost.update(range(wanted, numbered.number))
                    wanted = numbered.number + 1
                    yield self._as_frame(numbered)
                    if wanted == stop:
                        return
        self._lost.update(range(wanted, stop))

    def _onwards(self, decoder: Decoder, number: int) -> Iterator[NumberedPicture]:
        """Yield frame `number`, or the next readable one after it, and all readable ones that follow.

        A start that overshoots (the container's seek landed too late, or the frame only becomes clean from further
        back) is tried again from earlier key frames. Pictures of another size come from damaged headers.
        """
        first: NumberedPicture | None = None
        run: Iterator[NumberedPicture] = iter(())
        for start in self._index.starts(number):
            run = (one for one in decoder.decode(self._index, start) if one.number >= number and self._fits(one))
            first = next(run, None)
            if first is not None and first.number == number:
                break
        if first is not None:
            yield first
            yield from run

    def _fits(self, numbered: NumberedPicture) -> bool:
        return (numbered.picture.width, numbered.picture.height) == self._stored_size_px

    def _survey(self, container: av.container.InputContainer, stream: av.VideoStream) -> None:
        """Go through the packets and decode one frame."""
        read = read_packets(container, stream)
        picture = read.picture
        if picture is None:
            found = f"{len(read.packets)} packets of {stream.codec_context.name}, none of them readable"
            raise fault(self._file, "no frame of this video can be decoded", found, "at least one", COPY_AGAIN)
        self._index = index = index_frames(read, container, stream, self._fps)
        self._stored_size_px = stored = picture.width, picture.height
        turns = round(picture.rotation / 90) % 4
        aspect = float(stream.sample_aspect_ratio or 1)
        square = stored
        if abs(aspect - 1) > SQUARE_WITHIN:
            square = (round(stored[0] * max(aspect, 1)), round(stored[1] * max(1 / aspect, 1)))
        self._square_px = None if square == stored else square
        self._bits: int | None = None if picture.format.name in GRAY_16 else 16
        self.info = VideoInfo(
            self._file,
            *(square if turns % 2 == 0 else square[::-1]),
            codec=stream.codec_context.codec.canonical_name,
            time_s=index.time_s,
            time_source=index.source,
            rotation_deg=90 * turns,
            pixel_aspect=aspect,
            damage=missing_at_the_end(index, container, stream),
        )

    def _as_frame(self, numbered: NumberedPicture) -> Frame:
        number, picture = numbered
        if self._bits is None:
            self._bits = self._bits_of_film()
        turns = self.info.rotation_deg // 90
        return Frame(number, float(self.info.time_s[number]), picture, turns, self._square_px, self._bits)

    def _bits_of_film(self) -> int:
        """Count the bits that the brightest of some frames uses, where the format does not tell."""
        found = 8
        with Decoder(self._file, threads=1) as decoder:
            for number in np.unique(np.linspace(0, self.info.frames - 1, LOOKS).astype(int)).tolist():
                one = next(self._onwards(decoder, number), None)
                found = max(found, 8 if one is None else bits_used(one.picture))
        return found

    def _no_such_frame(self, found: str) -> InputError:
        last = self.info.frames - 1
        return InputError([Fault(str(self._file), "", "no such frame in this video", found, f"frames 0 to {last}")])


def backward(video: Video, stop: int) -> Iterator[Frame]:
    """Yield the readable frames before frame `stop`, the last first; decoded in stretches, one in memory at a time."""
    many = max(8, int(HELD_BYTES / (1.5 * video.info.width_px * video.info.height_px)))
    while stop > 0:
        first = max(stop - many, 0)
        yield from reversed(list(video.frames(first, stop)))
        stop = first
