"""The crank arm, and the speed and phase of every dry run: the published search, then one fit of all runs together."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from threadpoolctl import threadpool_limits

from fitting.dry_run.crank_flags import Found, fit_flags, trial_flags
from fitting.dry_run.error_surface import ARM_SPAN, Cell, CrankGrid, ErrorSurface, error_surface, speed_range
from fitting.dry_run.joint import JointFit, fit_joint
from fitting.dry_run.measured import DryTrial
from fitting.dry_run.published import distance_at, other_valley, refine_valleys
from fitting.dry_run.response import DryResponse, Turn, simulate_response, simulate_turns, with_arm
from fitting.dry_run.tendons import TendonUse, tendon_use
from session import Flag, NotEnoughData
from swimmer import RobotSpec

PUBLISHED_GRID = CrankGrid()
_GLANCE = CrankGrid(speeds=21, phases=20)  # enough to start a joint fit from
_WIDENINGS = 2  # of the grid of arms


@dataclass(frozen=True, eq=False)
class CrankTrial:
    """One dry run beside the twin with the fitted arm.

    Attributes:
        measured: the run.
        speed_hz, speed_se_hz: turns of the crank a second.
        phase_rad, phase_se_rad: crank angle at time 0, from 0 to 2 pi.
        marker_error_m: published distance of the twin with the joint arm and this speed and phase, m.
        scale: of the picture by all markers, over that of the measured nose-neck distance.
        motion_error_m: root mean square distance of the markers' motions about their means in the joint fit, m.
        published: this run's own lowest published distance.
        surface: the published distance on the grid.
        tendons: in the twin, at the fitted arm and speed.
        shortcut_error_m: greatest distance between a marker read off the table and simulated at this arm and speed, m.
        flags: what is doubtful.
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
    shortcut_error_m: float
    flags: tuple[Flag, ...]

    @property
    def name(self) -> str:
        """As in the session."""
        return self.measured.name

    @property
    def stretch(self) -> float:
        """Greatest stretch of a tendon, relative."""
        return self.tendons.stretch

    @property
    def slack_share(self) -> float:
        """Share of the turn and of the tendons in which a string would hang loose."""
        return self.tendons.slack_share


@dataclass(frozen=True, eq=False)
class CrankFit:
    """The crank of a robot.

    Attributes:
        arm_m, arm_se_m: of the joint fit of all runs, and its standard error, m.
        smooth_m: smallest and largest arm around it over which the tail moves smoothly; the arm lies within, m.
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
        """Of each run by its own published distance, m."""
        return tuple(trial.published.arm_m for trial in self.trials)

    @property
    def arm_published_m(self) -> float:
        """The published estimate: the mean of those, m."""
        return float(np.mean(self.arm_per_trial_m))


def fit_crank(
    trials: Sequence[DryTrial],
    robot: RobotSpec,
    grid: CrankGrid = PUBLISHED_GRID,
    response: DryResponse | None = None,
    workers: int = 0,
) -> CrankFit:
    """Finds the crank arm of a robot from its dry runs.

    Args:
        trials: from `measure_dry_run`.
        robot: whose arm is sought; its own arm is the middle of the grid, before it is widened.
        grid: of the published search, for each trial.
        response: its simulations, when they were made before (`crank_response`).
        workers: threads; 0 for all cores.

    Raises:
        NotEnoughData: no trial, or no smooth motion of the tail over four neighbouring arms.
        SimulationDiverged: the fitted motion does not stay bounded.
        ValueError: a response that does not hold the speeds of the trials.
    """
    if not trials:
        raise NotEnoughData('no dry run: the crank needs at least one trial with kind = "dry"')
    if response is None:
        response = crank_response(trials, robot, grid, workers)
    _check_speeds(response, speed_range(trials))
    with threadpool_limits(1, user_api="blas"):  # small matrices, for which threads only wait
        surfaces = [error_surface(trial, response, grid, workers) for trial in trials]
        valleys = [refine_valleys(t, response, surface) for t, surface in zip(trials, surfaces, strict=True)]
        joint = fit_joint(trials, response, [found[0] for found in valleys])
        return _assembled(trials, with_arm(robot, joint.arm_m), response, surfaces, valleys, joint, workers)


def crank_response(
    trials: Sequence[DryTrial], robot: RobotSpec, grid: CrankGrid = PUBLISHED_GRID, workers: int = 0
) -> DryResponse:
    """What `fit_crank` simulates: the grid's arms, at the speeds of these trials.

    Where the trials ask for an arm beyond the grid, it is widened by as much again, twice at most.

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
    """Those of these arms that are long enough to hold the anchors."""
    return arm_m[arm_m > 1.05 * robot.crank.anchor_inset_m]


def _asked_beyond(trials: Sequence[DryTrial], response: DryResponse, workers: int) -> int:
    """-1 where the trials ask for an arm below those simulated, 1 above, 0 within; beyond a snap there is none."""
    low, high = response.arm_m[[0, -1]]
    with threadpool_limits(1, user_api="blas"):
        starts = [error_surface(trial, response, _GLANCE, workers).valleys(1)[0] for trial in trials]
        arm_m = fit_joint(trials, response, starts).arm_m
    margin = (high - low) / len(response.arm_m)
    return int(arm_m > high - margin) - int(arm_m < low + margin)


def _check_speeds(response: DryResponse, needed_hz: tuple[float, float]) -> None:
    low, high = response.hz[0], response.hz[-1]
    if low > needed_hz[0] + 1e-9 or high < needed_hz[1] - 1e-9:
        raise ValueError(
            f"response: found speeds from {low:.3g} to {high:.3g} Hz, expected {needed_hz[0]:.3g} to "
            f"{needed_hz[1]:.3g} Hz, which hold all trials: make it with crank_response"
        )


def _assembled(
    trials: Sequence[DryTrial],
    robot: RobotSpec,
    response: DryResponse,
    surfaces: list[ErrorSurface],
    valleys: list[tuple[Cell, ...]],
    joint: JointFit,
    workers: int,
) -> CrankFit:
    hz = np.array([trial.hz for trial in joint.trials])
    uses = tendon_use(robot, hz, workers)
    direct = simulate_turns(robot, response.markers, hz, workers=workers)
    smooth = response.range_of(joint.branch)
    found = []
    for i, (trial, own) in enumerate(zip(trials, joint.trials, strict=True)):
        turn = response.turn(joint.arm_m, own.hz, joint.branch)
        one = partial(CrankTrial, trial, own.hz, own.hz_se, turn.crank_rad(own.phase_rad), own.phase_se_rad)
        distance = distance_at(trial, response.select(trial.markers), joint.arm_m, own.hz, own.phase_rad)
        other = other_valley(valleys[i], surfaces[i])
        error = _farthest(turn, Turn(direct.marker_m[i], direct.lead_rad[i]))
        facts = Found(trial, own, surfaces[i], valleys[i][0], other, uses[i], error)
        flags = (*trial.flags, *trial_flags(facts, smooth))
        found.append(one(distance, own.scale, own.motion_error_m, valleys[i][0], surfaces[i], uses[i], error, flags))
    arms = [cells[0].arm_m for cells in valleys]
    return CrankFit(joint.arm_m, joint.arm_se_m, smooth, tuple(found), fit_flags(joint, response, arms))


def _farthest(one: Turn, other: Turn) -> float:
    return float(np.abs(one.marker_m - other.marker_m).max())
