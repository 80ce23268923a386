"""How far boxes sit from their markers, as the trials themselves show it: whoever placed them knows it no better.

Boxes decide where markers are in the mean; how these means differ from the twin's, over all markers of all trials,
tells the size of their offsets (an empirical Bayes estimate; Robbins 1956).
"""

import numpy as np
from scipy.optimize import minimize_scalar

from fitting.posterior.gait import OF_A_MARKER, SPEED
from fitting.posterior.session_model import Disturbances

BOX_SD_M = 0.003  # of a box from its marker, each way in the picture: a few pixels, before the trials are looked at
_LN_SD = 0.7  # of that size
_ENDS_M = (1e-4, 0.05)


def box_size(left: np.ndarray, trials: int, disturbances: Disturbances) -> float:
    """The likeliest standard deviation of boxes, each way, m.

    Args:
        left: (k,) measured less simulated row of gaits.
        trials: how many stand in the row.
        disturbances: of the row.
    """
    means = mean_places(len(left), trials)
    among = np.ix_(means, means)
    off, fixed, boxes = left[means], disturbances.fixed[among], disturbances.boxes[among]

    def deviance(ln_sd: float) -> float:
        covariance = fixed + np.exp(2 * ln_sd) * boxes
        prior = ((ln_sd - np.log(BOX_SD_M)) / _LN_SD) ** 2
        return float(off @ np.linalg.solve(covariance, off) + np.linalg.slogdet(covariance)[1] + prior)

    found = minimize_scalar(deviance, bounds=tuple(np.log(_ENDS_M)), method="bounded", options={"xatol": 0.01})
    return float(np.exp(found.x))


def mean_places(length: int, trials: int) -> np.ndarray:
    """(2 m t,) where a row of so many gaits, of length k, holds the means of its markers."""
    places = np.arange(length).reshape(trials, -1)[:, SPEED + 1 :]
    return np.asarray(places[:, ::OF_A_MARKER].ravel())
