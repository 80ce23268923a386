"""Decoding from the start of the file or from a key frame, each picture with its number."""

import sys
from collections.abc import Iterator
from contextlib import suppress
from itertools import chain
from pathlib import Path
from types import TracebackType
from typing import NamedTuple, Self

import av

from tracking.video.index import FrameIndex
from tracking.video.opening import open_video


class Numbered(NamedTuple):
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

    def decode(self, index: FrameIndex, start: int | None) -> Iterator[Numbered]:
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
                yield Numbered(number, picture)

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
        """The stream's packets up to the end of what can be read."""
        try:
            yield from (packet for packet in self.container.demux(self.stream) if packet.size)
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
