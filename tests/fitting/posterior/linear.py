"""A mode of features that are linear in the roots of the coefficients: its posterior is known."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np

from fitting.covariance import COEFFICIENT_SD, COMPONENTS, MEDIANS, Covariance
from fitting.features import SPEED
from fitting.mode import Mode

TRUTH, LENGTH, SD = np.array([0.5, 7.0, 2.0, 4.0, 5.5]), 30, 0.02


def linear_mode(seed: int, off_sd: float = 0.0) -> tuple[Mode, np.ndarray, np.ndarray]:
    """The mode, and the mean (5,) and covariance (5, 5) of the roots of the coefficients given what was measured.

    Args:
        seed: of the measurement.
        off_sd: by which the mode is put beside where it should be, in standard deviations of each root.
    """
    random = np.random.default_rng(seed)
    slopes = random.standard_normal((LENGTH, 5))
    measured = slopes @ np.sqrt(TRUTH) + SD * random.standard_normal(LENGTH)
    covariance = SD**2 * np.linalg.inv(slopes.T @ slopes)
    mean = covariance @ slopes.T @ measured / SD**2
    at = (mean + off_sd * np.sqrt(np.diag(covariance))) ** 2
    units = {component.name: np.zeros((LENGTH, LENGTH)) for component in COMPONENTS}
    units["speed_own"][SPEED, SPEED] = 1e-9
    jacobian = slopes / (2 * np.sqrt(at))
    information = jacobian.T @ jacobian / SD**2 + COEFFICIENT_SD**-2.0 * np.eye(5)
    mode = SimpleNamespace(
        model=SimpleNamespace(
            measured=measured,
            simulated=lambda points: np.sqrt(points) @ slopes.T,
            swim_forward=lambda points: np.ones(len(points), bool),
        ),
        coefficients=at,
        sizes=MEDIANS,
        covariance=Covariance(SD**2 * np.eye(LENGTH), np.zeros((LENGTH, 2)), units),
        coefficient_covariance=np.linalg.inv(information),
        residual=measured - slopes @ np.sqrt(at),
        blocks=(None,),
    )
    return cast(Mode, mode), mean, covariance
