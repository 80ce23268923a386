"""Glints: specular spots on the water, as bright and as large as a marker, that drift and flicker."""

from __future__ import annotations

import numpy as np

from benchmarks.video.picture import Picture, Region, colour_of

_WHITE = colour_of(245, 250, 255)
_LIFE_S = (0.08, 0.5)
_DRIFT_PX_S = 90.0
_NEAR_PX = 70.0
_SHARE_NEAR = 0.6


class Glints:
    """A fixed set of glints over a clip.

    Args:
        per_s: number of glints that appear in a second.
        time_s: (n,) times of the frames.
        path_px: (n, m, 2) places of the markers; most glints appear near one of them.
        size_px: width and height of the picture.
        random: source of the draws.
    """

    def __init__(
        self,
        per_s: float,
        time_s: np.ndarray,
        path_px: np.ndarray,
        size_px: tuple[int, int],
        random: np.random.Generator,
    ) -> None:
        count = round(per_s * (time_s[-1] - time_s[0]))
        frame = random.integers(0, len(time_s), count)
        marker = random.integers(0, path_px.shape[1], count)
        near = path_px[frame, marker] + _NEAR_PX * random.standard_normal((count, 2))
        anywhere = random.random((count, 2)) * size_px
        self._middle_s = time_s[frame]
        self._place_px = np.where(random.random((count, 1)) < _SHARE_NEAR, near, anywhere)
        self._drift_px_s = _DRIFT_PX_S * random.standard_normal((count, 2))
        self._life_s = random.uniform(*_LIFE_S, count)
        self._flicker_hz = random.uniform(3.0, 14.0, count)
        self._radii_px = random.uniform(5.0, 14.0, (count, 1)) * np.stack(
            [np.ones(count), random.uniform(0.35, 1.0, count)], axis=1
        )
        self._turn = np.pi * random.random(count)

    def paint(self, picture: Picture, time_s: float) -> None:
        """Paint those that shine at a time."""
        age_s = time_s - self._middle_s
        fade = np.clip(1 - np.abs(age_s) / self._life_s, 0, 1)
        shine = np.minimum(1.0, 2.0 * fade) * (0.65 + 0.35 * np.sin(2 * np.pi * self._flicker_hz * age_s))
        for i in np.flatnonzero(shine > 0.03).tolist():
            self._paint_one(picture, i, self._place_px[i] + age_s[i] * self._drift_px_s[i], shine[i])

    def _paint_one(self, picture: Picture, i: int, centre_px: np.ndarray, shine: float) -> None:
        reach = self._radii_px[i].max() + 4
        region: Region = picture.region(centre_px - reach, centre_px + reach)
        if region.empty:
            return
        x, y = region.grid()
        dx, dy = x - np.float32(centre_px[0]), y - np.float32(centre_px[1])
        cos, sin = np.cos(self._turn[i]), np.sin(self._turn[i])
        along, across = (dx * cos + dy * sin) / self._radii_px[i, 0], (dy * cos - dx * sin) / self._radii_px[i, 1]
        cover = np.exp(-((along * along + across * across) ** 2))  # flat on top, soft at the edge
        picture.blend(region, (shine * cover).astype(np.float32), _WHITE)
