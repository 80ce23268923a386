"""Trials that take part in a fit, and those of them that should not be trusted once it is made.

One unusable trial never stops the others: it is left out, and a flag says why.
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from fitting.model.session_model import START_PHASE_RAD
from fitting.model.trial_model import TrialModel, trajectories_together
from fitting.trial import MeasuredTrial
from session import Flag, NotEnoughData
from swimmer import PUBLISHED_COEFFICIENTS, Twin
from swimmer.fluid import COEFFICIENT_BOUNDS

if TYPE_CHECKING:
    from fitting.calibration import CalibratedTrial

_TRIED = (0.02, 0.05, 0.1, 0.2, 0.4)  # shares of every coefficient's range, tried after the published ones
FAR = "far_from_twin"
"""The flag of a trial that its own twin does not follow: it keeps a diagnosis from naming an effect."""
MISSED = "speed_missed"
"""The flag of a fit trial whose speed the fitted twin misses."""
MISSED_BY = 0.05  # least relative speed error of such a trial
_BEYOND = 3.0  # largest ratio to the fastest or slowest fitted beat
_OTHER_WAY_M_S = 0.005  # least speed difference of a twin that swims the other way
# A trial is far from its twin if the speeds differ by more than both of these, relative and absolute.
_SLOW = 0.3
_SLOW_M_S = 0.02
_OFF_M = 0.1  # mean marker error from which it is another swim: a sixth of the published fish
# A trial is also far if its marker error exceeds the median of the others by this factor and this distance.
_WORSE = 4.0
_WORSE_M = 0.03


def left_out_flags(left_out: Mapping[str, str]) -> tuple[Flag, ...]:
    """Flag the trials that are left out, by name and why."""
    return tuple(Flag("left_out", message=f"{name} is left out: {why}") for name, why in left_out.items())


def followed(trials: Sequence[MeasuredTrial], twin: Twin) -> tuple[list[MeasuredTrial], dict[str, str]]:
    """Separate the fit trials that some twin can swim from the others.

    Args:
        trials: the fit trials.
        twin: the twin.

    Returns:
        The former, and the others by name and why.

    Raises:
        NotEnoughData: no twin can swim any of them.
    """
    models = [TrialModel(twin, trial, START_PHASE_RAD) for trial in trials]
    points = np.vstack([PUBLISHED_COEFFICIENTS, *(np.full(5, share * COEFFICIENT_BOUNDS[1]) for share in _TRIED)])
    swum = trajectories_together(models, points)
    stands = [bool(np.isfinite(each.marker_m).all(axis=(1, 2, 3)).any()) for each in swum]
    good = [trial for trial, stands_up in zip(trials, stands, strict=True) if stands_up]
    why = {t.name: diverges(t.frequency.hz) for t, stands_up in zip(trials, stands, strict=True) if not stands_up}
    if not good:
        raise NotEnoughData("\n".join(f"trial {name}: {reason}" for name, reason in why.items()))
    return good, why


def beyond(hz: float, fitted_hz: tuple[float, float]) -> str:
    """Say that a held-out trial beats far outside the fitted frequencies; an empty text where it does not.

    This is known before anything is compared, so that no score decides what is scored.

    Args:
        hz: beats a second.
        fitted_hz: lowest and highest frequency of the fit trials.
    """
    low, high = fitted_hz
    if low / _BEYOND <= hz <= high * _BEYOND:
        return ""
    return (
        f"it beats at {hz:.3g} Hz, more than {_BEYOND:g} times beyond the fitted {low:.3g} to {high:.3g} Hz: these say "
        "nothing of it. Fit a trial nearer to it"
    )


def diverges(hz: float) -> str:
    """Say that the twin cannot be simulated at this frequency."""
    return f"its simulation diverges at {hz:.3g} Hz: the tendons' springs and this time step do not stand such a beat"


def suspicion(trial: "CalibratedTrial", fellows_m: Sequence[float]) -> tuple[Flag, ...]:
    """Flag a trial whose own twin is far from it.

    Args:
        trial: the trial and the calibrated twin.
        fellows_m: marker errors of all other trials, m.
    """
    flags, measured, twin = [], trial.measured.speed, trial.speed_twin
    off, error_m, mm = abs(twin - measured), trial.scores.marker_error_m, 1000.0
    speeds = f"it swims at {mm * measured:.0f} mm/s, its twin at {mm * twin:.0f}"
    usual_m = float(np.median(fellows_m)) if len(fellows_m) else np.nan
    if measured * twin < 0 and off > _OTHER_WAY_M_S:
        flags.append(Flag(FAR, message=f"{trial.measured.name}: {speeds}, the other way"))
    elif off > max(_SLOW * abs(measured), _SLOW_M_S):
        flags.append(Flag(FAR, message=f"{trial.measured.name}: {speeds}"))
    elif error_m > _OFF_M:
        message = f"{trial.measured.name}: markers of its twin are {mm * error_m:.0f} mm off in the mean"
        flags.append(Flag(FAR, message=message))
    elif error_m > _WORSE * usual_m and error_m > usual_m + _WORSE_M:
        message = (
            f"{trial.measured.name}: markers of its twin are {mm * error_m:.0f} mm off in the mean, in other trials "
            f"{mm * usual_m:.0f}"
        )
        flags.append(Flag(FAR, message=message))
    if trial.measured.role == "fit" and off > MISSED_BY * abs(measured):
        message = f"the twin misses the speed it was fitted to by {100 * (twin / measured - 1):+.0f} %: {speeds}"
        flags.append(Flag(MISSED, message=message))
    return tuple(flags)
