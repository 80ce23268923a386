"""One fish with some mechanisms, at an instant or for a moment."""

from typing import TypeVar

import numpy as np

from benchmarks.reality import Trial, World
from benchmarks.reality.layout import lay_out
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.motion import Equations, Motion
from benchmarks.reality.parameters import Parameters
from benchmarks.reality.world import TrialKind, prepared_parameters
from swimcal.robot import load_robot
from tests.benchmarks.reality.motions import COEFFICIENTS

_M = TypeVar("_M", bound=Mechanism)
LAYOUT = lay_out(load_robot())
STRAIGHT, STILL = np.zeros((2, LAYOUT.hinges + 3))


def prepared(mechanisms: tuple[Mechanism, ...] = (), kind: TrialKind = "swim") -> Parameters:
    """One row."""
    return prepared_parameters(World(COEFFICIENTS, mechanisms=mechanisms), Trial(kind, 1.0), LAYOUT, ("nose", "neck"))


def ahead(speed_m_s: float) -> np.ndarray:
    """(N,) rates of a straight fish that swims towards -x."""
    return np.concatenate([[-speed_m_s], STILL[1:]])


def bent_by(hinges_rad: np.ndarray) -> np.ndarray:
    """(N,) coordinates, or rates, of hinges (h,), the head at rest at the origin."""
    return np.concatenate([np.zeros(3), np.cumsum(hinges_rad)])


def instant(
    mechanisms: tuple[Mechanism, ...],
    position: np.ndarray = STRAIGHT,
    velocity: np.ndarray = STILL,
    time_s: float = 0.0,
    crank_rad: float = 0.0,
) -> tuple[Equations, np.ndarray]:
    """The equations at coordinates (N,) and rates (N,), and the first mechanism's state, (1, k), if it starts there."""
    motion = Motion(LAYOUT, prepared(mechanisms), np.zeros(1), np.full(1, crank_rad), [mechanisms])
    at = np.full((1, 1), time_s), position[None], velocity[None]
    states = motion.start_states(*at)
    return motion.equations(*at, states, 1e-3), states[0] if states else np.zeros((1, 0))


def added(
    mechanism: Mechanism, position: np.ndarray = STRAIGHT, velocity: np.ndarray = STILL, time_s: float = 0.0
) -> np.ndarray:
    """(N,) generalised force that a mechanism adds."""
    return (instant((mechanism,), position, velocity, time_s)[0].force - instant((), position, velocity)[0].force)[0]


def hinge_torque(force: np.ndarray) -> np.ndarray:
    """(h,) torque that bends each hinge, of a generalised force (N,) that is none on the whole fish."""
    return np.cumsum(force[::-1])[::-1][3:]


def of_one(mechanism: type[_M], *values: float) -> _M:
    """As it is in a running simulation: each number an array (1, 1)."""
    return mechanism(*(np.array([[value]]) for value in values))
