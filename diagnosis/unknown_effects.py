"""Unknown effects of each stage: what could act there beside the effects of the catalogue, and where it probably acts.

Where no set of effects of the catalogue leaves only noise, no name can be trusted, but the stage can: water, structure,
tendons, drive or camera. `unknown_effects` gives each stage general laws of its own, with free coefficients that hold
in all trials, and the effects of the catalogue. Water pushes by how each part of the body moves, also by how it
accelerates and moved before, with coefficients that change along the body; hinges resist by angle and rate; tendons
pull by the angle of the crank. `stage_probabilities` compares the stages by the likelihood of what each explains, at
its likeliest sizes (variance components; Patterson and Thompson 1971), less one for each size (Akaike 1974).
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import logsumexp

from diagnosis.constants import FORM_ERROR
from diagnosis.linear_model import LinearModel
from diagnosis.places import HEAD, PER_JOINT, ForceResponses
from diagnosis.where import GapComponent, likeliest_sizes, of_features, other_frequencies, response_of
from fitting.pool import waves
from fitting.signatures import Signature
from fitting.trial import HARMONICS
from fitting.trial_model import TrialModel, trajectories_together
from swimcal.effects.effect import Motion, Plates
from swimcal.robot import RobotSpec
from swimcal.runs import Trajectories

STAGE_OF = {"fluid": "water", "structure": "structure", "tendons": "tendons", "drive": "drive", "measurement": "camera"}
"""Stage at which the effects of each family of the catalogue act."""
STAGE_OF_GAP = {"water": "body", "structure": "tail", "tendons": "tail", "drive": "drive", "camera": "camera"}
"""Stage of `diagnosis.where` at which an unknown effect makes a gap."""
_SLOW_RAD_S = 0.2  # rate of a hinge at which dry friction has three quarters of its torque


class _Swim(NamedTuple):
    """One trial as the twin swims it.

    Attributes:
        time_s: (n,) s.
        hz: beats a second.
        kept: (n,) the frames that features are made of.
        crank_rad: (n,) rad.
        yaw_rad: (n,) heading of the head, rad.
        hinges_rad: (n, h) rad.
        clamped: whether the head is clamped in air.
        plates: the plates of the robot.
        motion: their motion, (n, p).
    """

    time_s: np.ndarray
    hz: float
    kept: np.ndarray
    crank_rad: np.ndarray
    yaw_rad: np.ndarray
    hinges_rad: np.ndarray
    clamped: bool
    plates: Plates
    motion: Motion

    @classmethod
    def of(cls, model: TrialModel, swum: Trajectories) -> "_Swim":
        scene, time_s = model.twin.scene, model.time_s
        head, hinges_rad, crank_rad = swum.head[0], swum.hinges_rad[0], swum.crank_rad[0]
        joints = np.column_stack([*([] if scene.head_clamped else [head]), crank_rad, hinges_rad])
        plates = Plates(model.twin.robot, scene)
        return cls(
            time_s=time_s,
            hz=model.trial.frequency.hz,
            kept=model.trial.kept[: len(time_s)],
            crank_rad=crank_rad,
            yaw_rad=np.zeros(len(time_s)) if scene.head_clamped else head[:, 2],
            hinges_rad=hinges_rad,
            clamped=scene.head_clamped,
            plates=plates,
            motion=plates.motion(joints, np.gradient(joints, time_s, axis=0)),
        )

    @property
    def beat(self) -> np.ndarray:
        """Mean, cosine and sine of each harmonic of the crank, (n, 7)."""
        return np.column_stack([np.ones(len(self.time_s)), waves(self.crank_rad, HARMONICS)])

    @property
    def ahead(self) -> np.ndarray:
        """Velocity of each plate along itself, (n, p), m/s."""
        return np.real(self.motion.along.conj() * self.motion.velocity)

    @property
    def across(self) -> np.ndarray:
        """Velocity of each plate across itself, (n, p), m/s."""
        return np.imag(self.motion.along.conj() * self.motion.velocity)

    def rate(self, series: np.ndarray) -> np.ndarray:
        """Return the derivative of a series (n, ...) by time."""
        return np.asarray(np.gradient(series, self.time_s, axis=0))

    def before(self, series: np.ndarray) -> np.ndarray:
        """Return a series (n, p) as it was a quarter of a beat ago."""
        then_s = self.time_s - 0.25 / self.hz
        return np.column_stack([np.interp(then_s, self.time_s, each) for each in series.T])

    def of_forces(self, force_n: np.ndarray) -> np.ndarray:
        """Return the forces (n, 3 + h) on head and hinges, N and N m, of forces on the plates (n, p) in the pool, N."""
        joints = self.plates.generalised(force_n, self.motion)
        if self.clamped:
            return np.hstack([np.zeros((len(joints), len(HEAD))), joints[:, 1:]])
        along = (joints[:, 0] + 1j * joints[:, 1]) * np.exp(-1j * self.yaw_rad)
        return np.column_stack([along.real, along.imag, joints[:, 2], joints[:, len(HEAD) + 1 :]])

    def of_torques(self, torque_n_m: np.ndarray) -> np.ndarray:
        """Return the forces (n, 3 + h) on head and hinges of torques (n, h) in the hinges, N m."""
        return np.hstack([np.zeros((len(torque_n_m), len(HEAD))), torque_n_m])


_OF_WATER: dict[str, Callable[[_Swim], np.ndarray]] = {
    "drag across": lambda swim: 1j * swim.across,
    "quadratic drag across": lambda swim: 1j * np.abs(swim.across) * swim.across,
    "lift": lambda swim: 1j * np.abs(swim.motion.velocity) * swim.across,
    "added mass": lambda swim: 1j * swim.rate(swim.across),
    "memory": lambda swim: 1j * swim.before(swim.across),
    "drag along": lambda swim: np.abs(swim.ahead) * swim.ahead,
    "thrust": lambda swim: swim.across**2,
    "thrust of acceleration": lambda swim: swim.rate(swim.across**2),
}
"""Laws of a force on each plate (n, p), along it and, imaginary, across it, for each square metre."""
_OF_HINGES: dict[str, Callable[[_Swim], np.ndarray]] = {
    "stiffness": lambda swim: swim.hinges_rad,
    "hardening": lambda swim: swim.hinges_rad**3,
    "damping": lambda swim: swim.rate(swim.hinges_rad),
    "friction": lambda swim: np.tanh(swim.rate(swim.hinges_rad) / _SLOW_RAD_S),
}
"""Laws of a torque (n, h) in each hinge."""


def unknown_effects(
    linear: LinearModel, forces: ForceResponses, signatures: Sequence[Signature]
) -> dict[str, dict[GapComponent, np.ndarray]]:
    """Return, for each stage, the columns (k, q) of what an unknown effect there can do.

    Args:
        linear: the linearised model of the fitted trials.
        forces: responses to missing forces.
        signatures: what each effect of the catalogue does.
    """
    swum = trajectories_together(linear.model.trials, linear.at[None])
    swims = [_Swim.of(model, each) for model, each in zip(linear.model.trials, swum, strict=True)]
    laws = {
        "water": _of_water(linear.twin.robot, forces, swims),
        "structure": _of_structure(linear.twin.robot, forces, swims),
        "tendons": _of_tendons(linear.twin.robot, forces, swims),
        "drive": iter([("frequency", other_frequencies(linear))]),
        "camera": iter([("markers", of_features(linear, linear.disturbances.per_marker))]),
    }
    found: dict[str, dict[GapComponent, np.ndarray]] = {}
    for family, stage in STAGE_OF.items():
        known = [(each.effect.name, response_of(each)) for each in signatures if each.effect.family == family]
        members = {GapComponent(STAGE_OF_GAP[stage], f"{stage}: {name}"): part for name, part in (*laws[stage], *known)}
        found[stage] = {name: part for name, part in members.items() if part.any()}
    return found


def stage_probabilities(
    linear: LinearModel, members: Mapping[str, Mapping[GapComponent, np.ndarray]]
) -> dict[str, float]:
    """Return the probability that the gap is due to an effect of each stage; what they lack to 1 is that of no effect.

    An unknown effect acts at one stage alone. In addition clock or crank may be off by the same share in all trials:
    the catalogue explains that, so it tells of no unknown effect. No law has exactly the effect's form, so a share
    `FORM_ERROR` of what the best stage explains beyond that counts as noise: where much is explained, differences
    between stages tell less.

    Args:
        linear: the linearised model of the fitted trials.
        members: what unknown effects of each stage can do, see `unknown_effects`.
    """
    target = linear.space.projected(linear.residual)
    paced = linear.space.projected(all_faster(linear).T).T
    none, scores = -0.5 * likeliest_sizes(target, [paced])[1], dict[str, float]()
    for stage, parts in members.items():
        columns = [linear.space.projected(part.T).T for part in parts.values()]
        sizes, deviance = likeliest_sizes(target, [paced, *columns])
        scores[stage] = -0.5 * deviance - np.count_nonzero(sizes[1:])
    noise = 1 + FORM_ERROR**2 * max(max(scores.values()) - none, 0.0)
    everything = float(logsumexp(np.array([none, *scores.values()]) / noise))
    return {stage: float(np.exp(score / noise - everything)) for stage, score in scores.items()}


def all_faster(linear: LinearModel) -> np.ndarray:
    """Return the columns (k, 2) of a clock, and of a crank, that is off by the same share in all trials."""
    columns, trials, logged = other_frequencies(linear), len(linear.trials), list(linear.model.logged)
    unlogged = [number for number in range(trials) if number not in logged]
    crank = columns[:, unlogged].sum(axis=1) + columns[:, trials:].sum(axis=1)
    return np.column_stack([columns[:, :trials].sum(axis=1), crank])


def _of_water(robot: RobotSpec, forces: ForceResponses, swims: Sequence[_Swim]) -> Iterator[tuple[str, np.ndarray]]:
    """Yield the columns (k, 4) of each law of the water; in air it does nothing."""
    for name, law in _OF_WATER.items():
        pushed = [law(swim) * swim.motion.along * (not swim.clamped) for swim in swims]
        yield name, _of_shapes(robot, forces, swims, pushed)


def _of_structure(robot: RobotSpec, forces: ForceResponses, swims: Sequence[_Swim]) -> Iterator[tuple[str, np.ndarray]]:
    """Yield the columns (k, h) of each law of the hinges, and (k, 4) of masses."""
    for name, law in _OF_HINGES.items():
        acting = (
            [swim.of_torques(law(swim) * hinge) for swim in swims] for hinge in np.eye(len(robot.hinges), dtype=bool)
        )
        yield name, np.column_stack([_row(forces, swims, each) for each in acting])
    yield "mass", _of_shapes(robot, forces, swims, [-swim.rate(swim.motion.velocity) for swim in swims])


def _of_tendons(robot: RobotSpec, forces: ForceResponses, swims: Sequence[_Swim]) -> Iterator[tuple[str, np.ndarray]]:
    """Yield the columns (k, 14) of a pull by the angle of the crank, also in proportion to its speed.

    It acts in all hinges alike, or against them behind a crossing of the tendons.
    """
    side = np.cumprod([-1.0 if segment.tendon_crosses else 1.0 for segment in robot.tail.segment])
    for name, power in (("pull", 0), ("pull with speed", 1)):
        acting = (
            [swim.of_torques(swim.hz**power * np.outer(swim.beat[:, number], pattern)) for swim in swims]
            for pattern in (np.ones_like(side), side)
            for number in range(PER_JOINT)
        )
        yield name, np.column_stack([_row(forces, swims, each) for each in acting])


def _of_shapes(
    robot: RobotSpec, forces: ForceResponses, swims: Sequence[_Swim], pushed: Sequence[np.ndarray]
) -> np.ndarray:
    """Return the columns (k, 4) of forces on the plates (n, p), in the pool, with coefficients along the body.

    One acts on the head, two towards either end of the tail, one on the fin. Their sizes are free, and so are units.
    """
    plates = swims[0].plates
    area_m2 = 4 * plates.half_m[:, 0] * plates.half_m[:, 2]
    tail = np.linspace(0.0, 1.0, len(robot.hinges))
    shapes = np.zeros((4, len(area_m2)))
    shapes[0, 0] = shapes[3, -1] = 1.0
    shapes[1, 1:-1], shapes[2, 1:-1] = 1 - tail, tail
    acting = ([swim.of_forces(area_m2 * shape * n) for swim, n in zip(swims, pushed, strict=True)] for shape in shapes)
    return np.column_stack([_row(forces, swims, each) for each in acting])


def _row(forces: ForceResponses, swims: Sequence[_Swim], acting: Sequence[np.ndarray]) -> np.ndarray:
    """Return the change (k,) of the row with forces (n, 3 + h) on head and hinges in each trial, linear."""
    found = np.zeros(len(forces.columns))
    for trial, (swim, force) in enumerate(zip(swims, acting, strict=True)):
        beat = swim.beat[swim.kept]
        amplitude = np.linalg.lstsq(beat, force[swim.kept], rcond=None)[0].T / forces.unit[:, None]  # (j, 7)
        found += np.einsum("kjn,jn->k", forces.columns[:, trial], amplitude)
    return found
