"""The forces that a diagnosis finds missing, over the beat, and the motions of the twin that they go with."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from diagnosis.result import MissingForces
from fitting import CalibratedTrial
from swimmer import RobotSpec

HEAD = ("head_along", "head_across", "head_moment")
FORCES = HEAD[:2]  # forces in N; all others are torques in N m
LEAST_LIKE = 0.7  # smallest correlation with which a force goes with a motion
# A force is correlated with motions if it differs from zero in at least this share of the beat.
LEAST_CLEAR = 0.1
_LEAST_SHOWN = 5e-6  # smallest size, N or N m, that is not printed as 0.00 mN or mN m
_LEVEL = 0.03  # correlations that differ by less than this are level
_ON_MIDDLE_M = 0.005  # largest distance from the middle plane of a marker on the midline
_BESIDE_M = 0.02  # distance from the outer hinges to where the direction of their links is read


def force_name(joint: str) -> str:
    """Name the missing force of a joint, in words."""
    names = {HEAD[0]: "force along the head", HEAD[1]: "force across the head", HEAD[2]: "moment on the head"}
    return names.get(joint) or f"torque in {joint.replace('_', ' ')}"


def seen(forces: MissingForces) -> list[int]:
    """List the places of the joints whose missing force is not 0 as it would be printed."""
    return [place for place, size in enumerate(forces.size) if size >= _LEAST_SHOWN]


class Likeness(NamedTuple):
    """The motions that a missing force goes with: the likest and those level with it.

    The correlation with the first.
    """

    motions: tuple[str, ...]
    correlation: float


def likenesses(forces: MissingForces, trials: Sequence[CalibratedTrial], robot: RobotSpec) -> dict[str, Likeness]:
    """Find the motion of the twin that each force goes with, in all swims by one factor.

    The motions are deflection, speed, speed squared and acceleration; means are left out.

    Args:
        forces: the missing forces of the diagnosis.
        trials: the swims of the fit.
        robot: the robot as described.
    """
    of_name = {trial.measured.name: trial for trial in trials}
    known = [(i, of_name[name]) for i, name in enumerate(forces.trials) if name in of_name]
    found: dict[str, list[tuple[np.ndarray, dict[str, np.ndarray]]]] = {joint: [] for joint in forces.joints}
    for place, trial in known:
        kept = trial.measured.kept & np.isfinite(trial.simulated.shape_m).all(axis=(1, 2))
        time_s = trial.measured.time_s[kept]
        turn = trial.phase_rad + trial.measured.crank_rad(time_s, trial.simulated_hz)
        force, _ = forces.over(turn)
        for joint, motion in motions(trial, kept, robot).items():
            if joint in found:
                own = force[place, forces.joints.index(joint)]
                found[joint].append((_about_mean(own), _rates(motion, time_s)))
    return {joint: _likest(parts, joint in HEAD) for joint, parts in found.items() if parts}


def motions(trial: CalibratedTrial, kept: np.ndarray, robot: RobotSpec) -> dict[str, np.ndarray]:
    """Compute (n,) motions in the kept frames: the head along and across itself (m), its heading and the hinges (rad).

    A hinge bends by the angle that the line through the markers turns from the link before it to the one behind it.

    Args:
        trial: the swim.
        kept: (n,) mask of the frames that are used.
        robot: the robot as described.
    """
    head, place = trial.simulated, robot.marker_positions_m(trial.measured.markers)
    middle = [int(i) for i in np.argsort(place[:, 0]) if abs(place[i, 1]) < _ON_MIDDLE_M]
    steps = np.diff(head.shape_m[kept][:, middle], axis=1)  # (n, k, 2)
    turned = np.unwrap(np.arctan2(steps[..., 1], steps[..., 0]), axis=1)  # (n, k)
    between = (place[middle[:-1], 0] + place[middle[1:], 0]) / 2
    hinge = robot.hinge_x_m
    links = np.concatenate([[hinge[0] - _BESIDE_M], (hinge[:-1] + hinge[1:]) / 2, [hinge[-1] + _BESIDE_M]])
    hinges = np.diff([np.interp(links, between, row) for row in turned], axis=1)  # (n, h)
    moved = {"head_along": head.path_m[kept, 0], "head_across": head.path_m[kept, 1]}
    return moved | {"head_moment": head.heading_rad[kept]} | dict(zip(robot.hinges, hinges.T, strict=True))


def _rates(motion: np.ndarray, time_s: np.ndarray) -> dict[str, np.ndarray]:
    speed = np.gradient(motion, time_s)
    series = {
        "deflection": motion,
        "speed": speed,
        "speed squared": speed * np.abs(speed),
        "acceleration": np.gradient(speed, time_s),
    }
    return {name: _about_mean(values) for name, values in series.items()}


def _about_mean(values: np.ndarray) -> np.ndarray:
    """Subtract the mean, after dropping the ends, where differences are one-sided: (n - 4,)."""
    inner = values[2:-2]
    return np.asarray(inner - inner.mean())


def _likest(parts: Sequence[tuple[np.ndarray, Mapping[str, np.ndarray]]], free: bool) -> Likeness:
    """Find the motion that correlates most.

    Of a body that rests on nothing (`free`), place and heading do not count.
    """
    force = np.concatenate([own for own, _ in parts])
    names = [name for name in parts[0][1] if not (free and name == "deflection")]
    columns = {name: np.concatenate([rates[name] for _, rates in parts]) for name in names}
    correlations = {
        name: float(motion @ force / max(np.linalg.norm(motion) * np.linalg.norm(force), 1e-300))
        for name, motion in columns.items()
    }
    best = max(correlations, key=lambda name: abs(correlations[name]))
    level = [name for name, r in correlations.items() if abs(r) > abs(correlations[best]) - _LEVEL]
    return Likeness(tuple(sorted(level, key=lambda name: -abs(correlations[name]))), correlations[best])
