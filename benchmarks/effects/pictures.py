"""Faults of a camera, a clock or a tracker, put into tracks in pixels: of a simulated film, or of a real one."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline


@dataclass(frozen=True, eq=False)
class PixelTracks:
    """Tracks as a camera gives them.

    Attributes:
        time_s: (n,) stamps of the frames.
        position_px: (n, m, 2) pixels, y down.
        markers: names of the m markers, nose and neck among them.
        px_per_m: pixels of one metre.
        size_px: (2,) width and height of the picture.
    """

    time_s: np.ndarray
    position_px: np.ndarray
    markers: tuple[str, ...]
    px_per_m: float
    size_px: np.ndarray

    def across(self, marker: str) -> np.ndarray:
        """Return unit vectors (n, 2) in the picture across the body at a marker, which lies between its neighbours."""
        at = self.markers.index(marker)
        before, behind = max(at - 1, 0), min(at + 1, len(self.markers) - 1)
        if marker == "neck":  # It rides on the head, and what follows it may not.
            behind = at
        along = self.position_px[:, behind] - self.position_px[:, before]
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        return np.stack([-along[:, 1], along[:, 0]], axis=1)

    def moved(self, marker: str, by_px: np.ndarray) -> "PixelTracks":
        """Return tracks with one marker moved by (n, 2) pixels."""
        position_px = self.position_px.copy()
        position_px[:, self.markers.index(marker)] += by_px
        return replace(self, position_px=position_px)


PictureFault = Callable[[PixelTracks], PixelTracks]
"""Fault of a camera, a clock or a tracker: a function of tracks."""


def offset(marker: str, across_m: float) -> PictureFault:
    """Put a marker aside by a length."""
    return lambda tracks: tracks.moved(marker, across_m * tracks.px_per_m * tracks.across(marker))


def drift(marker: str, speed_m_s: float) -> PictureFault:
    """Let a marker creep aside at a speed."""

    def fault(tracks: PixelTracks) -> PixelTracks:
        way_m = speed_m_s * (tracks.time_s - tracks.time_s[0])
        return tracks.moved(marker, way_m[:, None] * tracks.px_per_m * tracks.across(marker))

    return fault


def lens(k1: float) -> PictureFault:
    """Draw a radius r at r (1 + k1 r^2), where r is 1 at the picture's lower edge."""

    def fault(tracks: PixelTracks) -> PixelTracks:
        from_middle = tracks.position_px - tracks.size_px / 2
        radius = np.linalg.norm(from_middle, axis=-1, keepdims=True) / (tracks.size_px[1] / 2)
        return replace(tracks, position_px=tracks.size_px / 2 + from_middle * (1 + k1 * radius**2))

    return fault


def clock(factor: float) -> PictureFault:
    """Stamp the frames as if a second lasted `factor` seconds."""
    return lambda tracks: replace(tracks, time_s=tracks.time_s * factor)


def shutter(readout_s: float) -> PictureFault:
    """Expose the lowest line by the readout later than the highest."""

    def fault(tracks: PixelTracks) -> PixelTracks:
        seen = tracks.position_px
        paths = [CubicSpline(tracks.time_s, tracks.position_px[:, k]) for k in range(len(tracks.markers))]
        for _ in range(3):  # The place that a marker is seen at decides when it is seen.
            late_s = readout_s * seen[..., 1] / tracks.size_px[1]
            seen = np.stack([path(tracks.time_s + late_s[:, k]) for k, path in enumerate(paths)], axis=1)
        return replace(tracks, position_px=seen)

    return fault


def shaken(amplitude_px: float, hz: float = 0.37) -> PictureFault:
    """Move the camera to and fro."""

    def fault(tracks: PixelTracks) -> PixelTracks:
        sway_px = amplitude_px * np.sin(2 * np.pi * hz * tracks.time_s)
        return replace(tracks, position_px=tracks.position_px + sway_px[:, None, None])

    return fault
