"""Pictures of a pool with discs at known places: soft edges, textured water, blur, noise, glints and covers."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import cv2
import numpy as np
from scipy.special import erfc

from benchmarks.video.writer import VideoWriter
from swimcal.robot import load_robot
from tracking.boxes import Box, StartBoxes
from tracking.identities import Spacing
from tracking.sighting import Sighting
from tracking.tracker import MarkerTracker

FPS = 60.0
WATER = 110.0

Path2D = Callable[[float], np.ndarray]
"""From the number of a frame, fractions included, to places (k, 2), px."""


@dataclass(frozen=True)
class Thing:
    """Something else in the picture: a glint, or a cover over a marker.

    Attributes:
        at: (2,) px, by the number of the frame.
        size_px: diameter of a disc, or width and height of a rectangle.
        luma: its brightness.
        frames: first and last frame in which it is there.
    """

    at: Callable[[float], np.ndarray]
    size_px: float | tuple[float, float]
    luma: float
    frames: tuple[int, int] = (0, 10**6)


@dataclass(frozen=True)
class Pool:
    """What is drawn; lengths in px, times in frames.

    Attributes:
        path: places (m, 2) of the markers.
        size: width and height of the picture.
        diameter: of the markers, one or (m,).
        contrast: of the markers over the water, negative for dark ones; one or (m,), or that by the frame.
        exposure: in frames, that blurs the motion.
        blur: standard deviation of the lens' blur.
        noise: standard deviation of the noise, steps of luma.
        texture: standard deviation of the water's.
        slope: of the water's brightness, steps of luma a pixel to the right and down.
        things: drawn over the markers.
    """

    path: Path2D
    size: tuple[int, int] = (480, 400)
    diameter: float | Sequence[float] = 14.0
    contrast: float | Sequence[float] | Callable[[float], np.ndarray] = 110.0
    exposure: float = 0.25
    blur: float = 0.8
    noise: float = 2.0
    texture: float = 3.0
    slope: tuple[float, float] = (0.0, 0.0)
    things: tuple[Thing, ...] = ()
    seed: int = 0

    def but(self, **changes: object) -> Pool:
        return replace(self, **changes)  # type: ignore[arg-type]

    def truth(self, frame: float) -> np.ndarray:
        """(m, 2) mean places while frame `frame` is exposed."""
        return self._exposed(frame).mean(axis=0)

    def truths(self, frames: int) -> np.ndarray:
        """(n, m, 2)."""
        return np.stack([self.truth(k) for k in range(frames)])

    def frame(self, number: int) -> np.ndarray:
        """(h, w) uint8."""
        picture = self._water.copy()
        places = self._exposed(number)  # (e, m, 2)
        m = places.shape[1]
        contrast = self.contrast(number) if callable(self.contrast) else self.contrast
        for k, (size, stands_out) in enumerate(
            zip(np.broadcast_to(self.diameter, m), np.broadcast_to(contrast, m), strict=True)
        ):
            draw_disc(picture, places[:, k], float(size), WATER + float(stands_out), self.blur)
        for thing in self.things:
            if thing.frames[0] <= number <= thing.frames[1]:
                _draw_thing(picture, thing, number, self.blur)
        picture += np.random.default_rng([self.seed, number]).normal(0, self.noise, picture.shape)
        return np.clip(np.rint(picture), 0, 255).astype(np.uint8)

    def frames(self, stop: int, start: int = 0) -> Iterator[np.ndarray]:
        return (self.frame(k) for k in range(start, stop))

    def begun(self, use_csrt: bool = False) -> tuple[MarkerTracker, Sighting]:
        """A tracker started on frame 0, and what it saw there."""
        centre = self.truth(0)
        side = np.broadcast_to(np.asarray(self.diameter, float) * 1.3, len(centre)).copy()
        return MarkerTracker.begin(self.frame(0), centre, side, use_csrt)

    def followed(self, frames: int, use_csrt: bool = False, one_body: bool = True) -> list[Sighting]:
        """What a tracker started on frame 0 says of that many frames."""
        tracker, first = self.begun(use_csrt)
        tracker.spacing = Spacing.begin(first.position_px, one_body)
        return [first, *(tracker.step(luma) for luma in self.frames(frames, 1))]

    def boxes(self, markers: Sequence[str], frame: int = 0) -> StartBoxes:
        sides = np.broadcast_to(np.asarray(self.diameter, float) * 1.3, len(markers))
        placed = zip(markers, self.truth(frame), sides, strict=True)
        return StartBoxes(frame, {name: Box.around(centre, side) for name, centre, side in placed})

    def video(self, path: Path, frames: int) -> Path:
        """Written without loss."""
        with VideoWriter(path, *self.size, codec="ffv1") as writer:
            for luma in self.frames(frames):
                writer.write(luma)
        return path

    def _exposed(self, frame: float) -> np.ndarray:
        return np.stack([self.path(frame + moment) for moment in self.exposure * np.linspace(-0.5, 0.5, 5)])

    @cached_property
    def _water(self) -> np.ndarray:
        width, height = self.size
        rng = np.random.default_rng([self.seed, 1 << 20])
        rough = cv2.GaussianBlur(rng.normal(0, 1, (height, width)), (0, 0), 12.0)
        right, down = np.arange(width) - width / 2, np.arange(height) - height / 2
        return WATER + self.texture * rough / rough.std() + self.slope[0] * right[None] + self.slope[1] * down[:, None]


def draw_disc(picture: np.ndarray, places: np.ndarray, diameter: float, luma: float, blur: float = 0.8) -> None:
    """Blends a disc into (h, w) float, smeared over places (e, 2); its edge is that of a blurred half plane."""
    reach = int(np.ceil(diameter / 2 + 5 * blur + np.ptp(places, axis=0).max() / 2))
    column, row = np.rint(places.mean(axis=0)).astype(int).tolist()
    height, width = picture.shape
    x = np.arange(max(column - reach, 0), min(column + reach + 1, width))
    y = np.arange(max(row - reach, 0), min(row + reach + 1, height))
    if not len(x) or not len(y):
        return
    away = np.hypot(x[None, None, :] - places[:, 0, None, None], y[None, :, None] - places[:, 1, None, None])
    cover = (erfc((away - diameter / 2) / (np.sqrt(2) * blur)) / 2).mean(axis=0)
    patch = picture[y[0] : y[-1] + 1, x[0] : x[-1] + 1]
    patch += cover * (luma - patch)


def _draw_thing(picture: np.ndarray, thing: Thing, number: int, blur: float) -> None:
    place = np.asarray(thing.at(number), float)
    if isinstance(thing.size_px, tuple):
        half = np.array(thing.size_px) / 2
        left, top = np.maximum(np.rint(place - half), 0).astype(int).tolist()
        right, bottom = np.maximum(np.rint(place + half), 0).astype(int).tolist()
        picture[top:bottom, left:right] = thing.luma
    else:
        draw_disc(picture, place[None], thing.size_px, thing.luma, blur)


def still(*places: Sequence[float]) -> Path2D:
    """Markers that stand."""
    return lambda _: np.array(places, float)


def drifting(places: Sequence[Sequence[float]], velocity: Sequence[float]) -> Path2D:
    """Markers in steady motion, px a frame."""
    return lambda frame: np.array(places, float) + frame * np.asarray(velocity, float)


def tail(
    hz: float = 2.25, spacing: float = 18.0, bend: float = 0.8, markers: int = 9, at: Sequence[float] = (130.0, 200.0)
) -> Path2D:
    """A chain of markers, the last six of which are bent by a wave that travels to the end; the head yaws.

    Args:
        hz: beats a second.
        spacing: of neighbours, px.
        bend: largest direction of the tail's end, rad.
        markers: how many.
        at: the first of them.
    """

    def path(frame: float) -> np.ndarray:
        along = np.arange(markers) / (markers - 1)
        grows = np.clip(along - 0.3, 0, None) / 0.7
        angle = bend * grows * np.sin(2 * np.pi * hz * frame / FPS - 2.0 * grows)
        angle = angle + 0.1 * np.sin(2 * np.pi * hz * frame / FPS + 2)
        steps = spacing * np.stack([np.cos(angle), np.sin(angle)], axis=1)[1:]
        chain = np.vstack([np.zeros(2), np.cumsum(steps, axis=0)])
        return chain + np.asarray(at, float) + frame * np.array([-0.3, 0.1])

    return path


def fish(
    markers: Sequence[str],
    hz: float = 1.5,
    bend: float = 0.5,
    heading: float = 0.2,
    px_per_m: float = 900.0,
    phase: float = 0.0,
    at: Sequence[float] = (60.0, 200.0),
) -> Path2D:
    """The markers of the robot, its tail bent by a travelling wave.

    Args:
        markers: their names.
        hz: beats a second.
        bend: largest direction of the tail's end against the head, rad.
        heading: of the body from nose to tail, rad from x to y of the picture.
        px_per_m: scale.
        phase: of the beat, rad.
        at: of the nose.
    """
    robot = load_robot()
    place = robot.marker_positions_m(tuple(markers))[:, :2] * [px_per_m, -px_per_m]
    root = px_per_m * max(marker.position_m[0] for marker in robot.markers.values() if marker.body == "head")
    nose = px_per_m * robot.markers["nose"].position_m[0]
    along = np.linspace(0, place[:, 0].max() - root, 120)  # px behind the head
    which = np.searchsorted(along, np.maximum(place[:, 0] - root, 0)).clip(0, len(along) - 1)
    on_tail = place[:, 0] > root

    def path(frame: float) -> np.ndarray:
        beat = 2 * np.pi * hz * frame / FPS + phase
        angle = bend * (0.15 + 0.85 * along / along[-1]) * np.sin(beat - 2.5 * along / along[-1])
        step = along[1] - along[0]
        x = np.where(on_tail, root + (np.cumsum(np.cos(angle)) * step)[which], place[:, 0]) - nose
        y = np.where(on_tail, (np.cumsum(np.sin(angle)) * step)[which] + place[:, 1], place[:, 1])
        yaw = heading + 0.05 * np.sin(beat + 2)
        cos, sin = np.cos(yaw), np.sin(yaw)
        turned = np.stack([cos * x - sin * y, sin * x + cos * y], axis=1)
        return turned + np.asarray(at, float) + frame * np.array([-0.3, 0.1])

    return path


def errors(sightings: Sequence[Sighting], truth: np.ndarray) -> np.ndarray:
    """(n, m) how far each seen marker is from the truth (n, m, 2), nan where not seen."""
    away = np.stack([np.linalg.norm(s.position_px - t, axis=1) for s, t in zip(sightings, truth, strict=True)])
    return np.where(np.stack([s.seen for s in sightings]), away, np.nan)
