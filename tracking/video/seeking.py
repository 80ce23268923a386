"""Exact random access: the frame with a number, however the container seeks."""

from collections.abc import Iterator

from tracking.video.decoding import Decoder, Numbered
from tracking.video.index import FrameIndex


class Seeker:
    """Reaches frames by number, decoding on from where it is when no key frame lies between."""

    def __init__(self, decoder: Decoder, index: FrameIndex) -> None:
        self._decoder, self._index = decoder, index
        self._run: Iterator[Numbered] = iter(())
        self._at: int | None = None

    def close(self) -> None:
        """Closes the file."""
        self._decoder.close()

    def reach(self, number: int) -> Numbered | None:
        """Frame `number`, or the next readable one after it; None if there is none.

        A start that overshoots (the container's seek landed too late, or the frame only becomes clean from further
        back) is tried again from earlier key frames.
        """
        at = self._at
        if at is not None and at < number and not self._index.key_between(at, number):
            reached = self._run_to(number)
            if reached is not None and reached.number == number:
                return reached
        reached = None
        for start in self._index.starts(number):
            self._run = self._decoder.decode(self._index, start)
            reached = self._run_to(number)
            if reached is not None and reached.number == number:
                break
        return reached

    def onwards(self, number: int) -> Iterator[Numbered]:
        """Frame `number` and all readable ones after it, in order."""
        first = self.reach(number)
        if first is not None:
            yield first
            yield from self._run

    def _run_to(self, number: int) -> Numbered | None:
        """Decodes on to frame `number` or the first one after it."""
        for numbered in self._run:
            self._at = numbered.number
            if numbered.number >= number:
                return numbered
        self._at = None
        return None
