"""Clips of a fish whose caudal fin beats fast, in colour and H.264, drawn apart from `benchmarks.video` and `pool`.

The tail swings sideways or bends as a chain; all is averaged over the exposure; dots are smeared as they move.
"""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import cv2
import numpy as np
import xarray as xr

from benchmarks.video.writer import VideoWriter
from session.create import FISHSIM_MARKERS
from session.tracks import pixels_of
from swimmer import load_robot
from tracking.boxes import Box, StartBoxes
from tracking.records import SampleState

FPS, MOMENTS = 60.0, 16
_PLACE_M = load_robot().marker_positions_m(FISHSIM_MARKERS)[:, 0]
Colour = tuple[float, float, float]


@dataclass(frozen=True)
class FinClip:
    """A clip; lengths in px, times in frames, colours RGB.

    Attributes:
        hz: beats a second.
        fastest: of the caudal fin, px a frame.
        chain: the tail bends and keeps its length; else it swings sideways, and its markers move apart.
        scale: px a metre.
        fin_m: by which the caudal fin's marker is further back than the robot's.
        overtone: share of a second harmonic in the beat's phase.
        waxing: share by which the beat comes and goes in two seconds.
        exposure: of a frame.
        diameter: of the dots.
        dot, body, water: their colours.
        wide: half width of the body at the markers, diameters.
        phase: of the beat in frame 0, rad.
    """

    hz: float = 3.0
    fastest: float = 45.0
    chain: bool = False
    scale: float = 1100.0
    fin_m: float = 0.04
    overtone: float = 0.0
    waxing: float = 0.0
    exposure: float = 0.45
    diameter: float = 17.0
    dot: Colour = (25, 25, 30)
    body: Colour = (235, 130, 30)
    water: Colour = (60, 95, 120)
    wide: float = 1.1
    noise: float = 2.0
    phase: float = 0.0
    frames: int = 180
    crf: float = 20
    size: tuple[int, int] = (960, 720)
    seed: int = 0

    def line(self, frame: np.ndarray, along: np.ndarray) -> np.ndarray:
        """(n, s, 2) places at times (n,) of what is so far (s,) behind the nose, in metres."""
        return self._shape(frame, along, self._amplitude)

    def truth(self) -> np.ndarray:
        """(n, m, 2) mean places of the markers while each frame is exposed."""
        times = np.arange(self.frames)[:, None] + self._moments
        return self.line(times.ravel(), self._along).reshape(*times.shape, -1, 2).mean(axis=1)

    def picture(self, number: int) -> np.ndarray:
        """(h, w, 3) uint8 RGB."""
        total = np.zeros_like(self._water)
        behind = np.linspace(-0.02, self._along[-1] + 0.03, 80)
        middle = self.line(number + self._moments, behind)  # (e, s, 2)
        dots = self.line(number + self._moments, self._along)
        for line, places in zip(middle, dots, strict=True):
            moment = self._water.copy()
            ahead = np.gradient(line, axis=0)
            across = np.stack([-ahead[:, 1], ahead[:, 0]], axis=1) / np.linalg.norm(ahead, axis=1)[:, None]
            half = self.wide * self.diameter * (1 + 1.5 * np.exp(-(((behind - 0.1) / 0.1) ** 2)))[:, None]
            outline = np.concatenate([line + half * across, (line - half * across)[::-1]])
            cv2.fillPoly(moment, [np.rint(outline * 256).astype(np.int32)], self.body, cv2.LINE_AA, 8)
            for place in places:
                _dot(moment, place, self.diameter / 2, self.dot)
            total += moment
        total = cv2.GaussianBlur(total / MOMENTS, (0, 0), 0.7)
        total += np.random.default_rng([self.seed, number]).normal(0, self.noise, total.shape[:2])[..., None]
        return np.clip(np.rint(total), 0, 255).astype(np.uint8)

    def video(self, path: Path) -> Path:
        with VideoWriter(path, *self.size, fps=FPS, crf=self.crf) as writer:
            for number in range(self.frames):
                writer.write(self.picture(number))
        return path

    def boxes(self) -> StartBoxes:
        """As a person draws them: a third wider than the dots, and about them to a pixel or two."""
        off = np.random.default_rng(self.seed).uniform(-1.5, 1.5, (len(self._along), 2))
        placed = zip(FISHSIM_MARKERS, self.truth()[0] + off, strict=True)
        return StartBoxes(0, {name: Box.around(centre, 1.3 * self.diameter) for name, centre in placed})

    @property
    def _along(self) -> np.ndarray:
        place = _PLACE_M - _PLACE_M.min()
        place[-1] += self.fin_m
        return place

    @property
    def _moments(self) -> np.ndarray:
        return self.exposure * ((np.arange(MOMENTS) + 0.5) / MOMENTS - 0.5)

    @cached_property
    def _amplitude(self) -> float:
        times, fin = np.linspace(0, 120, 1201), self._along[-1:]
        low, high = 0.0, 3.0
        for _ in range(20):
            middle = (low + high) / 2
            path = self._shape(times, fin, middle)[:, 0]
            fast = np.linalg.norm(np.diff(path, axis=0), axis=1).max() * 10 > self.fastest
            low, high = (low, middle) if fast else (middle, high)
        return low

    def _shape(self, frame: np.ndarray, along: np.ndarray, amplitude: float) -> np.ndarray:
        beat = 2 * np.pi * self.hz * frame[:, None] / FPS + self.phase
        grows = amplitude * (1 + self.waxing * np.sin(2 * np.pi * frame[:, None] / 120))
        fine = np.linspace(-0.05, self._along[-1] + 0.05, 400)
        root = 0.3
        tail = np.clip(fine - root, 0, None) / (self._along[-1] - root)
        wave = beat - 1.6 * tail
        wave = np.sin(wave + self.overtone * np.sin(2 * wave))
        step = self.scale * (fine[1] - fine[0])
        if self.chain:
            angle = grows * (0.4 * tail + 0.6 * tail**2) * wave
            x, y = step * np.cumsum(np.cos(angle), axis=1), step * np.cumsum(np.sin(angle), axis=1)
        else:
            x = np.broadcast_to(self.scale * fine, (len(frame), len(fine)))
            y = self.scale * 0.25 * grows * (0.2 * tail + 0.8 * tail**2) * wave
        yaw = 0.3 + 0.03 * np.sin(beat + 2)
        at = [np.stack([np.interp(along, fine, row) for row in rows]) for rows in (x, y)]
        turned = np.stack([np.cos(yaw) * at[0] - np.sin(yaw) * at[1], np.sin(yaw) * at[0] + np.cos(yaw) * at[1]], -1)
        return turned + np.array([120.0, 150.0]) * self.size[0] / 960 + frame[:, None, None] * np.array([0.25, 0.1])

    @cached_property
    def _water(self) -> np.ndarray:
        rough = np.random.default_rng([self.seed, 1]).normal(0, 1, self.size[::-1]).astype(np.float32)
        rough = cv2.GaussianBlur(rough, (0, 0), 9)
        return (np.array(self.water, np.float32) + 4 * rough[..., None] / rough.std()).astype(np.float32)


def _dot(picture: np.ndarray, place: np.ndarray, radius: float, colour: Colour) -> None:
    """Blends a disc into (h, w, 3): each pixel by how much of it the disc covers."""
    reach = int(radius + 2)
    column, row = np.rint(place).astype(int).tolist()
    x, y = np.arange(column - reach, column + reach + 1), np.arange(row - reach, row + reach + 1)
    cover = np.clip(radius + 0.5 - np.hypot(x[None] - place[0], y[:, None] - place[1]), 0, 1)[..., None]
    patch = picture[y[0] : y[-1] + 1, x[0] : x[-1] + 1]
    patch += cover.astype(np.float32) * (np.array(colour, np.float32) - patch)


@dataclass(frozen=True)
class FinScore:
    """How a clip was tracked, of all its markers and of the blurred samples (by over half a diameter)."""

    lost: float  # share that is not measured or half a diameter off
    lost_fin: float
    rms_px: float  # an axis
    rms_blurred_px: float
    unflagged: int  # samples half a diameter off that count
    counted_fin: float  # share of the caudal fin's samples that count


def scored(clip: FinClip, tracked: xr.Dataset) -> FinScore:
    """The score of judged tracks (`tracking.tracker.trusted`)."""
    truth = clip.truth()
    error = pixels_of(tracked) - truth
    away = np.linalg.norm(error, axis=2)
    good = (tracked.state.values == SampleState.MEASURED) & (away < clip.diameter / 2)
    speed = np.linalg.norm(np.gradient(truth, axis=0), axis=2)
    blurred = good & (clip.exposure * speed > clip.diameter / 2)
    counts = tracked.weight.values > 0
    return FinScore(
        lost=float(1 - good.mean()),
        lost_fin=float(1 - good[:, -1].mean()),
        rms_px=float(np.sqrt(np.mean(error[good & ~blurred] ** 2))),
        rms_blurred_px=float(np.sqrt(np.mean(error[blurred] ** 2))) if blurred.any() else 0.0,
        unflagged=int((counts & ~good).sum()),
        counted_fin=float(counts[:, -1].mean()),
    )
