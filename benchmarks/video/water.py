"""Pool: a tiled floor seen through moving water, with the caustics of the same waves."""

from __future__ import annotations

import cv2
import numpy as np

from benchmarks.video.picture import Picture, colour_of
from swimcal.robot import NonNegative
from swimcal.toml import TomlTable

TINT = colour_of(78, 152, 186)
"""The floor's blue under water."""

_WAVES = 48
_GRAVITY_M_S2 = 9.81
_TENSION_M3_S2 = 7.3e-5  # surface tension of water over its density
_DEPTH_M = 0.5
_REFRACTION = 0.25  # A ray leaves the water's normal by 1 - 1/n of the slope.
_COARSE_PX = 4  # step of the grid of waves
_WIDE_PX = 2000  # In wider pictures the step is twice that.
_TILE_M = 0.15
_GROUT_M = 0.004
_LANE_M = 0.12  # width of the lane


class WaterLook(TomlTable):
    """Look of the water."""

    ripple_mm: NonNegative = 2.0  # standard deviation of the surface
    caustics: NonNegative = 0.3  # brightness of the light that the waves gather on the floor; 0 for none
    sheen: NonNegative = 30.0  # brightness of the sky in the waves' slopes


class Water:
    """Painter of the pool at any time.

    The surface is a sum of plane waves with the dispersion of deep water, w^2 = g k + (sigma / rho) k^3 (Lighthill
    1978, Waves in Fluids, sec. 3.4). The floor shows displaced by the slope, and lit by the inverse of how the slope
    spreads the light: 1 / |det(1 - d hessian)|.

    Args:
        look: look of the water.
        width_px: width of the picture.
        height_px: height of the picture.
        px_per_m: scale of the picture.
        seed: seed of waves and tiles.
    """

    def __init__(self, look: WaterLook, width_px: int, height_px: int, px_per_m: float, seed: int) -> None:
        random = np.random.default_rng([seed, 1])
        self._look, self._px_per_m = look, px_per_m
        self._halved = 2 if width_px > _WIDE_PX else 1
        step_px = _COARSE_PX * self._halved
        self._size = (width_px // self._halved, height_px // self._halved)
        self._make_waves(random, np.arange(0, width_px, step_px), np.arange(0, height_px, step_px))
        self._floor = _paint_floor(*self._size, px_per_m / self._halved, random)
        x, y = np.meshgrid(*(np.arange(n, dtype=np.float32) for n in self._size))
        self._place = np.stack([x, y], axis=-1)

    def paint(self, picture: Picture, time_s: float, shadow: np.ndarray) -> None:
        """Fill a picture with the pool.

        Args:
            picture: picture to fill.
            time_s: time of the waves.
            shadow: (k, c, 2) corners of convex shapes that keep the light from the floor, px.
        """
        slope, light, sheen = self._compute_surface(time_s)
        light *= self._shade(shadow, light.shape)
        width, height = self._size
        shift_px = slope * np.float32(_DEPTH_M * _REFRACTION * self._px_per_m / self._halved)
        place = self._place + cv2.resize(shift_px, (width, height))
        floor = cv2.remap(self._floor, place[..., 0], place[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT)
        lit = floor * cv2.resize(light, (width, height)) + cv2.resize(sheen, (width, height))
        luma = cv2.convertScaleAbs(lit)  # rounds, and stays within 0 to 255
        cv2.resize(luma, (picture.width_px, picture.height_px), dst=picture.luma, interpolation=cv2.INTER_LINEAR)
        np.minimum(picture.luma, 235, out=picture.luma)
        picture.blue[:], picture.red[:] = round(TINT.blue), round(TINT.red)

    def _make_waves(self, random: np.random.Generator, x_px: np.ndarray, y_px: np.ndarray) -> None:
        """Draw plane waves of 7 to 60 cm, from all sides, the longer the higher."""
        length_m = np.exp(random.uniform(np.log(0.07), np.log(0.6), _WAVES))
        angle, self._phase = 2 * np.pi * random.random((2, _WAVES))
        number = 2 * np.pi / length_m
        height = length_m**1.5 * random.uniform(0.5, 1.0, _WAVES)
        self._height = 1e-3 * self._look.ripple_mm * height * np.sqrt(2 / np.sum(height**2))
        self._turn = np.sqrt(_GRAVITY_M_S2 * number + _TENSION_M3_S2 * number**3)  # rad/s
        self._kx, self._ky = number * np.cos(angle), number * np.sin(angle)
        along_x, along_y = (np.outer(k, place) / self._px_per_m for k, place in ((self._kx, x_px), (self._ky, y_px)))
        self._along_x = np.vstack([np.cos(along_x), np.sin(along_x)]).astype(np.float32)  # (2 waves, w)
        self._along_y = np.exp(1j * along_y).T  # (h, waves)

    def _compute_surface(self, time_s: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return (h, w, 2) slope, (h, w) light on the floor and (h, w) luma of the sky's reflection."""
        now = self._height * np.exp(1j * (self._phase - self._turn * time_s))
        kx, ky = self._kx, self._ky
        factors = np.array([1j * kx, 1j * ky, -kx * kx, -ky * ky, -kx * ky])
        slope_x, slope_y, bend_x, bend_y, twist = self._sum_waves(factors * now)
        reach = np.float32(_DEPTH_M * _REFRACTION * 1.6)
        spread = (1 + reach * bend_x) * (1 + reach * bend_y) - (reach * twist) ** 2
        gathered = 1 / (np.abs(spread) + np.float32(0.25))
        light = 1 + np.float32(self._look.caustics) * (np.minimum(gathered, 3.0) - np.float32(0.8))
        sheen = np.float32(self._look.sheen) * np.maximum(8 * (0.8 * slope_x + 0.6 * slope_y), -0.3)
        return np.stack([slope_x, slope_y], axis=-1), light, sheen

    def _sum_waves(self, amplitude: np.ndarray) -> np.ndarray:
        """Return (c, h, w) float32 real parts of sums of amplitude (c, waves) * exp(i (kx x + ky y)): one product."""
        turned = amplitude[:, None] * self._along_y  # (c, h, waves)
        flat = turned.reshape(-1, turned.shape[-1])
        both = np.hstack([flat.real, -flat.imag]).astype(np.float32)
        return (both @ self._along_x).reshape(*turned.shape[:2], -1)

    def _shade(self, shadow: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
        """Return (h, w) what a soft shadow leaves of the light."""
        mask = np.ones(shape, np.float32)
        step_px = _COARSE_PX * self._halved
        for outline in shadow:
            cv2.fillConvexPoly(mask, cv2.convexHull(np.round(outline / step_px).astype(np.int32)), 0.55)
        return cv2.GaussianBlur(mask, (0, 0), 0.012 * self._px_per_m / step_px)


def _paint_floor(width: int, height: int, px_per_m: float, random: np.random.Generator) -> np.ndarray:
    """Return (h, w) float32 luma of the floor: a slow gradient, tiles each a little different, a lane, a vignette."""
    scale = px_per_m * 0.8  # the floor is further away than the water
    turn = 0.12  # angle of the tiles against the picture, rad
    x, y = np.meshgrid((np.arange(width) - width / 2) / scale, (np.arange(height) - height / 2) / scale)
    along, across = x * np.cos(turn) - y * np.sin(turn) + 10, x * np.sin(turn) + y * np.cos(turn) + 10
    column, row = (along / _TILE_M).astype(int), (across / _TILE_M).astype(int)
    shade = 1 + 0.03 * random.standard_normal((256, 256))[column % 256, row % 256]
    to_grout = np.minimum(*(np.minimum(c % _TILE_M, _TILE_M - c % _TILE_M) for c in (along, across)))
    shade *= 1 + 0.12 * np.clip(1.5 - to_grout / _GROUT_M, 0, 1)
    shade *= 1 - 0.45 * np.clip((_LANE_M / 2 - np.abs(across - 10.55)) * scale, 0, 1)
    shade *= 1 + 0.05 * x - 0.04 * y
    shade *= 1 - 0.15 * (x * x + y * y) / np.max(x * x + y * y)
    return cv2.GaussianBlur((TINT.luma * shade).astype(np.float32), (0, 0), 0.6)
