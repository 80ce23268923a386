"""How far boxes sit from their markers, and markers from their places, as the trials themselves show it.

Whoever placed them knows it no better. Both decide where markers are in the mean; how these means differ from the
twin's, over all markers of all trials, tells the sizes of their offsets (an empirical Bayes estimate; Robbins 1956):
what trials have in common is the markers', what they differ by the boxes'.
"""

import numpy as np
from scipy.optimize import minimize

from fitting.model.features import of_markers
from fitting.model.session_model import NuisanceModel, PlacementUncertainty

TAKEN = PlacementUncertainty(box_m=0.003, marker_m=0.001)
"""Before the trials are looked at: boxes a few pixels, markers as well as a ruler places them."""

_LN_SD = 0.7  # of either size
_ENDS_M = (1e-4, 0.05)
_STARTS = ((1.0, 1.0), (3.0, 1.0), (1.0, 10.0))  # times what is taken


def placement_uncertainty(
    residual: np.ndarray, trials: int, disturbances: NuisanceModel, marker_m: float | None = None
) -> PlacementUncertainty:
    """The likeliest sizes.

    Args:
        residual: (k,) measured less simulated row of features.
        trials: how many stand in the row.
        disturbances: of the row.
        marker_m: that of markers, where it is known; default: found too.
    """
    means = mean_places(len(residual), trials)
    off, fixed = residual[means], disturbances.fixed[np.ix_(means, means)]
    boxes, markers = (part @ part.T for part in (disturbances.per_box[means], disturbances.per_marker[means]))
    taken = np.log(TAKEN)

    def deviance(ln_sd: np.ndarray) -> float:
        covariance = fixed + np.exp(2 * ln_sd[0]) * boxes + np.exp(2 * ln_sd[1]) * markers
        prior = (((ln_sd - taken) / _LN_SD) ** 2).sum()
        return float(off @ np.linalg.solve(covariance, off) + np.linalg.slogdet(covariance)[1] + prior)

    ends = [tuple(np.log(_ENDS_M)), tuple(np.log(_ENDS_M if marker_m is None else (marker_m, marker_m)))]
    found = [
        minimize(deviance, taken + np.log(start), method="L-BFGS-B", bounds=ends, options={"ftol": 1e-7})
        for start in _STARTS
    ]
    return PlacementUncertainty(*map(float, np.exp(min(found, key=lambda each: float(each.fun)).x)))


def mean_places(length: int, trials: int) -> np.ndarray:
    """(2 m t,) where a row of so many features, of length k, holds the means of its markers."""
    return of_markers(np.arange(length).reshape(trials, -1))[..., 0].ravel()
