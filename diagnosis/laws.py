"""Forces at one place that go with how it moves: a spring that is gone, a hinge that rubs, a mass nobody knows of.

Far fewer numbers tell of such a force than of one that is free in every harmonic of every trial, so it shows where the
latter does not: one hinge whose spring has cracked takes one number, in all trials alike.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from scipy.interpolate import make_interp_spline

from diagnosis.ground import Ground
from diagnosis.hinge_laws import LAWS, in_decays
from diagnosis.pushes import HEAD, Responses, across
from diagnosis.tail_places import SMOOTH, TailPlaces
from fitting.model.features import HARMONICS, waves
from fitting.model.trial_model import TrialModel
from swimmer import RobotSpec

WHOLE_TAIL = "whole tail"
"""Place of torques that are alike in all hinges, and of what is spread alike along it."""
DRAG = "the square of the speed of its parts"
"""What drag along the whole tail goes with."""
_ALONG, _ACROSS, _TURNING = range(3)  # of the head's joints
_RUBS = 0.2  # of the root mean square rate, within which dry friction turns
_STILL = 1e-12  # rad/s


class Law(NamedTuple):
    """What a force does that follows one law.

    Attributes:
        place: where it acts.
        goes_with: what it is proportional to.
        of_water: whether the twin's own error in the water acts like it.
        columns: (k, t, b) of the row, in one trial alone; of a force with one number b is 1. Of what it does to free
            decays each trial has an even share.
    """

    place: str
    goes_with: str
    of_water: bool
    columns: np.ndarray


class _Motion(NamedTuple):
    """Of one trial's twin, in n frames.

    Attributes:
        crank: (n,) rad.
        head: (n, 3) velocity in its own frame, m/s and rad/s.
        head_faster: (n, 3) its acceleration, along the same axes.
        hinges, rates, rates_faster: (n, h) angles, rad, and their first and second derivatives.
        wet: whether it is in the water.
        tail: places along it.
    """

    crank: np.ndarray
    head: np.ndarray
    head_faster: np.ndarray
    hinges: np.ndarray
    rates: np.ndarray
    rates_faster: np.ndarray
    wet: bool
    tail: TailPlaces


class _Pushed(NamedTuple):
    """All trials: how their twins move, and what forces would do to them.

    Attributes:
        motions: of each trial.
        responses: to forces.
        decays: (r, h, 4) what `LAWS` in hinges do to free decays.
    """

    motions: tuple[_Motion, ...]
    responses: Responses
    decays: np.ndarray

    def on(self, joint: int, values: Sequence[np.ndarray]) -> np.ndarray:
        """(k, t) of a force on a joint with these values (n,) in each trial, N or N m."""
        beats = [_of_beat(motion.crank, value) for motion, value in zip(self.motions, values, strict=True)]
        parts = [self.responses.columns[:, trial, joint] @ beat for trial, beat in enumerate(beats)]
        return np.column_stack(parts) / self.responses.unit[joint]

    def in_hinges(self) -> Iterator[tuple[str, str, np.ndarray]]:
        """Of springs, dampers, dry friction, and inertia of the hinge's own drive: place, what it goes with, (k, t).

        In each hinge, and in all of them alike.
        """
        hinges = self.responses.joints[len(HEAD) :]
        found: dict[str, list[np.ndarray]] = {}
        for number, hinge in enumerate(hinges):
            values = (
                [motion.hinges[:, number] for motion in self.motions],
                [motion.rates[:, number] for motion in self.motions],
                [_rubbing(motion.rates[:, number]) for motion in self.motions],
                [motion.rates_faster[:, number] for motion in self.motions],
            )
            for law, (goes_with, told) in enumerate(zip(LAWS, values, strict=True)):
                columns = self.on(len(HEAD) + number, told)
                columns[len(columns) - len(self.decays) :] = self.decays[:, number, law, None] / len(self.motions)
                found.setdefault(goes_with, []).append(columns)
                yield f"hinge {hinge}", goes_with, columns
        if len(hinges) > 1:
            for goes_with, own in found.items():
                yield WHOLE_TAIL, goes_with, np.sum(own, axis=0)

    def by_water(self, robot: RobotSpec, markers: Sequence[str]) -> Iterator[tuple[str, str, np.ndarray]]:
        """Of drag on the head, and of lift on it and the fin, which is told by the marker next to it: the same."""
        for axis, way in enumerate(("along", "across", "turning")):
            squares = [_squared(motion.head[:, axis]) for motion in self.motions]
            yield "head", f"the square of its speed {way}", self.on(axis, squares)
        ahead = [_squared(motion.head[:, _ALONG]) for motion in self.motions]
        yield "head", "the square of its speed ahead, to one side", self.on(_ACROSS, ahead)
        yield "head", "the square of its speed ahead, turning it", self.on(_TURNING, ahead)
        fin_m = robot.fin_root_x_m + robot.caudal_fin.centre_m
        parts = [each * self.on(joint, ahead) for joint, each in enumerate(across(fin_m, robot.hinge_x_m))]
        places_m = robot.marker_positions_m(tuple(markers))[:, 0]
        away_m = np.where(places_m > robot.hinge_x_m[0], np.abs(places_m - fin_m), np.inf)
        place = f"tail at {markers[int(np.argmin(away_m))]}" if np.isfinite(away_m).any() else "tail at the fin"
        yield place, "the square of the speed ahead, to one side", np.sum(parts, axis=0)

    def along_tail(self) -> Iterator[tuple[str, str, np.ndarray]]:
        """Of drag across each part in the water, and of mass, that are spread alike along the tail: the same."""
        drag = [each.wet * _squared(each.tail.speed_across_m_s) * each.tail.normal for each in self.motions]
        mass = [each.tail.acceleration_m_s2 for each in self.motions]
        for goes_with, told in ((DRAG, drag), ("the acceleration of its parts", mass)):
            forces = [each.tail.on_joints(force) for each, force in zip(self.motions, told, strict=True)]
            parts = [self.on(joint, [each[:, joint] for each in forces]) for joint in range(len(self.responses.joints))]
            yield WHOLE_TAIL, goes_with, np.sum(parts, axis=0)

    def of_mass(self, middle_m: float, length_m: float) -> np.ndarray:
        """(k, t, 3) of a mass too much in the head's middle, of how far off that it is, and of how far it spreads.

        For 1 kg, 1 kg a length off, and spread by a length.
        """
        along, aside, turning = (
            [motion.head_faster[:, axis] for motion in self.motions] for axis in (_ALONG, _ACROSS, _TURNING)
        )
        inwards = [-(motion.head[:, _TURNING] ** 2) for motion in self.motions]  # over the distance, as it turns
        own = self.on(_ALONG, along) + self.on(_ACROSS, aside)  # in the frame's origin
        off = self.on(_ALONG, inwards) + self.on(_ACROSS, turning) + self.on(_TURNING, aside)  # over its distance
        spread = self.on(_TURNING, turning)  # over the square of that
        at_middle = own + middle_m * off + middle_m**2 * spread
        return np.stack([at_middle, length_m * (off + 2 * middle_m * spread), length_m**2 * spread], axis=-1)


def laws(ground: Ground, responses: Responses) -> Iterator[Law]:
    """In every hinge and in all, along the tail, on the head, and across the caudal fin.

    With position, speed, its square, or acceleration.
    """
    motions = tuple(_motion(model, ground.at) for model in ground.model.trials)
    rates = np.sqrt(np.mean([np.mean(motion.rates**2, axis=0) for motion in motions], axis=0))  # (h,)
    pushed = _Pushed(motions, responses, in_decays(ground, np.maximum(_RUBS * rates, _STILL)))
    robot = ground.twin.robot
    wet = (*pushed.by_water(robot, ground.trials[0].markers), *pushed.along_tail())
    for of_water, told in ((False, pushed.in_hinges()), (True, wet)):
        for place, goes_with, columns in told:
            yield Law(place, goes_with, of_water, columns[..., None])
    yield Law("head", "its acceleration", True, pushed.of_mass(_middle_m(robot), robot.scale_length_m))


def _motion(model: TrialModel, at: np.ndarray) -> _Motion:
    moved, kept = model.trajectories(at[None]), model.trial.kept
    head, hinges = (make_interp_spline(moved.time_s, series[0], SMOOTH) for series in (moved.head, moved.hinges_rad))
    kept = kept[: len(moved.time_s)]
    time_s, yaw = moved.time_s[kept], moved.head[0, kept, 2]
    speed, faster = (_in_head(head(time_s, nu=order), yaw) for order in (1, 2))
    bent, rates, rates_faster = (hinges(time_s, nu=order) for order in range(3))
    wet = not model.twin.scene.head_clamped
    tail = TailPlaces.of(model.twin.robot, moved.time_s, moved.head[0], moved.hinges_rad[0]).kept(kept)
    return _Motion(moved.crank_rad[0][kept], speed, faster, bent, rates, rates_faster, wet, tail)


def _in_head(series: np.ndarray, yaw: np.ndarray) -> np.ndarray:
    """(n, 3) of the pool, along the head's axes."""
    cos, sin = np.cos(yaw), np.sin(yaw)
    along, across = cos * series[:, 0] + sin * series[:, 1], cos * series[:, 1] - sin * series[:, 0]
    return np.column_stack([along, across, series[:, 2]])


def _middle_m(robot: RobotSpec) -> float:
    """Where the head's mass has its centre, in its frame."""
    masses = [part.mass_kg for part in robot.head.part]
    return float(np.average([part.centre_m[0] for part in robot.head.part], weights=masses))


def _of_beat(crank: np.ndarray, value: np.ndarray) -> np.ndarray:
    """(7,) mean and harmonics of the crank's turn (n,) in a value (n,)."""
    columns = np.column_stack([np.ones(len(crank)), waves(crank, HARMONICS)])
    return np.asarray(np.linalg.lstsq(columns, value, rcond=None)[0])


def _squared(speed: np.ndarray) -> np.ndarray:
    return np.asarray(speed * np.abs(speed))


def _rubbing(rate: np.ndarray) -> np.ndarray:
    """Dry friction, smooth about rest."""
    return np.tanh(rate / max(_RUBS * float(np.sqrt(np.mean(rate**2))), _STILL))
