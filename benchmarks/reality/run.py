"""Simulation of trials: batches of them at once, filmed by their worlds' cameras."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from benchmarks.reality.body import Chain
from benchmarks.reality.film import Recording, exposed_s, film
from benchmarks.reality.integrate import step
from benchmarks.reality.layout import HINGES_PER_GAP, Layout, lay_out
from benchmarks.reality.motion import Motion
from benchmarks.reality.parameters import Parameters
from benchmarks.reality.record import KEEP_S, Record
from benchmarks.reality.tendons import Tendons, Turn
from benchmarks.reality.world import Trial, World, prepared_parameters
from swimcal.errors import SimulationDiverged
from swimcal.robot import load_robot

STEP_S = 0.001
_BATCH = 256
# A batch goes on for this long after a trial's end and last frame, which must be between two kept instants.
_SPARE_S = 0.01
_STAGES = 24  # The crank is followed from the straight tail in this many stages.
_STAGE_ITERATIONS = 6
_LAST_ITERATIONS = 60
_EXTRA_STIFFNESS = 2.0  # The Jacobian has this many times the hinges' stiffness added.
_NUDGE_RAD = 0.01  # The pose's slope is taken over this turn of the crank.
# The tail has snapped into another pose where a hinge turns more than this many times as far as the crank.
_SNAP_SLOPE = 5.0


def simulate(
    trials: Sequence[tuple[World, Trial]],
    markers: tuple[str, ...] | None = None,
    step_s: float = STEP_S,
    hinges_per_gap: int = HINGES_PER_GAP,
    *,
    allow_divergence: bool = False,
) -> list[Recording]:
    """Simulate trials, each in its world; return their recordings in the same order.

    Args:
        trials: worlds and what is done in them, in any mix.
        markers: names of the markers wanted; default all of the robot's.
        step_s: step of the integrator, s.
        hinges_per_gap: number of hinges for each of the robot's.
        allow_divergence: what blows up becomes nan instead of an error.

    Raises:
        SimulationDiverged: a simulation blew up and `allow_divergence` is False.
    """
    robot = load_robot()
    layout, names = lay_out(robot, hinges_per_gap), markers or tuple(robot.markers)
    order = sorted(range(len(trials)), key=lambda i: _compute_order(*trials[i]))
    recordings: dict[int, Recording] = {}
    for first in range(0, len(trials), _BATCH):
        rows = order[first : first + _BATCH]
        batch = [trials[i] for i in rows]
        parameters = Parameters.stacked([prepared_parameters(*each, layout, names) for each in batch])
        motion = Motion(layout, parameters, *cranks(batch), [world.mechanisms for world, _ in batch])
        recordings.update(zip(rows, filmed(motion, batch, names, step_s, allow_divergence), strict=True))
    return [recordings[i] for i in range(len(trials))]


def _compute_order(world: World, trial: Trial) -> tuple[int, list[str]]:
    """Return a key that sorts trials into batches: similar in length and mechanisms, so that a batch costs less."""
    return -int(np.ceil(trial.lead_s + trial.duration_s)), sorted(type(m).__qualname__ for m in world.mechanisms)


def cranks(trials: Sequence[tuple[World, Trial]]) -> tuple[np.ndarray, np.ndarray]:
    """Return (n,) turns a second of each trial's crank, as commanded, and its angle at time 0."""
    return np.array([trial.frequency_hz for _, trial in trials]), np.array([trial.phase_rad for _, trial in trials])


def filmed(
    motion: Motion,
    trials: Sequence[tuple[World, Trial]],
    markers: tuple[str, ...],
    step_s: float,
    allow_divergence: bool,
    before_step: Callable[[int, np.ndarray, np.ndarray], None] = lambda *_: None,
) -> list[Recording]:
    """Run a batch until every trial's end and last frame, and film each by the camera of its world.

    Args:
        motion: equations of motion of the trials, in their order.
        trials: n worlds, each with its trial.
        markers: names of the markers wanted.
        step_s: step of the integrator, s.
        allow_divergence: what blows up becomes nan instead of an error.
        before_step: called with the number of each step, and coordinates and rates (n, N) then.
    """
    made = [trial for _, trial in trials]
    start_s = -np.array([[trial.lead_s] for trial in made])
    position, velocity = start_of(motion, made, start_s)
    last_s = np.array([max(float(exposed_s(world, trial).max()), trial.duration_s) for world, trial in trials])
    steps = int(np.ceil((float((last_s - start_s[:, 0]).max()) + _SPARE_S) / step_s)) + 1
    release = np.array([[trial.release_s if trial.kind == "free_decay" else -np.inf] for trial in made])
    every, kept, states = max(int(KEEP_S / step_s + 1e-9), 1), [], motion.start_states(start_s, position, velocity)
    with np.errstate(all="ignore"):  # what blows up is found below
        for k in range(steps):
            before_step(k, position, velocity)
            time_s = start_s + k * step_s
            later, faster, at = step(motion, time_s, position, velocity, states, step_s)
            if k % every == 0:
                kept.append((position, velocity, at.now.turn.angle_rad[:, 0], at.now.pull.crank_torque_n_m[:, 0]))
            states = motion.advanced(at, states, step_s)
            let_go = time_s >= release - 1e-9
            position, velocity = np.where(let_go, later, position), np.where(let_go, faster, velocity)
    record = Record(start_s, every * step_s, *(np.stack(values, axis=1) for values in zip(*kept, strict=True)))
    if (lost := record.lost).any() and not allow_divergence:
        raise divergence(made, lost, step_s)
    record.position[lost] = np.nan
    return [film(*each, record, row, motion.layout, motion.parameters, markers) for row, each in enumerate(trials)]


def divergence(trials: Sequence[Trial], lost: np.ndarray, step_s: float = STEP_S) -> SimulationDiverged:
    """Return the error to raise of trials of which some, (n,) marked, blew up."""
    first = trials[int(np.flatnonzero(lost)[0])]
    return SimulationDiverged(
        f"{int(lost.sum())} of {len(trials)} reference simulations diverged; the first a {first.kind} at "
        f"{first.frequency_hz:g} Hz. Expected a bounded motion; try a smaller time step than {step_s:g} s."
    )


def start_of(motion: Motion, trials: Sequence[Trial], time_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return (n, N) coordinates and rates at times (n, 1): the tail in balance with its tendons, or held bent."""
    layout, each = motion.layout, motion.layout.hinges_per_gap
    hinges, hinge_rates = balanced_hinges(layout, motion.parameters, motion.commanded(time_s))
    position, velocity = np.zeros((2, len(trials), layout.hinges + 3))
    for row, trial in enumerate(trials):
        if trial.kind == "free_decay":
            hinges[row], hinge_rates[row] = np.repeat(np.array(trial.bent_rad) / each, each), 0.0
        elif trial.kind == "swim":
            way = trial.start_speed_m_s * np.exp(1j * trial.heading_rad)
            velocity[row, :2] = way.real, way.imag
        position[row, :3] = trial.place_m.real, trial.place_m.imag, trial.heading_rad + np.pi  # x runs tailwards
    position[:, 3:] = position[:, 2:3] + np.cumsum(hinges, axis=1)
    velocity[:, 3:] = np.cumsum(hinge_rates, axis=1)
    return position, velocity


def balanced_hinges(layout: Layout, parameters: Parameters, turn: Turn) -> tuple[np.ndarray, np.ndarray]:
    """Return (n, h) hinge angles in which the tail rests under its tendons, and their rates as the crank turns, slowly.

    Descends the tail's potential energy, following the crank from the nearest angle at which the tail is straight. The
    steps are Newton's with a Jacobian without the curving of the tendons' paths, made up for by stiffer hinges.
    Where a pulled tail snaps into another pose just there, it starts at rest.
    """
    chain = Chain(layout, parameters)
    tendons = Tendons(layout, replace(parameters, tendon_damping_n_s_m=0 * parameters.tendon_damping_n_s_m), chain)
    hinges = parameters.hinge_rest_rad.copy()
    angle, upright = turn.angle_rad, np.pi * np.round(turn.angle_rad / np.pi)
    for share in np.linspace(0.0, 1.0, _STAGES):
        at = upright + share * (angle - _NUDGE_RAD - upright)
        hinges = _settle(chain, tendons, parameters, hinges, at, _STAGE_ITERATIONS if share < 1 else _LAST_ITERATIONS)
    ahead = _settle(chain, tendons, parameters, hinges, angle, _LAST_ITERATIONS)
    slope = (ahead - hinges) / _NUDGE_RAD
    slope = np.where(np.abs(slope).max(axis=1, keepdims=True) < _SNAP_SLOPE, slope, 0.0)
    return ahead, slope * turn.speed_rad_s


def _settle(
    chain: Chain,
    tendons: Tendons,
    parameters: Parameters,
    hinges: np.ndarray,
    angle_rad: np.ndarray,
    iterations: int,
) -> np.ndarray:
    """Return (n, h) hinge angles with the crank at rest at angles (n, 1), from a guess (n, h)."""
    still = Turn(angle_rad, np.zeros_like(angle_rad))
    to_hinges = np.triu(np.ones((hinges.shape[1], hinges.shape[1])))  # a hinge turns every link behind it
    for _ in range(iterations):
        angles = np.concatenate([np.zeros((len(hinges), 1)), np.cumsum(hinges, axis=1)], axis=1)
        position = np.concatenate([np.zeros((len(hinges), 2)), angles], axis=1)
        pull = tendons.pull(chain.pose(position, np.zeros_like(position)), still, still, 1.0)
        gradient = pull.gradient_m[:, :, 3:] @ to_hinges.T  # (n, 2, h)
        stiffness = parameters.hinge_stiffness_n_m
        jacobian = (1 + _EXTRA_STIFFNESS) * stiffness[:, :, None] * np.eye(hinges.shape[1])
        jacobian = jacobian + (np.swapaxes(gradient, 1, 2) * parameters.tendon_stiffness_n_m[:, None]) @ gradient
        force = -stiffness * (hinges - parameters.hinge_rest_rad) - (pull.tension_n[:, None] @ gradient)[:, 0]
        hinges = hinges + np.linalg.solve(jacobian, force[:, :, None])[..., 0]
    return hinges
