"""When a crank fit is not to be believed, in words."""

from collections.abc import Iterator, Sequence

import numpy as np

from fitting.dry_run.crank import CrankTrial
from fitting.dry_run.joint import JointFit
from fitting.dry_run.response import DryResponse
from fitting.dry_run.tendons import PUBLISHED_STRETCH
from fitting.trial import SCALE_OFF, SCORED_S
from session import Flag

FEWEST_TURNS = 2.0
SLACK_SHARE = 0.9  # of the turn and the tendons; those of the built-in robot are slack for 0.78 to 0.85 of it
STRETCH_OFF = 0.01  # above the published stretch; the built-in robot stays below it, at 0.0001
POOR_MOTION = 0.1  # of the sideways motion of the last marker, root mean square
ARM_POOR = 0.05  # standard error over arm, or spread between trials, that leaves the arm open
_EDGE = 0.02  # of a range: an estimate this close to its end is at its end


def trial_flags(found: CrankTrial, smooth_m: tuple[float, float]) -> Iterator[Flag]:
    """The flags of one trial's speed, phase and distance.

    Args:
        found: the trial and the twin.
        smooth_m: smallest and largest arm over which the motion is smooth, m.
    """
    run, hz, arm_m = found.measured, found.surface.hz, found.published.arm_m
    seconds, scored_s = float(np.ptp(run.time_s)), float(np.ptp(run.time_s[run.scored]))
    turns = seconds * found.speed_hz
    if turns < FEWEST_TURNS or scored_s <= 0.95 * SCORED_S:
        message = (
            f"only {seconds:.1f} s, {turns:.1f} turns of the crank, after the warm-up; the published distance asks for "
            f"{SCORED_S:g} s, and fewer than {FEWEST_TURNS:g} turns separate speed from phase poorly"
        )
        yield Flag("too_short", message=message)
    if not _inside(found.speed_hz, hz[0], hz[-1]):
        message = f"the speed, {found.speed_hz:.3f} Hz, sits at the edge of the grid, {hz[0]:.3f} to {hz[-1]:.3f} Hz"
        yield Flag("at_bound", message=message)
    if not _inside(arm_m, *smooth_m):
        smoothly = f"{1000 * smooth_m[0]:.1f} to {1000 * smooth_m[1]:.1f} mm"
        message = (
            f"the lowest published distance of this run alone is at {1000 * arm_m:.1f} mm, at or beyond the "
            f"end of the arms with which the tail moves smoothly, {smoothly}"
        )
        yield Flag("at_bound", message=message)
    yield from _of_motion(found)


def _of_motion(found: CrankTrial) -> Iterator[Flag]:
    """Doubts about the tail's motion, the scale and the tendons."""
    swing = found.measured.frequency.amplitude_m / np.sqrt(2)
    if found.motion_error_m > POOR_MOTION * swing:
        message = (
            f"whatever its crank, the twin's tail moves otherwise than the measured one: "
            f"{1000 * found.motion_error_m:.1f} mm apart (root mean square), where the last marker moves by "
            f"{1000 * swing:.0f} mm; arm and standard error may be off"
        )
        yield Flag("poor_fit", message=message)
    if abs(found.scale - 1) > SCALE_OFF:
        message = (
            f"all markers together give a scale {100 * (found.scale - 1):+.0f} % off that of nose and neck: a box "
            "off its marker, parallax, or a robot that differs from its description"
        )
        yield Flag("scale_off_robot", message=message)
    if found.tendons.slack_share > SLACK_SHARE:
        message = (
            f"for {100 * found.tendons.slack_share:.0f} % of the turn a tendon is shorter than at rest, by up to "
            f"{100 * found.tendons.shortening:.1f} %: a string would be slack there, the twin's springs push"
        )
        yield Flag("tendon_pushes", message=message)
    if found.tendons.stretch - PUBLISHED_STRETCH > STRETCH_OFF:
        message = (
            f"the twin's tendons stretch by up to {100 * found.tendons.stretch:.1f} %, published are about "
            f"{100 * PUBLISHED_STRETCH:.0f} %"
        )
        yield Flag("tendon_stretch", message=message)


def fit_flags(joint: JointFit, response: DryResponse, arm_per_trial_m: Sequence[float]) -> Iterator[Flag]:
    """The flags of the arm."""
    low, high = response.range_of(joint.branch)
    if not _inside(joint.arm_m, low, high):
        snaps = joint.arm_m > (low + high) / 2 and high < response.arm_m[-1]
        why = "; with a longer one the twin's tail snaps over" if snaps else ", the edge of the grid"
        yield Flag("at_bound", message=f"the arm, {1000 * joint.arm_m:.2f} mm, is at the end of its range{why}")
    if joint.arm_se_m > ARM_POOR * joint.arm_m:
        error = f"{1000 * joint.arm_se_m:.1f} mm (standard error)"
        yield Flag("unidentifiable", message=f"the arm is only known to {error}: the runs do not determine it")
    if max(arm_per_trial_m) - min(arm_per_trial_m) > ARM_POOR * float(np.mean(arm_per_trial_m)):
        arms = ", ".join(f"{1000 * arm:.1f}" for arm in arm_per_trial_m)
        message = f"taken alone, with nose and neck as marked, the runs give arms of {arms} mm: rely on the joint fit"
        yield Flag("trials_disagree", message=message)


def _inside(value: float, low: float, high: float) -> bool:
    """Whether an estimate is clear of both ends of its range."""
    return bool(low + _EDGE * (high - low) < value < high - _EDGE * (high - low))
