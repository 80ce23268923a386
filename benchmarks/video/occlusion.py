"""Occlusions: a pole held over a marker for some frames."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from benchmarks.video.picture import Picture, Region, colour_of
from swimcal.toml import TomlTable

_COLOUR = colour_of(120, 96, 70)  # wood
_SHINE = colour_of(182, 156, 122)  # the lit side of the wood
_SWEEP_PX = 60.0  # The tip comes and goes by this a frame.
_LONG_PX = 4000.0
_RADIUS_PX = 24.0  # Neighbours within it are covered too.
_DIRECTION = np.array([np.cos(np.radians(70.0)), -np.sin(np.radians(70.0))])  # unit vector along the pole, y down


class Occlusion(TomlTable):
    """A pole, with a round tip, that covers a marker."""

    marker: str  # marker over which the tip is held, following it
    first: Annotated[int, Field(ge=0)]  # first frame in which the marker is wholly covered
    frames: Annotated[int, Field(ge=1)]  # number of such frames in a row

    def tip_px(self, frame: int, target_px: np.ndarray) -> np.ndarray:
        """Return the (2,) middle of the tip in a frame, for a marker at (2,): beyond it while it is covered."""
        away = max(self.first - frame, frame - (self.first + self.frames - 1), 0)
        return target_px + _DIRECTION * (_SWEEP_PX * away - 0.25 * _RADIUS_PX)

    def cover(self, region: Region, tip_px: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return (h, w) float32 cover of a region's pixels, and where across the pole each is, -1 to 1."""
        x, y = region.grid()
        dx, dy = x - tip_px[0], y - tip_px[1]
        along = np.clip(dx * _DIRECTION[0] + dy * _DIRECTION[1], 0, _LONG_PX)
        off_x, off_y = dx - along * _DIRECTION[0], dy - along * _DIRECTION[1]
        cover = np.clip(_RADIUS_PX + 0.5 - np.hypot(off_x, off_y), 0, 1)
        across = (off_y * _DIRECTION[0] - off_x * _DIRECTION[1]) / _RADIUS_PX
        return cover.astype(np.float32), across.astype(np.float32)

    def paint(self, picture: Picture, tip_px: np.ndarray) -> None:
        """Paint the pole where its tip is in the picture or near it."""
        size = np.array([picture.width_px, picture.height_px])
        if (tip_px < -_RADIUS_PX).any() or (tip_px > size + _RADIUS_PX).any():
            return
        end = tip_px + _LONG_PX * _DIRECTION
        region = picture.region(np.minimum(tip_px, end) - _RADIUS_PX, np.maximum(tip_px, end) + _RADIUS_PX)
        cover, across = self.cover(region, tip_px)
        picture.blend(region, cover, _COLOUR)
        picture.blend(region, cover * np.clip(1 - 2.5 * (across - 0.3) ** 2, 0, 1) * np.float32(0.7), _SHINE)
