"""The position of a motor's shaft as one continuous angle, whatever counter it was logged from.

A servo's shaft cannot make half a turn between two readings some 10 ms apart: jumps by whole turns come from the
counter.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.ndimage import median_filter

from session.errors import FaultCollector
from session.flags import Flag

TURN = 2 * np.pi

# Readings of a running median: up to four misread ones in a row are recognised.
_WINDOW = 9
# A reading may be away from its neighbours by this, turns, in addition to what the shaft turns meanwhile.
_OFF_TURNS = 0.1
# A position that stays within this range, turns, and jumps is logged as 0 to 1 or -1/2 to 1/2 turn.
_ONE_TURN = 1.01
# Share of steps beyond half a turn: above it, the shaft itself makes them between two readings.
_SPARSE_SHARE = 0.3
# Readings count as missing where two are further apart than this many times the usual spacing.
_GAP = 3.0


class ShaftPosition(NamedTuple):
    """Continuous position (n,) of a shaft, rad, nan where missing or misread, and flags."""

    position_rad: np.ndarray
    flags: tuple[Flag, ...]


def continuous_position(
    time_s: np.ndarray,
    position_rad: np.ndarray,
    velocity_rad_s: np.ndarray,
    lines: np.ndarray,
    column: str,
    faults: FaultCollector,
) -> ShaftPosition:
    """Take out misread positions, and the whole turns by which a counter jumps.

    A position that stays within one turn is unwrapped. Single readings away from their neighbours are left out and
    flagged. Where a counter jumps by whole turns and stays there, the turns are taken out and flagged.

    Args:
        time_s: (n,) times of the readings, s, increasing.
        position_rad: (n,) positions as logged, rad; nan where missing.
        velocity_rad_s: (n,) speeds as logged, rad/s; nan where missing.
        lines: (n,) numbers of their lines in the file.
        column: the position's name in the file.
        faults: receives a fault where a position within one turn is read too seldom to be unwrapped.
    """
    seen = np.flatnonzero(np.isfinite(position_rad))
    if len(seen) < _WINDOW:
        return ShaftPosition(position_rad, ())
    turns, times = position_rad[seen] / TURN, time_s[seen]
    near = median_filter(turns, _WINDOW, mode="mirror")
    strange = np.abs(turns - near) > _OFF_TURNS + 1.5 * _WINDOW / 2 * _usual_step(turns)
    within = turns[~strange]
    one_turn = bool(np.ptp(within) <= _ONE_TURN)
    if one_turn:  # a shaft that rests where the counter wraps reads either end
        whole = np.abs(turns - near - np.round(turns - near)) <= _OFF_TURNS
        strange &= ~(whole & (turns > within.max() - _ONE_TURN) & (turns < within.min() + _ONE_TURN))
    kept = np.flatnonzero(~strange)
    jumps = _jumps(times[kept], turns[kept], one_turn)
    share = float(np.mean(jumps != 0))
    known = np.isfinite(velocity_rad_s).mean() > 0.5
    between = np.nanmedian(np.abs(velocity_rad_s)) / TURN * np.median(np.diff(times)) if known else 0.0
    if one_turn and (share > _SPARSE_SHARE or (share > 0 and between > 0.5)):
        faults.add(
            "",
            f"{column} stays within one turn and is read too seldom to tell how far the shaft turned in between",
            found=f"a reading every {np.median(np.diff(times)):.2g} s",
            expected="a few readings a turn, or a position that counts on over whole turns",
        )
        return ShaftPosition(position_rad, ())
    mended = np.full(len(position_rad), np.nan)
    if share > _SPARSE_SHARE:
        jumps = np.zeros_like(jumps)
    mended[seen[kept]] = position_rad[seen[kept]] - TURN * np.concatenate([[0.0], np.cumsum(jumps)])
    log = Path(faults.file).name
    flags = _flag_misread(log, lines[seen[strange]], (turns - near)[strange])
    return ShaftPosition(mended, flags if one_turn else (*flags, *_flag_jumps(log, lines[seen[kept[1:]]], jumps)))


def _usual_step(turns: np.ndarray) -> float:
    """Estimate how far the shaft turns between two readings where it is fast, turns.

    Jumps of the counter do not count.
    """
    step = np.diff(turns)
    return float(max(np.percentile(np.abs(step - np.round(step)), 90), np.median(np.abs(step))))


def _jumps(times: np.ndarray, turns: np.ndarray, one_turn: bool) -> np.ndarray:
    """Estimate the (k - 1,) whole turns by which the counter jumps from each reading to the next.

    Over missing readings the shaft's speed before and after says how far it can have come; a position within one turn
    is taken to have come as far as their mean says.
    """
    step, spacing = np.diff(turns), np.diff(times)
    regular = spacing <= _GAP * np.median(spacing)
    speed = (step - np.round(step))[regular] / spacing[regular]
    speed = np.interp(np.arange(len(step)), np.flatnonzero(regular), median_filter(speed, _WINDOW, mode="nearest"))
    before, after = np.concatenate([speed[:1], speed[:-1]]), np.concatenate([speed[1:], speed[-1:]])
    low, high = spacing * np.minimum(before, after), spacing * np.maximum(before, after)
    jumps = np.round(step - (low + high) / 2)
    possible = (step > low - 0.5) & (step < high + 0.5)
    return np.where(possible & (not one_turn), 0.0, jumps)


def _flag_misread(log: str, lines: np.ndarray, off_turns: np.ndarray) -> tuple[Flag, ...]:
    if not len(lines):
        return ()
    several, first = "s" * (len(lines) > 1), off_turns[0]
    how_far = f"{first:+.0f}" if abs(first - round(first)) < _OFF_TURNS else f"{first:+.1f}"
    message = (
        f"{len(lines)} single reading{several} of the motor's position (line{several} {_list_lines(lines)} of {log}) "
        f"cannot be, the first is {how_far} turns off its neighbours; left out, and the crank is taken to turn "
        "smoothly there"
    )
    return (Flag("misread_position", message=message),)


def _flag_jumps(log: str, lines: np.ndarray, jumps: np.ndarray) -> tuple[Flag, ...]:
    at = np.flatnonzero(jumps)
    if not len(at):
        return ()
    message = (
        f"the motor's position jumps by {', '.join(f'{turns:+.0f}' for turns in jumps[at][:4])}"
        f"{' ...' if len(at) > 4 else ''} turns at line {_list_lines(lines[at])} of {log} and stays there, as after "
        "a restart of the motor; these turns are taken out"
    )
    return (Flag("position_jump", message=message),)


def _list_lines(lines: np.ndarray) -> str:
    shown = ", ".join(str(line) for line in lines[:6])
    return shown if len(lines) <= 6 else f"{shown} ... {lines[-1]}"
