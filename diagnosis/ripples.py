"""What a crank, or a clock, that does not run evenly does to features."""

import numpy as np

from fitting.model.features import HARMONICS, advanced, harmonics_of, of_markers


def rippled(features: np.ndarray) -> np.ndarray:
    """(g, 4) how features (g,) changes, over rad, whose crank runs ahead by a cosine or sine of one turn or of two."""
    return np.column_stack([_ahead(features, order, sine) for order in (1, 2) for sine in (False, True)])


def _ahead(features: np.ndarray, order: int, sine: bool) -> np.ndarray:
    """(g,) how features changes, over rad, whose crank runs ahead by a cosine, or sine, of `order` turns."""
    step = 1e-4
    slope = (advanced(features, step) - advanced(features, -step)) / (2 * step)
    rates = harmonics_of(slope)  # (m, 2, 3) complex, Re(rate exp(i h turn))
    ahead = -1j if sine else 1.0 + 0j
    result = np.zeros_like(features)
    beats = of_markers(result)
    for h in range(1, HARMONICS + 1):
        rate = rates[..., h - 1]
        for other, product in ((h + order, ahead * rate / 2), (h - order, np.conj(ahead) * rate / 2)):
            number, told = (other, product) if other >= 0 else (-other, np.conj(product))
            if number == 0:
                beats[..., 0] += told.real
            elif number <= HARMONICS:
                beats[..., 2 * number - 1] += told.real
                beats[..., 2 * number] -= told.imag
    return result
