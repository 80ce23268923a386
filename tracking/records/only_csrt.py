"""Samples that only CSRT saw: flags for a reader, and a mask to edit."""

from collections.abc import Iterable, Sequence

import numpy as np

from session import Flag
from tracking.suspects import stretches

ONLY_CSRT = "only_csrt"
BELIEVED_FOR = 12
"""Frames on end for which CSRT is believed where no spot answers; a marker that it follows for longer, faint from the
first frame on, may be another by then, and CSRT does not say so: of four such markers in a clip two were 6 to 20 px
off."""


def only_csrt_flags(by_csrt: np.ndarray, markers: Sequence[str]) -> tuple[Flag, ...]:
    """One flag for each stretch of each marker in (n, m)."""
    return tuple(
        Flag(ONLY_CSRT, (name,), span, f"no spot answers, only CSRT sees {name}{_unless_long(span)}")
        for k, name in enumerate(markers)
        for span in stretches(by_csrt[:, k])
    )


def _unless_long(span: tuple[int, int]) -> str:
    return ", for too long to count" if _too_long(span) else ""


def alone_too_long(flag: Flag) -> bool:
    """Whether this flag says that CSRT alone saw a marker for more frames on end than it is believed."""
    return flag.kind == ONLY_CSRT and flag.frames is not None and _too_long(flag.frames)


def _too_long(span: tuple[int, int]) -> bool:
    return span[1] - span[0] + 1 > BELIEVED_FOR


def seen_only_by_csrt(flags: Iterable[Flag], frames: int, markers: Sequence[str]) -> np.ndarray:
    """(n, m) bool, what `only_csrt_flags` was made from."""
    by_csrt = np.zeros((frames, len(markers)), dtype=bool)
    for flag in flags:
        if flag.kind == ONLY_CSRT and flag.frames is not None:
            by_csrt[flag.frames[0] : flag.frames[1] + 1, [markers.index(name) for name in flag.markers]] = True
    return by_csrt
