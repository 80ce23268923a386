"""Fit of a robot's crank arm to its dry runs, with the speed and phase of every run.

`crank_response` simulates the tail over the arms and speeds that the runs ask for. `fit_crank` then does the published
search for each run alone, and fits one arm to all runs together from where these end (`fitting.crank_surface`).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from threadpoolctl import threadpool_limits

from fitting.crank_surface import (
    ARM_SPAN,
    Cell,
    CrankGrid,
    ErrorSurface,
    JointFit,
    distance_at,
    error_surface,
    fit_joint,
    lowest_point,
    speed_range,
)
from fitting.dry_run import PUBLISHED_STRETCH, DryResponse, DryTrial, TendonUse, simulate_response, tendon_use, with_arm
from fitting.trial import SCORED_S
from fitting.trial_checks import SCALE_OFF
from swimcal.errors import NotEnoughData
from swimcal.flags import Flag
from swimcal.robot import RobotSpec

FEWEST_TURNS = 2.0  # least turns in which speed and phase are told apart
SLACK_SHARE = 0.9  # largest slack share of the turn; tendons of the built-in robot are slack for 0.78 to 0.85
STRETCH_OFF = 0.01  # largest excess over the published stretch; the built-in robot has 0.0001
POOR_MOTION = 0.1  # largest error relative to the last marker's sideways motion, root mean square
ARM_POOR = 0.05  # standard error over arm, or spread between trials, that leaves the arm open
_EDGE = 0.02  # an estimate within this share of a range from its end is at its end
PUBLISHED_GRID = CrankGrid()
_GLANCE = CrankGrid(speeds=21, phases=20)  # enough to start a joint fit from
_WIDENINGS = 2  # how often the grid of arms may be widened


@dataclass(frozen=True, eq=False)
class CrankTrial:
    """One dry run and the twin with the fitted arm.

    Attributes:
        measured: the run.
        speed_hz, speed_se_hz: turns of the crank a second, with its standard error.
        phase_rad, phase_se_rad: crank angle at time 0, from 0 to 2 pi, with its standard error.
        marker_error_m: published distance of the twin with the joint arm and this speed and phase, m.
        scale: scale of the picture by all markers, over that of the measured nose-neck distance.
        motion_error_m: root mean square distance of the markers' motions about their means in the joint fit, m.
        published: this run's own lowest published distance.
        surface: the published distance on the grid.
        tendons: use of the twin's tendons at the fitted arm and speed.
        flags: what is doubtful about the run.
    """

    measured: DryTrial
    speed_hz: float
    speed_se_hz: float
    phase_rad: float
    phase_se_rad: float
    marker_error_m: float
    scale: float
    motion_error_m: float
    published: Cell
    surface: ErrorSurface
    tendons: TendonUse
    flags: tuple[Flag, ...]

    @property
    def name(self) -> str:
        """Name of the trial in the session."""
        return self.measured.name


@dataclass(frozen=True, eq=False)
class CrankFit:
    """Fit of a robot's crank.

    Attributes:
        arm_m, arm_se_m: crank arm of the joint fit of all runs, and its standard error, m.
        smooth_m: smallest and largest arm around it over which the tail moves smoothly; the arm is within, m.
        trials: the runs.
        flags: what is doubtful about the arm.
    """

    arm_m: float
    arm_se_m: float
    smooth_m: tuple[float, float]
    trials: tuple[CrankTrial, ...]
    flags: tuple[Flag, ...]

    @property
    def arm_per_trial_m(self) -> tuple[float, ...]:
        """Arm of each run by its own published distance, m."""
        return tuple(trial.published.arm_m for trial in self.trials)

    @property
    def arm_published_m(self) -> float:
        """Published estimate of the arm: the mean over the runs, m."""
        return float(np.mean(self.arm_per_trial_m))


def crank_response(
    trials: Sequence[DryTrial], robot: RobotSpec, grid: CrankGrid = PUBLISHED_GRID, workers: int = 0
) -> DryResponse:
    """Simulate what `fit_crank` needs: the grid's arms about that of the robot, at the speeds of these trials.

    Where the trials ask for an arm beyond the grid, it is widened by as much again, twice at most.

    Args:
        trials: the dry runs.
        robot: the robot whose arm is sought.
        grid: grid of the published search.
        workers: threads; 0 for all cores.

    Raises:
        NotEnoughData: no smooth motion of the tail over four neighbouring arms.
    """
    own = robot.crank.arm_m
    step = 2 * ARM_SPAN * own / (grid.arms - 1)
    arms = _on_the_crank((1 - ARM_SPAN) * own + step * np.arange(grid.arms), robot)
    simulate = partial(simulate_response, robot, tuple(robot.markers), range_hz=speed_range(trials), workers=workers)
    response = simulate(arm_m=arms)
    for _ in range(_WIDENINGS):
        beyond = step * np.arange(1, grid.arms // 2 + 1)
        side = _asked_beyond(trials, response, workers)
        more = response.arm_m[-1] + beyond if side > 0 else response.arm_m[0] - beyond[::-1]
        arms = _on_the_crank(more, robot)
        if not side or not len(arms):
            break
        response = simulate(arm_m=np.sort(np.concatenate([response.arm_m, arms])))
    return response


def _on_the_crank(arm_m: np.ndarray, robot: RobotSpec) -> np.ndarray:
    """Return those of the arms that are long enough to hold the anchors."""
    return arm_m[arm_m > 1.05 * robot.crank.anchor_inset_m]


def _asked_beyond(trials: Sequence[DryTrial], response: DryResponse, workers: int) -> int:
    """Return -1 if the trials ask for an arm below those simulated, 1 above, 0 within; beyond a snap there is none."""
    low, high = response.arm_m[[0, -1]]
    with threadpool_limits(1, user_api="blas"):
        starts = [error_surface(trial, response, _GLANCE, workers).valleys(1)[0] for trial in trials]
        arm_m = fit_joint(trials, response, starts).arm_m
    margin = (high - low) / len(response.arm_m)
    return int(arm_m > high - margin) - int(arm_m < low + margin)


def fit_crank(
    trials: Sequence[DryTrial],
    robot: RobotSpec,
    response: DryResponse,
    grid: CrankGrid = PUBLISHED_GRID,
    workers: int = 0,
) -> CrankFit:
    """Find the crank arm of a robot from its dry runs.

    Args:
        trials: the runs, from `measure_dry_run`.
        robot: the robot whose arm is sought.
        response: its response to these trials or more of them (`crank_response`).
        grid: grid of the published search, for each trial.
        workers: threads; 0 for all cores.

    Raises:
        NotEnoughData: no trial.
        SimulationDiverged: the fitted motion does not stay bounded.
    """
    if not trials:
        raise NotEnoughData('no dry run: the crank needs at least one trial with kind = "dry"')
    with threadpool_limits(1, user_api="blas"):  # small matrices, for which threads only wait
        surfaces = [error_surface(trial, response, grid, workers) for trial in trials]
        lowest = [lowest_point(t, response, surface) for t, surface in zip(trials, surfaces, strict=True)]
        joint = fit_joint(trials, response, lowest)
        return _assemble(trials, with_arm(robot, joint.arm_m), response, surfaces, lowest, joint, workers)


def _assemble(
    trials: Sequence[DryTrial],
    robot: RobotSpec,
    response: DryResponse,
    surfaces: list[ErrorSurface],
    lowest: list[Cell],
    joint: JointFit,
    workers: int,
) -> CrankFit:
    hz = np.array([trial.hz for trial in joint.trials])
    uses = tendon_use(robot, hz, workers)
    smooth = response.range_of(joint.branch)
    found = []
    for i, (trial, own) in enumerate(zip(trials, joint.trials, strict=True)):
        turn = response.turn(joint.arm_m, own.hz, joint.branch)
        one = CrankTrial(
            measured=trial,
            speed_hz=own.hz,
            speed_se_hz=own.hz_se,
            phase_rad=turn.crank_rad(own.phase_rad),
            phase_se_rad=own.phase_se_rad,
            marker_error_m=distance_at(trial, response.select(trial.markers), joint.arm_m, own.hz, own.phase_rad),
            scale=own.scale,
            motion_error_m=own.motion_error_m,
            published=lowest[i],
            surface=surfaces[i],
            tendons=uses[i],
            flags=trial.flags,
        )
        flags = trial_flags(one, smooth)
        found.append(replace(one, flags=(*trial.flags, *flags)))
    alone_m = [fit_joint([trial], response, [cell]).arm_m for trial, cell in zip(trials, lowest, strict=True)]
    flags = fit_flags(joint, response, alone_m)
    return CrankFit(joint.arm_m, joint.arm_se_m, smooth, tuple(found), tuple(flags))


def trial_flags(found: CrankTrial, smooth_m: tuple[float, float]) -> Iterator[Flag]:
    """Return the flags of one trial's speed, phase and distance.

    Args:
        found: the trial.
        smooth_m: smallest and largest arm over which the tail moves smoothly, m.
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
            f"the published distance of this run alone is lowest at an arm of {1000 * arm_m:.1f} mm, not inside the "
            f"range with which the tail moves smoothly, {smoothly}"
        )
        yield Flag("at_bound", message=message)
    yield from _of_motion(found)


def fit_flags(joint: JointFit, response: DryResponse, arm_per_trial_m: Sequence[float]) -> Iterator[Flag]:
    """Flag an arm at the end of its range, one that is poorly known, and runs that disagree.

    Args:
        joint: the fit of all runs.
        response: the simulated motion of the tail.
        arm_per_trial_m: arm of each run alone, by the same fit.
    """
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
        message = f"each run alone gives another arm: {arms} mm; the one reported is a compromise"
        yield Flag("trials_disagree", message=message)


def _of_motion(found: CrankTrial) -> Iterator[Flag]:
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


def _inside(value: float, low: float, high: float) -> bool:
    return bool(low + _EDGE * (high - low) < value < high - _EDGE * (high - low))
