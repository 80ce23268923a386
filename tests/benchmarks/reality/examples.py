"""A mechanism for each hook, each nothing at strength 0."""

from dataclasses import dataclass, replace

import numpy as np

from benchmarks.reality import Mechanism
from benchmarks.reality.camera import Picture
from benchmarks.reality.fluid import StripForces
from benchmarks.reality.instant import Instant
from benchmarks.reality.layout import Layout
from benchmarks.reality.parameters import Parameters
from benchmarks.reality.tendons import Turn


@dataclass(frozen=True)
class StickyHinges(Mechanism):
    """LuGre friction (Canudas de Wit and others 1995), the bristles integrated exactly over a step."""

    friction_n_m: float
    bristle_n_m: float = 2.0  # per rad

    def prepare(self, parameters: Parameters, layout: Layout) -> Parameters:  # noqa: ARG002
        bristle = self.bristle_n_m if self.friction_n_m > 0 else 0.0
        return replace(parameters, extra_implicit_stiffness_n_m=parameters.extra_implicit_stiffness_n_m + bristle)

    def start(self, now: Instant) -> np.ndarray:
        return np.zeros(now.pose.hinge_rad.shape)

    def advance(self, now: Instant, state: np.ndarray, step_s: float) -> np.ndarray:
        rate = now.pose.hinge_rate_rad_s
        limit = np.sign(rate) * self.friction_n_m / self.bristle_n_m
        relaxed = np.exp(-np.abs(rate) * step_s * self.bristle_n_m / np.maximum(self.friction_n_m, 1e-12))
        return limit + (state - limit) * relaxed

    def force(self, now: Instant, state: np.ndarray) -> np.ndarray:
        return now.bend(-self.bristle_n_m * state)


@dataclass(frozen=True)
class LateLift(Mechanism):
    """A share of the force across each strip comes late, in two exponentials, as Wagner's indicial lift does."""

    share: float
    fast_s: float = 0.02
    slow_s: float = 0.2

    def start(self, now: Instant) -> np.ndarray:
        return np.concatenate([now.water.across_n, now.water.across_n], axis=1)

    def advance(self, now: Instant, state: np.ndarray, step_s: float) -> np.ndarray:
        fast, slow = np.split(state, 2, axis=1)
        steady = now.water.across_n
        lags = [(fast, self.fast_s), (slow, self.slow_s)]
        return np.concatenate([steady + (z - steady) * np.exp(-step_s / lag) for z, lag in lags], axis=1)

    def water(self, now: Instant, forces: StripForces, state: np.ndarray) -> StripForces:  # noqa: ARG002
        fast, slow = np.split(state, 2, axis=1)
        late = self.share * (forces.across_n - (fast + slow) / 2)
        return replace(forces, across_n=forces.across_n - late)


@dataclass(frozen=True)
class SaggingMotor(Mechanism):
    """The crank falls behind by its load: its state is the angle lost."""

    per_torque: float  # share of the speed lost at 1 N m

    def start(self, now: Instant) -> np.ndarray:
        return np.zeros((len(now.time_s), 2))  # angle, speed

    def advance(self, now: Instant, state: np.ndarray, step_s: float) -> np.ndarray:
        load = np.maximum(now.pull.crank_torque_n_m, 0.0)
        slower = self.per_torque * load * 2 * np.pi
        return np.concatenate([state[:, :1] + step_s * slower, slower], axis=1)

    def turn(self, time_s: np.ndarray, turn: Turn, state: np.ndarray) -> Turn:  # noqa: ARG002
        return Turn(turn.angle_rad - state[:, :1], turn.speed_rad_s - state[:, 1:])


@dataclass(frozen=True)
class GluedElsewhere(Mechanism):
    """The marker on the third segment sits off its place, along the link."""

    shift_m: float

    def prepare(self, parameters: Parameters, layout: Layout) -> Parameters:
        third = np.arange(parameters.marker_m.shape[1]) == list(layout.robot.markers).index("tail_3")
        return replace(parameters, marker_m=parameters.marker_m + self.shift_m * third)


@dataclass(frozen=True)
class Barrel(Mechanism):
    """Radial distortion, r (1 + k1 r^2)."""

    k1: float

    def picture(self, picture: Picture) -> Picture:
        camera = picture.camera
        ray = (picture.position_px - camera.centre_px) / camera.focal_px
        bent = ray * (1 + self.k1 * (ray**2).sum(axis=-1, keepdims=True))
        return replace(picture, position_px=camera.centre_px + camera.focal_px * bent)
