"""Samples that only CSRT saw: flags for a reader, and a mask to edit."""

from collections.abc import Iterable, Sequence

import numpy as np

from session import Flag
from tracking.suspects import stretches

ONLY_CSRT = "only_csrt"


def only_csrt_flags(by_csrt: np.ndarray, markers: Sequence[str]) -> tuple[Flag, ...]:
    """One flag for each stretch of each marker in (n, m)."""
    return tuple(
        Flag(ONLY_CSRT, (name,), span, f"no spot answers, only CSRT sees {name}")
        for k, name in enumerate(markers)
        for span in stretches(by_csrt[:, k])
    )


def seen_only_by_csrt(flags: Iterable[Flag], frames: int, markers: Sequence[str]) -> np.ndarray:
    """(n, m) bool, what `only_csrt_flags` was made from."""
    by_csrt = np.zeros((frames, len(markers)), dtype=bool)
    for flag in flags:
        if flag.kind == ONLY_CSRT and flag.frames is not None:
            by_csrt[flag.frames[0] : flag.frames[1] + 1, [markers.index(name) for name in flag.markers]] = True
    return by_csrt
