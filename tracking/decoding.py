"""Frames decoded from a video file, in order, at random, and backward.

`FrameIndex` says which frames a video has, when each is shown and where decoding can start: from the packets, without
decoding. `open_video` opens a file, with one clear error for whatever is not a video, and a `Decoder` decodes from its
start or from a key frame.
"""

import sys
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import chain
from pathlib import Path
from typing import NamedTuple, Self

import av
import numpy as np

from swimcal.errors import Fault, InputError

NO_TIMESTAMPS = 0x0080
"""FFmpeg's AVFMT_NOTIMESTAMPS (libavformat/avformat.h)."""
MOSTLY = 0.95
"""From this share of packets with a time stamp of their own, the others are damaged packets, not frames."""
AVI, AVI_HEADER = "avi", 8
"""The container, and the bytes of a chunk's name and length, at which its index points, before the packet itself."""
NO_TIME_OF_PRESENTATION = (AVI,)
"""Containers that store the order of decoding only; what FFmpeg gives as times of presentation is then a guess."""
STEPS_BACK = (1, 2, 4, 8)
"""Which key frames before a frame to start decoding from, should the nearest one not lead to it."""

EXPECTED = "a video file (MP4, MOV, MKV, AVI, WebM, ...)"
MP4_BOXES = (b"ftyp", b"moov", b"mdat", b"wide", b"free", b"skip")
"""Names of boxes an MP4 or MOV file begins with (ISO/IEC 14496-12, table 1)."""
OTHER_BEGINNINGS = (b"RIFF", b"\x1aE\xdf\xa3")
"""First bytes of AVI and of Matroska or WebM."""
COPY_AGAIN = "Copy it again from the camera's card."
REPAIR = (
    "If the recording was cut short, put the card back into the camera, which may repair it (GoPro: SOS), or copy the "
    "file again; a repair tool with an intact video of the same camera can rebuild the index."
)


class TimeSource(StrEnum):
    """Where the times of the frames come from."""

    PRESENTATION = "presentation time stamps"
    DECODING = "decoding time stamps"
    FRAME_RATE = "the frame rate"


class Packet(NamedTuple):
    """Index entry of a packet: its stamps in units of the stream's time base, and its flags."""

    pts: int | None
    dts: int | None
    is_key: bool
    is_corrupt: bool
    is_shown: bool


class Packets(NamedTuple):
    """The packets of a stream."""

    packets: list[Packet]  # those with data, in order of decoding
    total: int  # how many there are with the empty ones
    broke_off: bool  # reading them ended with an error
    picture: av.VideoFrame | None  # the first one that can be decoded; None if there is none


@dataclass(frozen=True, eq=False)
class FrameIndex:
    """The frames of a video in order of presentation."""

    time_s: np.ndarray  # (n,) time of each frame from the first one
    source: TimeSource  # where the times come from
    pts: np.ndarray | None  # (n,) presentation stamps, ascending; None where the file has none one can trust
    number_of: dict[int, int]  # stamp -> number of the frame; empty where `pts` is None
    keys: np.ndarray  # ascending stamps of the key frames decoding can start from; empty where `pts` is None
    corrupt: frozenset[int]  # numbers of the frames whose packet the container itself calls corrupt
    is_reordered: bool  # frames may be decoded in another order than they are shown in
    total_packets: int  # packets read, shown or not
    broke_off: bool  # reading the packets ended with an error

    def starts(self, number: int) -> list[int | None]:
        """Yield stamps of key frames to start from to reach a frame, best first; None is the start of the file."""
        if self.pts is None or number == 0:
            return [None]
        before = int(np.searchsorted(self.keys, self.pts[number], side="right"))
        keys: list[int | None] = [int(self.keys[before - back]) for back in STEPS_BACK if back <= before]
        return keys if before > STEPS_BACK[-1] else [*keys, None]

    def group(self, number: int) -> tuple[int, int]:
        """Return the group of pictures of a frame: its first frame, a key frame, and the first one after it."""
        if self.pts is None:
            return 0, len(self.time_s)
        before = int(np.searchsorted(self.keys, self.pts[number], side="right"))
        bounds = np.searchsorted(self.pts, self.keys)  # a key frame that an edit list hides counts as the first shown
        first = bounds[before - 1] if before else 0
        return int(first), int(bounds[before]) if before < len(bounds) else len(self.time_s)


def read_packets(container: av.container.InputContainer, stream: av.VideoStream) -> Packets:
    """Go through the file once, up to an error of the container, and decode no more than one picture."""
    packets: list[Packet] = []
    total, broke_off, picture = -1, True, None  # PyAV adds a packet of its own for the end of the stream
    with suppress(av.FFmpegError):
        for packet in stamped_packets(container, stream):
            total += 1
            if packet.size:
                flags = packet.is_keyframe, packet.is_corrupt, not packet.is_discard
                packets.append(Packet(packet.pts, packet.dts, *flags))
                picture = picture or _decoded(stream, packet)
        broke_off = False
    return Packets(packets, total + broke_off, broke_off, picture or _decoded(stream, None))


def stamped_packets(container: av.container.InputContainer, stream: av.VideoStream) -> Iterator[av.Packet]:
    """Yield the packets from where a file is on; those of AVI with the stamps of its index.

    AVI stores no stamps: FFmpeg counts the packets that it finds, which are too few where headers of some are damaged.
    """
    numbers: dict[int, int] = {}
    if container.format.name == AVI:
        numbers = {entry.pos + AVI_HEADER: entry.timestamp for entry in stream.index_entries}
    for packet in container.demux(stream):
        if packet.pos in numbers:
            number = numbers[packet.pos]
            if packet.pts == packet.dts:
                packet.pts = number
            packet.dts = number
        yield packet


def index_frames(
    read: Packets, container: av.container.InputContainer, stream: av.VideoStream, fps: float | None = None
) -> FrameIndex:
    """Index the frames of a stream in the order in which they are shown; `fps` is for files without times."""
    found = _index_frames(read, container, stream)
    if found.source is not TimeSource.FRAME_RATE and not has_no_times(container):
        return found
    time_s = np.arange(len(found.time_s)) / (fps or float(stream.guessed_rate or 25))
    return replace(found, time_s=time_s, source=TimeSource.FRAME_RATE)


def has_no_times(container: av.container.InputContainer) -> bool:
    """Tell whether files of this kind hold no times: raw H.264, HEVC, MJPEG, …; FFmpeg then counts as if at 25 a
    second, or by a rate that is stated somewhere in the pictures.
    """
    return bool(container.format.flags & NO_TIMESTAMPS)


def _decoded(stream: av.VideoStream, packet: av.Packet | None) -> av.VideoFrame | None:
    """Return the first sound picture that the decoder gives for a packet, or for None what it still holds."""
    with suppress(av.FFmpegError):
        return next((picture for picture in stream.decode(packet) if not picture.is_corrupt), None)
    return None


def _index_frames(read: Packets, container: av.container.InputContainer, stream: av.VideoStream) -> FrameIndex:
    shown = [packet for packet in read.packets if packet.is_shown]
    if not (stream.codec_context.has_b_frames and container.format.name in NO_TIME_OF_PRESENTATION):
        stamps = sorted({packet.pts for packet in shown if packet.pts is not None})
        if len(stamps) >= MOSTLY * len(shown):
            return _by_presentation(read, stamps, stream)
    return _by_order(read, shown, stream)


def _unit_s(stream: av.VideoStream) -> float:
    return float(stream.time_base or 1)


def _by_presentation(read: Packets, stamps: Sequence[int], stream: av.VideoStream) -> FrameIndex:
    pts = np.array(stamps, dtype=np.int64)
    number_of = {stamp: number for number, stamp in enumerate(stamps)}
    return FrameIndex(
        time_s=(pts - pts[:1]) * _unit_s(stream),
        source=TimeSource.PRESENTATION,
        pts=pts,
        number_of=number_of,
        keys=np.array(sorted({p.pts for p in read.packets if p.is_key and p.pts is not None}), dtype=np.int64),
        corrupt=frozenset(number_of[p.pts] for p in read.packets if p.is_corrupt and p.pts in number_of),
        is_reordered=stream.codec_context.has_b_frames,
        total_packets=read.total,
        broke_off=read.broke_off,
    )


def _by_order(read: Packets, shown: Sequence[Packet], stream: av.VideoStream) -> FrameIndex:
    """Build the index by counting: frames leave the decoder in order of presentation, whatever their packets claim."""
    dts = sorted({packet.dts for packet in shown if packet.dts is not None})
    if shown and len(dts) == len(shown):
        time_s, source = (np.array(dts) - dts[0]) * _unit_s(stream), TimeSource.DECODING
    else:
        time_s, source = np.arange(len(shown)) / float(stream.guessed_rate or 25), TimeSource.FRAME_RATE
    no_keys = np.empty(0, dtype=np.int64)
    return FrameIndex(time_s, source, None, {}, no_keys, frozenset(), True, read.total, read.broke_off)


class NumberedPicture(NamedTuple):
    """A decoded picture and its place in order of presentation."""

    number: int
    picture: av.VideoFrame


class Decoder:
    """One open file that decodes from wherever it is told to; numbers agree however a frame is reached."""

    def __init__(self, file: Path, threads: int) -> None:
        """Open the file; `threads` 0 takes all cores."""
        self.file, self.threads = file, threads
        self._at_start = True
        self._open()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file; pictures already given stay readable."""
        self.container.close()

    def decode(self, index: FrameIndex, start: int | None) -> Iterator[NumberedPicture]:
        """Yield readable pictures in order of presentation, from the key frame with stamp `start` or the file's start.

        A seek may land somewhere else; what comes is numbered by its own stamp. Pictures shown before the key frame
        at which decoding began are left out (they may lean on pictures before it), and so are damaged ones.
        """
        pictures = self._pictures_from_start() if start is None else self._pictures_from_key(start)
        last = -1
        for count, picture in enumerate(pictures):
            number = count if index.pts is None else index.number_of.get(_stamp(picture), -1)
            if number > last and not picture.is_corrupt and number not in index.corrupt:
                last = number
                yield NumberedPicture(number, picture)

    def _pictures_from_start(self) -> Iterator[av.VideoFrame]:
        """Yield all pictures; a file already read from is opened anew: not every container can go back to its start."""
        if not self._at_start:
            self.close()
            self._open()
        self._at_start = False
        yield from self._pictures(self._packets())

    def _pictures_from_key(self, start: int) -> Iterator[av.VideoFrame]:
        """Yield the pictures from the key frame at which a seek to stamp `start` lands; all without seeking."""
        self._at_start = False
        try:
            self.container.seek(start, stream=self.stream)
        except av.FFmpegError:
            yield from self._pictures_from_start()
            return
        packets = self._packets()
        key = next((packet for packet in packets if packet.is_keyframe and packet.pts is not None), None)
        if key is not None:
            pictures = self._pictures(chain([key], packets))
            yield from (picture for picture in pictures if _stamp(picture) >= _stamp(key))

    def _open(self) -> None:
        self.container, self.stream = open_video(self.file)
        self.stream.thread_type = "AUTO"  # threads across frames as well as within one
        self.stream.codec_context.thread_count = self.threads
        self._at_start = True

    def _packets(self) -> Iterator[av.Packet]:
        try:
            yield from (packet for packet in stamped_packets(self.container, self.stream) if packet.size)
        except av.FFmpegError:
            return

    def _pictures(self, packets: Iterator[av.Packet]) -> Iterator[av.VideoFrame]:
        """Decode packets and skip those that cannot be decoded.

        PyAV gives up on what threads still hold at the end of the file once one of them fails.
        """
        for packet in packets:
            try:
                yield from self.stream.decode(packet)
            except av.FFmpegError:
                continue
        with suppress(av.FFmpegError):
            yield from self.stream.decode(None)


def _stamp(stamped: av.VideoFrame | av.Packet) -> int:
    """Return the presentation stamp; one before all others where there is none."""
    return -sys.maxsize if stamped.pts is None else stamped.pts


def open_video(file: Path) -> tuple[av.container.InputContainer, av.VideoStream]:
    """Open a file and pick its main picture stream.

    Raises:
        InputError: if there is no such file, it is no video, has no pictures, or none this FFmpeg can decode.
    """
    _check_file(file)
    try:
        container = av.open(str(file.absolute()))  # FFmpeg takes what is before a colon for a protocol
    except (av.FFmpegError, OSError) as error:
        raise _unreadable(file, error) from error
    try:
        return container, _picture_stream(file, container)
    except BaseException:
        container.close()
        raise


def is_without_times(file: Path) -> bool:
    """Tell whether a video is of a kind that holds no times; False for what cannot be opened."""
    try:
        container, _ = open_video(file)
    except InputError:
        return False
    with container:
        return has_no_times(container)


def fault(file: Path, what: str, found: str, expected: str, next_step: str = "") -> InputError:
    """Make an `InputError` with one fault of the whole file."""
    return InputError([Fault(str(file), "", what, found, expected, next_step=next_step)])


def _check_file(file: Path) -> None:
    if not file.exists():
        raise fault(file, "the file is not there", "", EXPECTED)
    if file.is_dir():
        raise fault(file, "not a file", "a folder", EXPECTED)
    if file.stat().st_size == 0:
        raise fault(file, "empty file", "0 bytes", EXPECTED, COPY_AGAIN)


def _unreadable(file: Path, error: Exception) -> InputError:
    try:
        with file.open("rb") as stream:
            head = stream.read(8)
    except OSError as denied:
        return fault(file, "cannot be read", denied.strerror or str(denied), EXPECTED, "Check the file's permissions.")
    count = file.stat().st_size
    size = f"{count / 1e6:.1f} MB" if count >= 1e6 else f"{count / 1e3:.1f} kB"
    if head[4:8] in MP4_BOXES:
        what = "the index of this MP4 or MOV file (its moov atom) is missing or damaged"
        return fault(file, what, f"{size} without a readable index", "a file the camera has closed", REPAIR)
    reason = getattr(error, "strerror", None) or str(error)
    if head.startswith(OTHER_BEGINNINGS):
        return fault(file, "the video is cut short or damaged", f"{size} ({reason})", EXPECTED, COPY_AGAIN)
    return fault(file, "not a readable video", f"{size} of something else ({reason})", EXPECTED)


def _picture_stream(file: Path, container: av.container.InputContainer) -> av.VideoStream:
    stream = container.streams.best("video")
    if stream is None:
        kinds = ", ".join(stream.type for stream in container.streams) or "no stream at all"
        raise fault(file, "no pictures in this file", kinds, "a video stream")
    if stream.codec_context is None:
        next_step = "Convert it to H.264 with a full FFmpeg."
        raise fault(file, "no decoder for this video", "an unknown codec", "H.264, HEVC, VP9, FFV1, ...", next_step)
    assert isinstance(stream, av.VideoStream)
    return stream
