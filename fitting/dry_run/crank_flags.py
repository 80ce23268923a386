"""When a crank fit is not to be believed, in words."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from fitting.dry_run.error_surface import Cell, ErrorSurface
from fitting.dry_run.joint import JointFit, JointTrial
from fitting.dry_run.measured import DryTrial
from fitting.dry_run.response import DryResponse
from fitting.dry_run.tendons import PUBLISHED_STRETCH, TendonUse
from fitting.trial import SCALE_OFF, SCORED_S
from session import Flag

FEWEST_TURNS = 2.0
SLACK_SHARE = 0.9  # of the turn and the tendons; those of the built-in robot are slack for 0.78 to 0.85 of it
STRETCH_OFF = 0.01  # above the published stretch; the built-in robot stays below it, at 0.0001
POOR_MOTION = 0.1  # of the sideways motion of the last marker, root mean square
TABLE_ERROR_M = 2e-4  # between a motion read off the table and simulated; beyond, the grid of arms is too coarse
ARM_POOR = 0.05  # standard error over arm, or spread between trials, that leaves the arm open
_EDGE = 0.02  # of a range: an estimate this close to its end is at its end


class Found(NamedTuple):
    """What is known of a trial when it is judged."""

    trial: DryTrial
    own: JointTrial
    surface: ErrorSurface
    best: Cell
    other: Cell | None
    tendons: TendonUse
    shortcut_error_m: float


def trial_flags(found: Found, smooth_m: tuple[float, float]) -> tuple[Flag, ...]:
    """The doubts about one trial's speed, phase and distance; `smooth_m`: the arms over which the motion is smooth."""
    edges = (_speed_edge(found), _published_edge(found, smooth_m))
    misfit = (_motion(found), _scale(found), _table(found))
    doubts = (_short(found), *edges, _second_valley(found), *misfit, *_tendons(found.tendons))
    return tuple(flag for flag in doubts if flag is not None)


def fit_flags(joint: JointFit, response: DryResponse, arm_per_trial_m: Sequence[float]) -> tuple[Flag, ...]:
    """The doubts about the arm."""
    doubts = (_arm_edge(joint, response), _arm_open(joint), _arms_disagree(arm_per_trial_m))
    return tuple(flag for flag in doubts if flag is not None)


def _short(found: Found) -> Flag | None:
    seconds = float(np.ptp(found.trial.time_s))
    turns, scored = seconds * found.own.hz, float(np.ptp(found.trial.time_s[found.trial.scored]))
    if turns >= FEWEST_TURNS and scored > 0.95 * SCORED_S:
        return None
    message = (
        f"only {seconds:.1f} s, {turns:.1f} turns of the crank, after the warm-up; the published distance asks for "
        f"{SCORED_S:g} s, and fewer than {FEWEST_TURNS:g} turns tell speed from phase poorly"
    )
    return Flag("too_short", message=message)


def _speed_edge(found: Found) -> Flag | None:
    low, high = found.surface.hz[0], found.surface.hz[-1]
    if low + _EDGE * (high - low) < found.own.hz < high - _EDGE * (high - low):
        return None
    message = f"the speed, {found.own.hz:.3f} Hz, sits at the edge of the grid, {low:.3f} to {high:.3f} Hz"
    return Flag("at_bound", message=message)


def _published_edge(found: Found, smooth_m: tuple[float, float]) -> Flag | None:
    low, high = smooth_m
    margin = _EDGE * (high - low)
    if low + margin < found.best.arm_m < high - margin:
        return None
    message = (
        f"the lowest published distance of this run alone lies at {1000 * found.best.arm_m:.1f} mm, at or beyond the "
        f"end of the arms with which the tail moves smoothly, {1000 * low:.1f} to {1000 * high:.1f} mm"
    )
    return Flag("at_bound", message=message)


def _second_valley(found: Found) -> Flag | None:
    other = found.other
    if other is None:
        return None
    message = (
        f"a second valley is as deep: an arm of {1000 * other.arm_m:.1f} mm at {other.hz:.3f} Hz and "
        f"{np.degrees(other.phase_rad):.0f}° is {1000 * other.distance_m:.1f} mm away from the tracks too"
    )
    return Flag("ambiguous", message=message)


def _scale(found: Found) -> Flag | None:
    off = found.own.scale - 1
    if abs(off) <= SCALE_OFF:
        return None
    message = (
        f"all markers together give a scale {100 * off:+.0f} % off that of nose and neck: a box beside its marker, "
        "parallax, or a robot unlike its description"
    )
    return Flag("scale_off_robot", message=message)


def _motion(found: Found) -> Flag | None:
    swing = found.trial.frequency.amplitude_m / np.sqrt(2)
    if found.own.motion_error_m <= POOR_MOTION * swing:
        return None
    apart = 1000 * found.own.motion_error_m
    message = (
        f"whatever its crank, the twin's tail moves otherwise than the measured one: {apart:.1f} mm apart (root mean "
        f"square), where the last marker moves by {1000 * swing:.0f} mm; arm and standard error may be off"
    )
    return Flag("poor_fit", message=message)


def _tendons(use: TendonUse) -> tuple[Flag | None, Flag | None]:
    slack = off = None
    if use.slack_share > SLACK_SHARE:
        message = (
            f"for {100 * use.slack_share:.0f} % of the turn a tendon is shorter than at rest, by up to "
            f"{100 * use.shortening:.1f} %: a string would hang slack there, the twin's springs push"
        )
        slack = Flag("tendon_slack", message=message)
    if use.stretch - PUBLISHED_STRETCH > STRETCH_OFF:
        message = (
            f"the twin's tendons stretch by up to {100 * use.stretch:.1f} %, published are about "
            f"{100 * PUBLISHED_STRETCH:.0f} %"
        )
        off = Flag("tendon_stretch", message=message)
    return slack, off


def _table(found: Found) -> Flag | None:
    if found.shortcut_error_m <= TABLE_ERROR_M:
        return None
    message = (
        f"a motion read off the table is {1000 * found.shortcut_error_m:.1f} mm away from a simulation at the fitted "
        "arm and speed: simulate more arms"
    )
    return Flag("coarse_table", message=message)


def _arm_edge(joint: JointFit, response: DryResponse) -> Flag | None:
    low, high = response.range_of(joint.branch)
    margin = _EDGE * (high - low)
    if low + margin < joint.arm_m < high - margin:
        return None
    snaps = joint.arm_m >= high - margin and high < response.arm_m[-1]
    why = "; with a longer one the twin's tail snaps over" if snaps else ", the edge of the grid"
    return Flag("at_bound", message=f"the arm, {1000 * joint.arm_m:.2f} mm, is at the end of its range{why}")


def _arm_open(joint: JointFit) -> Flag | None:
    if joint.arm_se_m <= ARM_POOR * joint.arm_m:
        return None
    message = f"the arm is only known to {1000 * joint.arm_se_m:.1f} mm (standard error): the runs do not determine it"
    return Flag("unidentifiable", message=message)


def _arms_disagree(arm_per_trial_m: Sequence[float]) -> Flag | None:
    spread = max(arm_per_trial_m) - min(arm_per_trial_m)
    if spread <= ARM_POOR * float(np.mean(arm_per_trial_m)):
        return None
    arms = ", ".join(f"{1000 * arm:.1f}" for arm in arm_per_trial_m)
    message = f"taken alone, with nose and neck as marked, the runs give arms of {arms} mm: rely on the joint fit"
    return Flag("trials_disagree", message=message)
