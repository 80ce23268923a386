"""Tail motions in closed form, whose frequency is known, and the noise of tracked boxes."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from scipy.signal import lfilter

FPS = 60.0
PIXEL_M = 1.0e-3
AMPLITUDE_M = np.array([0.01, 0.02, 0.03, 0.045, 0.06])


class Tail(NamedTuple):
    """Lateral motion of five tail markers.

    Attributes:
        time_s: (n,) s.
        lateral_m: (n, 5) m.
        weight: (n, 5).
    """

    time_s: np.ndarray
    lateral_m: np.ndarray
    weight: np.ndarray


def tail(
    hz: float,
    beats: float,
    *,
    fps: float = FPS,
    harmonics: tuple[float, ...] = (1.0, 0.15, 0.1),
    drift: float = 0.0,
) -> Tail:
    """A wave running down the tail.

    Args:
        hz: beats a second.
        beats: how many.
        fps: frames a second.
        harmonics: amplitude of each, relative to the first.
        drift: of the last marker over the whole recording, m.
    """
    time_s = np.arange(round(beats / hz * fps) + 1) / fps
    lag = np.linspace(0.3, 2.1, len(AMPLITUDE_M))
    angle = 2 * np.pi * hz * time_s[:, None] - lag
    wave = sum(size * np.sin((k + 1) * angle + 0.7 * k) for k, size in enumerate(harmonics))
    slope = drift * (time_s / time_s[-1])[:, None] * AMPLITUDE_M / AMPLITUDE_M[-1]
    return Tail(time_s, AMPLITUDE_M * wave + slope, np.ones((len(time_s), len(AMPLITUDE_M))))


def box_noise(
    shape: tuple[int, int], correlation: float, random: np.random.Generator, sd_m: float = 0.7 * PIXEL_M
) -> np.ndarray:
    """(n, k) AR(1) errors with this correlation from frame to frame; a third of the variance is common (the head)."""
    frames, markers = shape
    fresh = random.normal(size=(frames, markers + 1))
    fresh[1:] *= np.sqrt(1 - correlation**2)
    lasting = lfilter([1.0], [1.0, -correlation], fresh, axis=0)
    return sd_m * (np.sqrt(2 / 3) * lasting[:, 1:] + np.sqrt(1 / 3) * lasting[:, :1])


def on_half_pixels(lateral_m: np.ndarray) -> np.ndarray:
    return np.round(2 * lateral_m / PIXEL_M) / 2 * PIXEL_M


def noisy(clean: Tail, correlation: float, random: np.random.Generator, **noise: Any) -> Tail:
    """The tail as boxes on a half-pixel grid see it."""
    seen = on_half_pixels(clean.lateral_m + box_noise(clean.lateral_m.shape, correlation, random, **noise))
    return clean._replace(lateral_m=seen)
