"""The crank arm, and the speed and phase of every dry run: the published search, then one fit of all runs together."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from threadpoolctl import threadpool_limits

from fitting.dry_run.crank import CrankFit, CrankTrial
from fitting.dry_run.crank_flags import fit_flags, trial_flags
from fitting.dry_run.error_surface import ARM_SPAN, Cell, CrankGrid, ErrorSurface, error_surface, speed_range
from fitting.dry_run.joint import JointFit, fit_joint
from fitting.dry_run.measured import DryTrial
from fitting.dry_run.published import distance_at, lowest_point
from fitting.dry_run.response import DryResponse, simulate_response, with_arm
from fitting.dry_run.tendons import tendon_use
from session import NotEnoughData
from swimmer import RobotSpec

PUBLISHED_GRID = CrankGrid()
_GLANCE = CrankGrid(speeds=21, phases=20)  # enough to start a joint fit from
_WIDENINGS = 2  # of the grid of arms


def fit_crank(
    trials: Sequence[DryTrial],
    robot: RobotSpec,
    response: DryResponse,
    grid: CrankGrid = PUBLISHED_GRID,
    workers: int = 0,
) -> CrankFit:
    """Finds the crank arm of a robot from its dry runs.

    Args:
        trials: from `measure_dry_run`.
        robot: whose arm is sought.
        response: of it to these trials or more of them (`crank_response`).
        grid: of the published search, for each trial.
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
        return _assembled(trials, with_arm(robot, joint.arm_m), response, surfaces, lowest, joint, workers)


def crank_response(
    trials: Sequence[DryTrial], robot: RobotSpec, grid: CrankGrid = PUBLISHED_GRID, workers: int = 0
) -> DryResponse:
    """What `fit_crank` simulates: the grid's arms about that of the robot, at the speeds of these trials.

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


def _assembled(
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
    flags = fit_flags(joint, response, [cell.arm_m for cell in lowest])
    return CrankFit(joint.arm_m, joint.arm_se_m, smooth, tuple(found), tuple(flags))
