"""The reader of videos."""

from collections.abc import Iterator
from itertools import takewhile
from pathlib import Path
from types import TracebackType
from typing import Self

import av
import numpy as np

from session.errors import Fault, InputError
from tracking.video.damage import lost_frames, missing_at_the_end, suspect_frames
from tracking.video.decoding import Decoder, NumberedPicture, fault
from tracking.video.frame import GRAY_16, Frame, bits_used
from tracking.video.index import index_frames, read_packets
from tracking.video.info import SQUARE_WITHIN, VideoInfo

LOOKS = 8
"""Frames that are looked at for the depth of gray."""


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
        """Opens a video; `threads` to decode with, 0 for all cores; `fps` counts where the file holds no times.

        Raises:
            InputError: if the file is missing, is no video or has no frame that can be decoded.
        """
        self._file, self.threads, self._fps = Path(path), threads, fps
        with Decoder(self._file, threads=1) as decoder:  # one thread: nothing beyond the first picture is decoded
            self._survey(decoder.container, decoder.stream)
        self._lost: set[int] = set()
        self._suspect = 0, np.zeros(self.info.frames, bool)  # by how many are lost
        self._decoders: dict[int, Decoder] = {}  # for `frame`, by their threads

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Closes the file; frames already given stay readable."""
        while self._decoders:
            self._decoders.popitem()[1].close()

    @property
    def damage(self) -> str | None:
        """What is missing from the file, and what of it could not be decoded so far; None if nothing."""
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
        """The readable frames from `start` up to, not including, `stop` (None: to the end), in order of presentation.

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
        """The frame with a number, exactly the one that `frames` gives under it.

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
        """The readable frames, each attempt going on where the one before ended."""
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
        """Frame `number`, or the next readable one after it, and all readable ones that follow.

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
        """Goes through the packets and decodes one frame."""
        read = read_packets(container, stream)
        picture = read.picture
        if picture is None:
            found = f"{len(read.packets)} packets of {stream.codec_context.name}, none of them readable"
            raise fault(
                self._file, "no frame of this video can be decoded", found, "at least one", "Copy the file again."
            )
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
