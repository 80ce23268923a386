"""Fish made by hand: a wave runs down a body that cruises, at frames of a camera."""

from __future__ import annotations

import numpy as np

from fitting.features import FeatureReader

ALONG_M = np.array([0.0, 0.142, 0.25, 0.32, 0.40, 0.48, 0.55])
FPS, SECONDS, HZ, SPEED_M_S = 60.0, 4.0, 1.1, 0.12
TIME_S = 1.0 + np.arange(round(FPS * SECONDS) + 1) / FPS
TURN_RAD = 2 * np.pi * HZ * TIME_S
AMPLITUDE_M = np.array([0.0, 0.0, 0.004, 0.012, 0.022, 0.035, 0.05])
LAG_RAD = np.linspace(0.0, 2.0, len(ALONG_M))


def reader(usable: np.ndarray | None = None) -> FeatureReader:
    """Of all frames; nose and neck come first."""
    return FeatureReader(
        TIME_S, TURN_RAD, np.ones((len(TIME_S), len(ALONG_M)), bool) if usable is None else usable, 0, 1
    )


def shape() -> np.ndarray:
    """(n, m) x + i y of each marker from the nose of a fish that heads to the right."""
    first = AMPLITUDE_M * np.cos(TURN_RAD[:, None] - LAG_RAD)
    return -ALONG_M + 1j * (first + 0.1 * AMPLITUDE_M * np.sin(3 * TURN_RAD[:, None]))


def pool(place: np.ndarray) -> np.ndarray:
    """(n, m, 2) of complex places."""
    return np.stack([place.real, place.imag], axis=-1)


def cruising() -> np.ndarray:
    """(n, m, 2) straight on."""
    return pool(SPEED_M_S * TIME_S[:, None] + shape())
