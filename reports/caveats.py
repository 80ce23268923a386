"""Caveats of a trial's numbers, in sentences for the reader."""

from collections.abc import Iterable, Mapping

import numpy as np

from fitting import CalibratedTrial, MeasuredTrial
from fitting.trial import SCORED_S
from reports.numbers import listed, percent, sentence, shown
from session import Flag

LITTLE_USED = 0.9
FEW_BEATS = 2


def trial_caveats(trial: CalibratedTrial) -> tuple[str, ...]:
    """Flags that concern the whole trial, and what its length and its tracks leave out."""
    measured, scores = trial.measured, trial.scores
    caveats = [sentence(flag.message) for flag in trial.flags if not flag.markers]
    if scores.used_fraction < LITTLE_USED:
        caveats.append(f"Only {percent(scores.used_fraction)} of the scored samples count; the rest is flagged.")
    if (seconds := scored_seconds(measured)) < 0.98 * SCORED_S:
        caveats.append(f"The marker distance is a mean over {shown(seconds)} s instead of {SCORED_S:g} s.")
    if (beats := beats_compared(measured)) < FEW_BEATS:
        caveats.append(f"The speeds are slopes over {'one beat' if beats == 1 else 'less than one whole beat'}.")
    return tuple(caveats)


def speed_caveats(trial: CalibratedTrial) -> tuple[str, ...]:
    """Caveats of its speed, in a word each."""
    kinds = {
        flag.kind: flag.kind.replace("_", " ") for flag in trial.flags if flag.kind in ("extrapolated", "few_beats")
    }
    beats = beats_compared(trial.measured)
    short = () if beats >= FEW_BEATS else ("one beat" if beats == 1 else "less than a beat",)
    return (*kinds.values(), *short)


def kinds_of_whole_trials(flags: Mapping[str, Iterable[Flag]]) -> dict[str, str]:
    """Which trials, in words, have a flag of a kind that names no marker, by kind; of the flags by trial."""
    names: dict[str, list[str]] = {}
    for name, own in flags.items():
        for kind in dict.fromkeys(flag.kind for flag in own if not flag.markers):
            names.setdefault(kind, []).append(name)
    return {kind: "every trial" if len(own) == len(flags) else listed(own) for kind, own in names.items()}


def track_flags(trial: MeasuredTrial) -> tuple[Flag, ...]:
    """The flags of stretches of markers."""
    return tuple(flag for flag in trial.flags if flag.markers)


def scored_seconds(trial: MeasuredTrial) -> float:
    """How long the window is that the marker distance is taken over, s."""
    return float(trial.scored.sum() * np.median(np.diff(trial.time_s)))


def beats_compared(trial: MeasuredTrial) -> int:
    """How many whole beats the compared frames hold."""
    frame_s = float(np.median(np.diff(trial.time_s)))
    return int((np.ptp(trial.time_s[trial.kept]) + frame_s) * trial.frequency.hz + 1e-6)
