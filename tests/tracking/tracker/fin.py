"""Clips of a fish whose caudal fin beats fast, in colour and H.264, drawn apart from `benchmarks.video` and `pool`.

All that moves is averaged over the exposure, so that the dots are smeared over the rim of the body as in a camera.
"""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import cv2
import numpy as np
import xarray as xr

from benchmarks.video.writer import VideoWriter
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.robot import load_robot
from swimcal.tracks import pixels_of
from tracking.boxes import Box, StartBoxes
from tracking.tracked import SampleState

_PLACE_M = load_robot().marker_positions_m(FISHSIM_MARKERS)[:, 0] + ([0.077] * 8 + [0.117])  # behind the nose
_ROOT_M, _FINE_M = 0.3, np.linspace(-0.05, _PLACE_M[-1] + 0.05, 400)
_WIDE = 1.1  # half width of the body at the markers, diameters
_MOMENTS = (np.arange(16) + 0.5) / 16 - 0.5  # shares of the exposure
Colour = tuple[float, float, float]


@dataclass(frozen=True)
class FinClip:
    """A clip at 60 frames a second; lengths in px, times in frames, colours RGB.

    Attributes:
        hz: beats a second.
        fastest: of the caudal fin, px a frame.
        chain: the tail bends and keeps its length; else it swings sideways, and its markers move apart.
        scale: px a metre.
    """

    hz: float = 3.0
    fastest: float = 45.0
    chain: bool = False
    scale: float = 1100.0
    exposure: float = 0.45
    diameter: float = 17.0
    dot: Colour = (25, 25, 30)
    body: Colour = (235, 130, 30)
    water: Colour = (60, 95, 120)
    frames: int = 180
    size: tuple[int, int] = (960, 720)
    seed: int = 0

    def truth(self) -> np.ndarray:
        """(n, m, 2) mean places of the markers while each frame is exposed."""
        times = np.arange(self.frames)[:, None] + self.exposure * _MOMENTS
        return self._line(times.ravel(), _PLACE_M, self._bend).reshape(*times.shape, -1, 2).mean(axis=1)

    def picture(self, number: int) -> np.ndarray:
        """(h, w, 3) uint8 RGB."""
        behind = np.linspace(-0.02, _PLACE_M[-1] + 0.03, 80)
        thick = _WIDE * self.diameter * (1 + 1.5 * np.exp(-(((behind - 0.1) / 0.1) ** 2)))[:, None]
        line = self._line(number + self.exposure * _MOMENTS, np.concatenate([behind, _PLACE_M]), self._bend)
        corner = np.maximum(line.min(axis=(0, 1)) - thick.max() - 4, 0).astype(int)
        right, bottom = (line.max(axis=(0, 1)) + thick.max() + 4).astype(int)
        there = slice(corner[1], bottom), slice(corner[0], right)
        picture = self._water.copy()
        total = np.zeros_like(picture[there])
        for middle, dots in zip(line[:, :80] - corner, line[:, 80:] - corner, strict=True):
            moment = self._water[there].copy()
            ahead = np.gradient(middle, axis=0)
            aside = thick * np.stack([-ahead[:, 1], ahead[:, 0]], 1) / np.linalg.norm(ahead, axis=1)[:, None]
            outline = np.rint(256 * np.concatenate([middle + aside, (middle - aside)[::-1]])).astype(np.int32)
            cv2.fillPoly(moment, [outline], self.body, cv2.LINE_AA, 8)
            for dot in dots:
                _draw(moment, dot, self.diameter / 2, self.dot)
            total += moment
        picture[there] = total / len(_MOMENTS)
        picture = cv2.GaussianBlur(picture, (0, 0), 0.7)
        picture += np.random.default_rng([self.seed, number]).normal(0, 2.0, picture.shape[:2])[..., None]
        return np.clip(np.rint(picture), 0, 255).astype(np.uint8)

    def video(self, path: Path) -> Path:
        with VideoWriter(path, *self.size, crf=20) as writer:
            for number in range(self.frames):
                writer.write(self.picture(number))
        return path

    def boxes(self) -> StartBoxes:
        """As a person draws them: a third wider than the dots, and beside them by a pixel or two."""
        off = np.random.default_rng(self.seed).uniform(-1.5, 1.5, (len(_PLACE_M), 2))
        placed = zip(FISHSIM_MARKERS, self.truth()[0] + off, strict=True)
        return StartBoxes(0, {name: Box.around(centre, 1.3 * self.diameter) for name, centre in placed})

    @cached_property
    def _bend(self) -> float:
        """At which the caudal fin is as fast as wanted, by bisection."""
        low, high = 0.0, 3.0
        for _ in range(20):
            middle = (low + high) / 2
            path = self._line(np.linspace(0, 120, 1201), _PLACE_M[-1:], middle)[:, 0]
            fast = np.linalg.norm(np.diff(path, axis=0), axis=1).max() * 10 > self.fastest
            low, high = (low, middle) if fast else (middle, high)
        return low

    def _line(self, frame: np.ndarray, behind_m: np.ndarray, bend: float) -> np.ndarray:
        """(n, s, 2) places at times (n,) of what is so far (s,) behind the nose."""
        beat = 2 * np.pi * self.hz * frame[:, None] / 60
        tail = np.clip(_FINE_M - _ROOT_M, 0, None) / (_PLACE_M[-1] - _ROOT_M)
        wave = bend * np.sin(beat - 1.6 * tail)
        if self.chain:
            angle, step = wave * (0.4 * tail + 0.6 * tail**2), self.scale * (_FINE_M[1] - _FINE_M[0])
            fine = step * np.cumsum([np.cos(angle), np.sin(angle)], axis=2)
        else:
            sway = self.scale * 0.25 * wave * (0.2 * tail + 0.8 * tail**2)
            fine = np.stack([np.broadcast_to(self.scale * _FINE_M, sway.shape), sway])
        x, y = (np.stack([np.interp(behind_m, _FINE_M, row) for row in part]) for part in fine)
        cos, sin = np.cos(0.3 + 0.03 * np.sin(beat + 2)), np.sin(0.3 + 0.03 * np.sin(beat + 2))
        start = np.array([120.0, 150.0]) * self.size[0] / 960 + frame[:, None, None] * np.array([0.25, 0.1])
        return np.stack([cos * x - sin * y, sin * x + cos * y], -1) + start

    @cached_property
    def _water(self) -> np.ndarray:
        rough = np.random.default_rng([self.seed, 1]).normal(0, 1, self.size[::-1]).astype(np.float32)
        rough = cv2.GaussianBlur(rough, (0, 0), 9)
        return (np.array(self.water, np.float32) + 4 * rough[..., None] / rough.std()).astype(np.float32)


def _draw(picture: np.ndarray, place: np.ndarray, radius: float, colour: Colour) -> None:
    """Blends a disc into (h, w, 3): each pixel by how much of it the disc covers."""
    column, row = np.rint(place).astype(int).tolist()
    reach = int(radius + 2)
    x, y = np.arange(column - reach, column + reach + 1), np.arange(row - reach, row + reach + 1)
    cover = np.clip(radius + 0.5 - np.hypot(x[None] - place[0], y[:, None] - place[1]), 0, 1)[..., None]
    patch = picture[y[0] : y[-1] + 1, x[0] : x[-1] + 1]
    patch += cover.astype(np.float32) * (np.array(colour, np.float32) - patch)


@dataclass(frozen=True)
class FinScore:
    """How a clip was tracked; blurred are samples smeared by more than half a diameter."""

    lost: float  # share of all samples that is not measured, or half a diameter off
    rms_px: float  # an axis, of samples that are not blurred
    rms_blurred_px: float
    unflagged: int  # samples half a diameter off that count

    @classmethod
    def of(cls, clip: FinClip, tracked: xr.Dataset) -> "FinScore":
        """That of tracks that `tracking.judgement.trusted` judged."""
        truth = clip.truth()
        error = pixels_of(tracked) - truth
        near = np.linalg.norm(error, axis=2) < clip.diameter / 2
        good = near & (tracked.state.values == SampleState.MEASURED)
        speed = np.linalg.norm(np.gradient(truth, axis=0), axis=2)
        blurred = clip.exposure * speed > clip.diameter / 2
        plain, smeared = (error[good & which].ravel() for which in (~blurred, blurred))
        return cls(
            lost=float(1 - good.mean()),
            rms_px=float(np.sqrt(np.mean(plain**2))),
            rms_blurred_px=float(np.sqrt(np.sum(smeared**2) / max(len(smeared), 1))),
            unflagged=int(((tracked.weight.values > 0) & ~near).sum()),
        )
