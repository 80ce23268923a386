"""Trials and markers that a fit leaves out, or should not trust, and why.

One unusable trial never stops the others: it is left out, and a flag says why (`left_out_flags`). Before a fit
`followed_trials`, `extrapolation_reason` and `divergence_reason` tell which trials take no part; after it
`far_from_twin_flags` flags a trial that its own twin does not follow, and `far_reason` says why of any twin.

`carried_swims` flags a swim that slips aside as no other does: a camera that moves, or water. `odd_markers` flags
markers that sit elsewhere in one swim than in the others: a box on a wrong spot, a marker that slipped. No description
places a marker to better than some centimetres on a robot as built, and what is off in every swim is the posterior's to
tell (`markers_off` there). One swim against the others shows what is wrong with that swim.
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from scipy.stats import median_abs_deviation

from fitting.trial import MeasuredTrial
from fitting.trial_model import TrialModel, trajectories_together
from swimcal.errors import NotEnoughData
from swimcal.flags import Flag
from swimcal.mjcf import COEFFICIENT_BOUNDS, PUBLISHED_COEFFICIENTS
from swimcal.robot import RobotSpec
from swimcal.session_file import HEAD_MARKERS
from swimcal.twin import Twin
from tracking.body_model import FREE_PX2, JointGaussian, fit_body_model, layout_model

if TYPE_CHECKING:
    from fitting.calibration import CalibratedTrial

# Trials that are left out, or far from their twin
_TRIED = (0.02, 0.05, 0.1, 0.2, 0.4)  # shares of every coefficient's range, tried after the published ones
FAR = "far_from_twin"
"""The flag of a trial that its own twin does not follow: it keeps a diagnosis from naming an effect."""
MISSED = "speed_missed"
"""The flag of a fit trial whose speed the fitted twin misses."""
MISSED_BY = 0.05  # least relative speed error of such a trial
_BEYOND = 3.0  # largest ratio to the fastest or slowest fitted beat
STILL_M_S = 0.005  # a robot that is slower does not swim
_OTHER_WAY_M_S = 0.005  # least speed difference of a twin that swims the other way
# A trial is far from its twin if the speeds differ by more than both of these, relative and absolute.
_SLOW = 0.3
_SLOW_M_S = 0.02
_OFF_M = 0.1  # mean marker error from which it is another swim: a sixth of the published fish
# A trial is also far if its marker error exceeds the median of the others by this factor and this distance.
_WORSE = 4.0
_WORSE_M = 0.03

# Carried swims
_SLIPS_M_S = 0.03
"""Least sideways speed of a carried swim, beside the median of the others …"""
_SLIPS_BEYOND = 3.0
"""… and beyond so many times their scatter: the public trials slip by 20 mm/s to either side."""
_SLIPS_RAD = 0.15
"""Least angle between course and heading by which such a swim differs."""

# Odd markers
MARKERS_OFF = "markers_off"
"""The flag of a swim one of whose markers sits elsewhere than in the others."""
LEAST_M = 0.022
"""A flagged marker sits at least so far from its place in the other swims: the public trials reach 20 mm."""
LEAST = 1.75
"""A flagged marker is off by at least so many standard deviations: the public trials reach 1.9."""
BEYOND_OTHERS = 2.5
"""Nose and neck must also be off by this many times the scatter of the other swims to be flagged.

They set the scale, and in the public trials their places scatter by 30 mm.
"""
_FEWEST = 3  # least number of swims: of two nobody knows which is the odd one
_STIFF = 0.15  # the mean shape of a beat bends by this share of what a shape in one frame does
_SLIP = 0.06  # standard deviation of a marker's place, relative to the distance from nose to neck


# Trials.


def left_out_flags(left_out: Mapping[str, str]) -> tuple[Flag, ...]:
    """Flag the trials that are left out, by name and why."""
    return tuple(Flag("left_out", message=f"{name} is left out: {why}") for name, why in left_out.items())


def followed_trials(trials: Sequence[MeasuredTrial], twin: Twin) -> tuple[list[MeasuredTrial], dict[str, str]]:
    """Separate the fit trials that some twin can swim from the others.

    Args:
        trials: the fit trials.
        twin: the twin.

    Returns:
        The former, and the others by name and why.

    Raises:
        NotEnoughData: no twin can swim any of them.
    """
    models = [TrialModel.of(twin, trial) for trial in trials]
    points = np.vstack([PUBLISHED_COEFFICIENTS, *(np.full(5, share * COEFFICIENT_BOUNDS[1]) for share in _TRIED)])
    swum = trajectories_together(models, points)
    stands = [bool(np.isfinite(each.marker_m).all(axis=(1, 2, 3)).any()) for each in swum]
    good = [trial for trial, stands_up in zip(trials, stands, strict=True) if stands_up]
    why = {
        t.name: divergence_reason(t.frequency.hz) for t, stands_up in zip(trials, stands, strict=True) if not stands_up
    }
    if not good:
        raise NotEnoughData("\n".join(f"trial {name}: {reason}" for name, reason in why.items()))
    return good, why


def extrapolation_reason(hz: float, fitted_hz: tuple[float, float]) -> str:
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


def divergence_reason(hz: float) -> str:
    """Say that the twin cannot be simulated at this frequency."""
    return f"its simulation diverges at {hz:.3g} Hz: such a beat wants a shorter time_step_s in the robot's file"


def far_from_twin_flags(trial: "CalibratedTrial", fellows_m: Sequence[float]) -> tuple[Flag, ...]:
    """Flag a trial whose own twin is far from it.

    Args:
        trial: the trial and the calibrated twin.
        fellows_m: `Scores.launch_free_error_m` of all other trials.
    """
    flags, measured, twin = [], trial.measured.speed, trial.speed_twin
    off = abs(twin - measured)
    if reason := far_reason(measured, twin, trial.scores.launch_free_error_m, fellows_m):
        flags.append(Flag(FAR, message=reason))
    if trial.measured.role == "fit" and off > MISSED_BY * abs(measured):
        percent = 100 * (twin / measured - 1)
        message = f"the twin misses the speed it was fitted to by {percent:+.0f} %: {_speeds(measured, twin)}"
        flags.append(Flag(MISSED, message=message))
    return tuple(flags)


def far_reason(measured_m_s: float, twin_m_s: float, error_m: float, fellows_m: Sequence[float]) -> str:
    """Say how far a twin is from its trial, or nothing where it follows it.

    Args:
        measured_m_s: forward speed of the trial, m/s.
        twin_m_s: forward speed of the twin, m/s.
        error_m: `Scores.launch_free_error_m` of this trial.
        fellows_m: the same of all other trials.
    """
    off, mm, speeds = abs(twin_m_s - measured_m_s), 1000.0, _speeds(measured_m_s, twin_m_s)
    usual_m = float(np.median(fellows_m)) if len(fellows_m) else np.nan
    if measured_m_s * twin_m_s < 0 and off > _OTHER_WAY_M_S:
        return f"{speeds}, the other way"
    if off > max(_SLOW * abs(measured_m_s), _SLOW_M_S):
        return speeds
    off_mm = f"without its slip and turn the markers of its twin are {mm * error_m:.0f} mm off"
    if error_m > _OFF_M:
        return f"{off_mm} in the mean"
    if error_m > _WORSE * usual_m and error_m > usual_m + _WORSE_M:
        return f"{off_mm} in the mean, in other trials {mm * usual_m:.0f}"
    return ""


def _speeds(measured_m_s: float, twin_m_s: float) -> str:
    mm_s = round(1000 * measured_m_s)  # a whole number has no -0
    still = "" if abs(measured_m_s) > STILL_M_S else "; if its head is clamped in air, it is a dry run"
    return f"it swims at {mm_s} mm/s, its twin at {round(1000 * twin_m_s)}{still}"


def carried_swims(trials: Sequence[MeasuredTrial]) -> dict[str, Flag]:
    """Flag each swim, by its name, that slips aside as none of the others does.

    What carries it aside may carry it along, too. A slip that all share is the robot's own.

    Args:
        trials: the swims.
    """
    known = [trial for trial in trials if np.isfinite(trial.speed) and trial.kept.any()]
    if len(known) < _FEWEST:
        return {}
    slips = np.array([_sideways_speed(trial) for trial in known])  # m/s
    found = {}
    for place, trial in enumerate(known):
        others = np.delete(slips, place)
        usual = float(np.median(others))
        scatter = float(median_abs_deviation(others, scale="normal"))
        off = abs(slips[place] - usual)
        if off > _SLIPS_M_S + _SLIPS_BEYOND * scatter and off > _SLIPS_RAD * abs(trial.speed):
            message = (
                f"it slips aside by {1000 * off:.0f} mm/s unlike the other swims: did the camera move, or water carry "
                "it? Then its speed is off, too. The trial counts as it is"
            )
            found[trial.name] = Flag("carried", message=message)
    return found


def _sideways_speed(trial: MeasuredTrial) -> float:
    """Return how fast a swim slips to its right over the kept frames, m/s."""
    return float(np.polyfit(trial.time_s[trial.kept], trial.head.path_m[trial.kept, 1], 1)[0])


# Markers.


def odd_markers(trials: Sequence[MeasuredTrial], robot: RobotSpec) -> dict[str, Flag]:
    """Flag each swim, by its name, one of whose markers sits elsewhere than in the other swims.

    Args:
        trials: the swims.
        robot: the robot.
    """
    if len(trials) < _FEWEST:
        return {}
    markers = trials[0].markers
    root_x_m = max(marker.position_m[0] for marker in robot.markers.values() if marker.body == "head")
    layout = layout_model(robot.marker_positions_m(markers), root_x_m, 1.0, robot.scale_length_m)  # px of 1 m
    # The differences of two swims' mean shapes from the described one are free in place, heading and size.
    slips = (_SLIP * robot.scale_length_m) ** 2 * np.eye(2 * len(markers))
    gauge = JointGaussian(_STIFF**2 * layout.covariance_px2 + slips + FREE_PX2 * layout.moves @ layout.moves.T)
    shapes = [fit_body_model(layout, trial.position_m, trial.weight > 0).mean_px for trial in trials]  # (2 m,) each, m
    everyone = np.ones(len(markers), bool)
    apart = [gauge.leave_one_out(shape, everyone) for shape in shapes]
    offsets, spread = np.array([each for each, _ in apart]), apart[0][1]  # (t, m, 2), (m,) m
    of_head = np.isin(markers, HEAD_MARKERS)
    found = {}
    for place, trial in enumerate(trials):
        others = np.delete(offsets, place, axis=0)
        usual = np.median(others, axis=0)  # (m, 2)
        off_m = np.linalg.norm(offsets[place] - usual, axis=1)
        scatter_m = of_head * np.linalg.norm(others - usual, axis=2).max(axis=0)
        least_m = np.maximum(np.maximum(LEAST_M, LEAST * spread), BEYOND_OTHERS * scatter_m)  # (m,)
        worst = int(np.argmax(off_m / spread))
        farther = np.linalg.norm(offsets[place, worst]) > np.linalg.norm(usual[worst])  # farther than described
        if off_m[worst] > least_m[worst] and farther:
            found[trial.name] = _flag(trial, markers[worst], off_m[worst])
    return found


def _flag(trial: MeasuredTrial, marker: str, off_m: float) -> Flag:
    message = (
        f"{marker} sits {1000 * off_m:.0f} mm from its place in the other swims, in the whole of {trial.name}: is its "
        "box on the marker, did it slip? The trial counts as it is"
    )
    first = trial.first_frame
    return Flag(MARKERS_OFF, (marker,), (first, first + len(trial.time_s) - 1), message)
