"""Simulations that every effect is tried on."""

import numpy as np

from swimcal.effects.affected_twin import AffectedRuns, AffectedTwin
from swimcal.effects.effect import Effect, View
from swimcal.robot import load_robot
from swimcal.runs import Runs
from swimcal.twin import Twin

ROBOT = load_robot()
TIME_S = np.arange(0.0, 1.5, 1 / 30)
VIEW = View(axis_m=np.array([0.3, 0.1]), down=np.array([0.6, 0.8]), half_height_m=0.8)
PLAIN = Twin(ROBOT, workers=1)
COUNT = 3
EVEN = {
    "coefficients": np.tile([0.4, 2.0, 6.0, 4.0, 1.0], (COUNT, 1)),
    "frequency_hz": np.array([0.6, 0.9, 1.2]),
    "phase_rad": np.array([0.0, 1.0, 4.0]),
    "velocity": np.tile([-0.05, 0.0, 0.0], (COUNT, 1)),
}


def plain_runs() -> Runs:
    return Runs(**EVEN)


def runs_with(values: np.ndarray) -> AffectedRuns:
    """All with the same values (p,)."""
    return AffectedRuns(**EVEN, values=np.tile(values, (COUNT, 1)))


def with_effect(effect: Effect, values: np.ndarray, twin: Twin = PLAIN) -> tuple[np.ndarray, np.ndarray]:
    """(n, f, m, 2) markers as simulated and as observed."""
    affected, runs = AffectedTwin(twin, [effect]), runs_with(values)
    simulated = affected.simulate(runs, TIME_S)
    return simulated.marker_m, affected.observed(runs, simulated, VIEW)
