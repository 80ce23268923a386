"""Simulations set up by hand, below `benchmarks.reality.simulate`."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.reality.instant import Instant
from benchmarks.reality.integrate import step
from benchmarks.reality.layout import Layout, lay_out
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.motion import Motion
from benchmarks.reality.parameters import Parameters, nominal_parameters
from swimcal.robot import load_robot

COEFFICIENTS = (0.4, 2.0, 6.0, 4.0, 1.0)


def fish(hinges_per_gap: int = 2, coefficients: tuple[float, ...] = COEFFICIENTS) -> tuple[Layout, Parameters]:
    """Layout and one row of parameters."""
    layout = lay_out(load_robot(), hinges_per_gap)
    return layout, nominal_parameters(layout, ("nose", "neck"), coefficients)


def without_tendons(parameters: Parameters, **changed: Any) -> Parameters:
    none = np.zeros_like(parameters.tendon_stiffness_n_m)
    return replace(parameters, tendon_stiffness_n_m=none, tendon_damping_n_s_m=none, **changed)


def moving(layout: Layout, parameters: Parameters, mechanisms: Sequence[Mechanism] = ()) -> Motion:
    """One simulation with its crank at rest."""
    return Motion(layout, parameters, np.zeros(1), np.zeros(1), [mechanisms])


def roll(
    motion: Motion,
    position: np.ndarray,
    velocity: np.ndarray,
    seconds: float,
    step_s: float,
    look: Callable[[Instant, np.ndarray, np.ndarray], Any],
) -> list[Any]:
    """What `look` sees at every step of one simulation from coordinates (N,) and rates (N,)."""
    position, velocity = position[None], velocity[None]
    states = motion.start_states(np.zeros((1, 1)), position, velocity)
    seen = []
    for k in range(round(seconds / step_s) + 1):
        later, faster, at = step(motion, np.full((1, 1), k * step_s), position, velocity, states, step_s)
        seen.append(look(at.now, position[0], velocity[0]))
        states = motion.advanced(at, states, step_s)
        position, velocity = later, faster
    return seen
