"""One joint assignment of spots to markers: no two markers ever share a spot."""

import numpy as np
from scipy.optimize import linear_sum_assignment

from tracking.tracker.prediction import Prediction
from tracking.tracker.spots import Spots

_MISSED = 2.0  # the price of leaving a marker without a spot
_FAINT = 0.5  # the price of a spot of no strength


def assign(spots: Spots, predicted: Prediction) -> np.ndarray:
    """Which spot is which marker, at the least total cost.

    The cost of a pair is the squared distance in gates plus a price for a spot fainter than the marker; a pair beyond
    the gate is never made, and a marker may go without.

    Args:
        spots: c spots.
        predicted: of m markers.

    Returns:
        (m,) int, the number of each marker's spot, -1 for none.
    """
    m, c = len(predicted.gate_px), len(spots.strength)
    distance = np.linalg.norm(predicted.position_px[:, None] - spots.position_px[None], axis=2)  # (m, c)
    cost = (distance / predicted.gate_px[:, None]) ** 2 + _FAINT * np.clip(1 - spots.strength, 0, 1)[None]
    cost = np.where(distance <= predicted.gate_px[:, None], cost, 1e6)
    alone = np.where(np.eye(m, dtype=bool), _MISSED, 1e6)  # each marker's own way out
    rows, columns = linear_sum_assignment(np.hstack([cost, alone]))
    chosen = np.full(m, -1)
    chosen[rows] = np.where(columns < c, columns, -1)
    return chosen
