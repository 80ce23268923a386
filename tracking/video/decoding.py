"""Opening a file, with one clear error for whatever is not a video, and decoding from its start or from a key frame."""

import sys
from collections.abc import Iterator
from contextlib import suppress
from itertools import chain
from pathlib import Path
from types import TracebackType
from typing import NamedTuple, Self

import av

from session.errors import Fault, InputError
from tracking.video.index import FrameIndex, has_no_times, stamped_packets

EXPECTED = "a video file (MP4, MOV, MKV, AVI, WebM, ...)"
MP4_BOXES = (b"ftyp", b"moov", b"mdat", b"wide", b"free", b"skip")
"""Names of boxes an MP4 or MOV file begins with (ISO/IEC 14496-12, table 1)."""
REPAIR = (
    "If the recording was cut short, put the card back into the camera, which may repair it (GoPro: SOS), or copy the "
    "file again; a repair tool with an intact video of the same camera can rebuild the index."
)


class NumberedPicture(NamedTuple):
    """A decoded picture and its place in order of presentation."""

    number: int
    picture: av.VideoFrame


class Decoder:
    """One open file that decodes from wherever it is told to; numbers agree however a frame is reached."""

    def __init__(self, file: Path, threads: int) -> None:
        """Opens the file; `threads` 0 takes all cores."""
        self.file, self.threads = file, threads
        self._at_start = True
        self._open()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Closes the file; pictures already given stay readable."""
        self.container.close()

    def decode(self, index: FrameIndex, start: int | None) -> Iterator[NumberedPicture]:
        """Readable pictures in order of presentation, from the key frame with stamp `start` or from the file's start.

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
        """All pictures; a file already read from is opened anew, as not every container can go back to its start."""
        if not self._at_start:
            self.close()
            self._open()
        self._at_start = False
        yield from self._pictures(self._packets())

    def _pictures_from_key(self, start: int) -> Iterator[av.VideoFrame]:
        """The pictures from the key frame on at which a seek to stamp `start` lands; all, where there is no seeking."""
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
        """Decodes packets; one that cannot be decoded is passed over.

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
    """The presentation stamp; before all others where there is none."""
    return -sys.maxsize if stamped.pts is None else stamped.pts


def open_video(file: Path) -> tuple[av.container.InputContainer, av.VideoStream]:
    """Opens a file and picks its main picture stream.

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


def _check_file(file: Path) -> None:
    if not file.exists():
        raise fault(file, "no such file", "", EXPECTED)
    if file.is_dir():
        raise fault(file, "not a file", "a folder", EXPECTED)
    if file.stat().st_size == 0:
        raise fault(file, "empty file", "0 bytes", EXPECTED, "Copy it again from the camera's card.")


def _unreadable(file: Path, error: Exception) -> InputError:
    try:
        with file.open("rb") as stream:
            head = stream.read(8)
    except OSError as denied:
        return fault(file, "cannot be read", denied.strerror or str(denied), EXPECTED, "Check the file's permissions.")
    size_mb = f"{file.stat().st_size / 1e6:.1f} MB"
    if head[4:8] in MP4_BOXES:
        what = "the index of this MP4 or MOV file (its moov atom) is missing or damaged"
        return fault(file, what, f"{size_mb} without a readable index", "a file the camera has closed", REPAIR)
    reason = getattr(error, "strerror", None) or str(error)
    return fault(file, "not a readable video", f"{size_mb} of something else ({reason})", EXPECTED)


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


def fault(file: Path, what: str, found: str, expected: str, next_step: str = "") -> InputError:
    """An `InputError` with one fault of the whole file."""
    return InputError([Fault(str(file), "", what, found, expected, next_step=next_step)])
