"""Naming what is wrong with tracks: stretches of misplaced or missing samples become flags for a reader."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from session import Flag
from tracking.stretches import stretches

JUMP_FRAMES = 6
"""A stretch no longer than this is called a jump."""
FROZEN_FRAMES = 6
"""The picture is frozen if no marker at all moves for so many frames …"""
FROZEN_MOTION_PX = 2.0
"""… and just before or after one moves by this in a frame."""


@dataclass(frozen=True, eq=False)
class Findings:
    """What was found about each sample."""

    present: np.ndarray  # (n, m) not missing
    wrong: np.ndarray  # (n, m) present but misplaced
    still: np.ndarray  # (n, m) standing still while the neighbours move
    touch: np.ndarray  # (n, m, m) two markers on one spot
    position_px: np.ndarray  # (n, m, 2)
    put_px: np.ndarray  # (n, m, 2) where the other markers put it
    order: np.ndarray  # (m,) the markers from nose to tail

    @classmethod
    def none(cls, present: np.ndarray, position_px: np.ndarray) -> Findings:
        """Nothing wrong but what is missing."""
        n, m = present.shape
        nothing, touch = np.zeros((n, m), dtype=bool), np.zeros((n, m, m), dtype=bool)
        return cls(present, nothing, nothing, touch, position_px, position_px, np.arange(m))


def flags_of(findings: Findings, markers: tuple[str, ...]) -> tuple[Flag, ...]:
    """One flag for each stretch of each marker, by first frame."""
    flags: list[Flag] = []
    for k, name in enumerate(markers):
        for first, last in stretches(~findings.present[:, k]):
            flags.append(Flag("gap", (name,), (first, last), f"{name} is missing in {_frames(first, last)}"))
        for first, last in stretches(findings.wrong[:, k]):
            flag = _named(findings, markers, k, first, last)
            if not any(_says_the_same(flag, other) for other in flags):
                flags.append(flag)
    return tuple(sorted(flags, key=lambda flag: (flag.frames or (0, 0), flag.markers)))


def _named(findings: Findings, markers: tuple[str, ...], k: int, first: int, last: int) -> Flag:
    span, long, concerned = slice(first, last + 1), last - first + 1, markers[k : k + 1]
    off_px = np.linalg.norm(findings.position_px[span, k] - findings.put_px[span, k], axis=1).max()
    touched = findings.touch[span, k].sum(axis=0)  # (m,) frames
    other = int(touched.argmax())
    if 2 * touched[other] >= long:
        concerned = (markers[k], markers[other])
        kind, text = "merged_markers", f"{markers[k]} sits on {markers[other]}: {_apart(findings, k, other, span)}"
        if 2 * findings.wrong[span, other].sum() >= long:
            text += "; both are left out"
    elif 2 * findings.still[span, k].sum() >= long:
        kind, text = "frozen_marker", f"{markers[k]} stands still while the body moves, {off_px:.0f} px away at most"
    elif long <= JUMP_FRAMES:
        kind, text = "jump", f"{markers[k]} jumps, {off_px:.0f} px from where the others put it at most"
    else:
        other = _neighbour(findings, k, span)
        kind = "segment_length"
        text = f"{markers[k]} is {off_px:.0f} px out of place at most; "
        text += f"from {markers[other]} {_apart(findings, k, other, span)}"
    return Flag(kind, concerned, (first, last), f"{text} ({_frames(first, last)})")


def _says_the_same(flag: Flag, other: Flag) -> bool:
    """Whether another flag names the same merge from its other side."""
    merge = flag.kind == other.kind == "merged_markers"
    return merge and flag.markers == other.markers[::-1] and flag.frames == other.frames


def _apart(findings: Findings, k: int, other: int, span: slice) -> str:
    """Median distance between two markers over a stretch: found, and expected."""
    found = np.linalg.norm(findings.position_px[span, k] - findings.position_px[span, other], axis=1)
    expected = np.linalg.norm(findings.put_px[span, k] - findings.put_px[span, other], axis=1)
    if np.isnan(found).all():
        return f"expected {np.median(expected):.0f} px"
    return f"{np.nanmedian(found):.0f} px, expected {np.median(expected):.0f} px"


def _neighbour(findings: Findings, k: int, span: slice) -> int:
    """The nearest marker in body order that is itself in place for most of the stretch, else the nearest."""
    rank = np.argsort(findings.order)
    near = [int(j) for j in np.argsort(np.abs(rank - rank[k]), kind="stable") if j != k]
    bad = (findings.wrong | ~findings.present)[span].mean(axis=0)
    return next((j for j in near if bad[j] < 0.5), near[0])


def _frames(first: int, last: int) -> str:
    return f"frame {first}" if first == last else f"{last - first + 1} frames"


def frozen_picture(position_px: np.ndarray) -> np.ndarray:
    """(n,) frames within a long enough stretch in which the markers (n, m, 2) all stay where they are.

    A robot that comes to rest slows down; a picture that freezes does so from one frame to the next. The first frame of
    a stretch is a true picture and stays out. A marker that is missing counts as unmoved.
    """
    step = np.nan_to_num(np.abs(np.diff(position_px, axis=0)))
    moved_px = step.max(axis=(1, 2), initial=0.0)  # (n - 1,)
    seen = np.isfinite(position_px).all(axis=2).any(axis=1)  # (n,)
    same = np.concatenate([[False], (step == 0).all(axis=(1, 2)) & seen[1:]])
    result = np.zeros(len(same), bool)
    for first, last in stretches(same):
        around = np.concatenate([moved_px[max(first - 3, 0) : first - 1], moved_px[last : last + 2]])
        abrupt = around.max(initial=0.0) >= FROZEN_MOTION_PX
        result[first : last + 1] = abrupt and last - first + 2 >= FROZEN_FRAMES
    return result


def frozen_flags(frozen: np.ndarray, markers: tuple[str, ...]) -> list[Flag]:
    """A flag for each stretch."""
    what = "no marker moves for {} frames: the video stands still or repeats itself"
    return [Flag("frozen_marker", markers, span, what.format(span[1] - span[0] + 1)) for span in stretches(frozen)]
