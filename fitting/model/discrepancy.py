"""How features differ from the twin's where its wave or its speed is off by a share of itself."""

import numpy as np

from fitting.model.features import HARMONICS, harmonics_of

_LENGTH_M = 0.12  # over which discrepancies along the body are alike
_OF_ITS_OWN = 0.2  # share of a discrepancy's variance that each marker has to itself
_OF_HARMONIC = 0.5  # discrepancy of each harmonic over that of the one before


def wave_discrepancy(measured: np.ndarray, position_m: np.ndarray) -> np.ndarray:
    """(k, k) covariance of a twin whose wave is off by 100 %, for one measured features (k,) of m markers.

    Of each marker the first harmonic by its own size, higher ones by half of the one before, alike for neighbours along
    the body. Means do not count: they are those of the boxes.

    Args:
        measured: (k,).
        position_m: (m,) of each marker along the body.
    """
    first = np.sqrt((np.abs(harmonics_of(measured)[..., 0]) ** 2).sum(axis=-1) / 2)  # (m,)
    size = np.maximum(first, 0.1 * first.max())
    smooth = np.exp(-0.5 * ((position_m[:, None] - position_m) / _LENGTH_M) ** 2)
    correlation = (1 - _OF_ITS_OWN) * smooth + _OF_ITS_OWN * np.eye(len(size))
    of_column = np.append(0.0, np.repeat(_OF_HARMONIC ** np.arange(HARMONICS), 2)) ** 2  # (7,)
    total = np.zeros((len(measured),) * 2)
    total[1:, 1:] = np.kron(np.outer(size, size) * correlation, np.diag(np.tile(of_column, 2)))
    return total
