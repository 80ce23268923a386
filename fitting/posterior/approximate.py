"""Intervals of the coefficients by some other way than the posterior itself."""

from typing import NamedTuple

import numpy as np


class Approximate(NamedTuple):
    """(5,) middle and the ends of a 90 % interval of each coefficient; nan where the way gives none."""

    middle: np.ndarray
    q05: np.ndarray
    q95: np.ndarray
