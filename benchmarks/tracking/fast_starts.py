"""Clips drawn at random that begin in full beat: how often the tracker takes one marker for another. Synthetic only.

A chain of stiff links beats at full speed from the first frame on, so that a marker moves by up to the distance of its
neighbours from one frame to the next, and the first step is the worst: the start phase is one at which a neighbour's
next place comes nearest. Nothing is hidden. The pictures are made here, not by the renderer that the tracker's other
numbers come from.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from benchmarks.cases import Progress
from benchmarks.scores import Table
from tracking.identities import Spacing
from tracking.tracker import MarkerTracker

LINKS = np.array([4.8, 7.3, 0.9, 1.1, 1.1, 1.15, 1.0, 2.4])  # lengths from nose to fin, over the distance in the tail
MARKERS = len(LINKS) + 1
# An identity is wrong from this distance to its own place on, and up to that distance to another's.
WRONG_PX = 6.0
OTHER_PX = 4.0
TABLE_FRAMES = 40
_EXPOSURE_MOMENTS = 5  # Each exposure is drawn at this many moments.
_FINE_BITS = 4  # Circles are drawn in sixteenths of a pixel.
LOOKS = {
    "red on white": (215.0, 110.0, 190.0),
    "white on black": (25.0, 235.0, 60.0),
    "white on navy": (55.0, 240.0, 95.0),
}
"""Grey levels of the body, of its dots and of the water."""


@dataclass(frozen=True)
class FastStart:
    """Clip that begins in full beat.

    Attributes:
        look: a key of `LOOKS`.
        size_px: width and height of the picture.
        fps: frames a second.
        beat_hz: beats a second.
        link_px: (m - 1,) lengths of the links.
        swing_rad: (m - 1,) largest direction of each link to the body.
        lag_rad: (m - 1,) of each link's beat.
        phase_rad: of the beat in frame 0.
        heading_rad: of the body from nose to tail.
        speed_px: (2,) of the nose, a frame.
        dot_px: diameter of the dots.
        exposure: share of a frame for which the shutter is open.
        blur_px: standard deviation of the lens' blur.
        noise: standard deviation of each pixel, grey levels.
        seed: of noise, water and boxes.
    """

    look: str
    size_px: tuple[int, int]
    fps: float
    beat_hz: float
    link_px: np.ndarray
    swing_rad: np.ndarray
    lag_rad: np.ndarray
    phase_rad: float
    heading_rad: float
    speed_px: np.ndarray
    dot_px: float
    exposure: float
    blur_px: float
    noise: float
    seed: int

    def at(self, frame: float) -> np.ndarray:
        """Return (m, 2) places of the dots, px."""
        beat = self.phase_rad + 2 * np.pi * self.beat_hz * frame / self.fps
        chain = self.shapes(np.array([beat]))[0]
        straight = self.link_px.sum() * np.exp(1j * self.heading_rad)
        return np.stack([chain.real, chain.imag], axis=1) + (
            (np.array(self.size_px) - [straight.real, straight.imag]) / 2 + frame * self.speed_px
        )

    def shapes(self, beat_rad: np.ndarray) -> np.ndarray:
        """Return (b, m) complex places of the dots from the nose at these angles of the beat, px."""
        beat = beat_rad[:, None]
        yaw = -0.25 * self.swing_rad.max() * np.sin(beat)
        direction = self.heading_rad + yaw + self.swing_rad * np.sin(beat - self.lag_rad)
        links = self.link_px * np.exp(1j * direction)
        return np.hstack([np.zeros((len(beat), 1)), np.cumsum(links, axis=1)])

    def truth(self, frames: int) -> np.ndarray:
        """Return (n, m, 2) mean places while each frame is exposed, px."""
        return np.stack([np.mean([self.at(k + moment) for moment in self._moments], axis=0) for k in range(frames)])

    def frames(self, stop: int) -> Iterator[np.ndarray]:
        """Yield the frames, (h, w) uint8 each."""
        body, dot, water = LOOKS[self.look]
        width, height = self.size_px
        random = np.random.default_rng(self.seed)
        tiles = cv2.GaussianBlur(random.normal(0, 1, (height, width)), (0, 0), 9.0)
        ground = (water + 5 * tiles / tiles.std()).astype(np.float32)
        for k in range(stop):
            exposed = [self._draw_frame(ground, self.at(k + moment), body, dot) for moment in self._moments]
            picture = cv2.GaussianBlur(np.mean(exposed, axis=0), (0, 0), self.blur_px)
            noisy = picture + random.standard_normal(picture.shape, np.float32) * self.noise
            yield np.clip(np.rint(noisy), 0, 255).astype(np.uint8)

    def boxes(self) -> tuple[np.ndarray, np.ndarray]:
        """Return (m, 2) centres, each up to 1 px off, and (m,) sides of the start boxes."""
        off = np.random.default_rng([self.seed, 1]).uniform(-1, 1, (len(self.link_px) + 1, 2))
        return self.truth(1)[0] + off, np.full(len(off), 1.3 * self.dot_px)

    @property
    def _moments(self) -> np.ndarray:
        return self.exposure * np.linspace(-0.5, 0.5, _EXPOSURE_MOMENTS)

    def _draw_frame(self, ground: np.ndarray, at_px: np.ndarray, body: float, dot: float) -> np.ndarray:
        picture, fine = ground.copy(), 1 << _FINE_BITS
        points = np.rint(fine * at_px).astype(np.int32)
        wide = round(2.2 * self.dot_px)
        cv2.polylines(picture, [points[:, None]], False, body, wide, cv2.LINE_AA, _FINE_BITS)
        for x, y in points.tolist():
            cv2.circle(picture, (x, y), round(fine * self.dot_px / 2), dot, -1, cv2.LINE_AA, _FINE_BITS)
        return picture


def draw_clips(seed: int, count: int) -> list[FastStart]:
    """Draw clips in which the fastest dot moves by 0.3 to 1 of the usual distance of neighbours in a frame.

    In every second one another dot comes about as near to a dot's old place as the dot itself.
    """
    random = np.random.default_rng(seed)
    return [_draw(random, hard=k % 2 == 1) for k in range(count)]


def _draw(random: np.random.Generator, hard: bool) -> FastStart:
    dot = random.uniform(8, 20)
    spacing = random.uniform(1.8, 4.0) * dot
    uneven = random.random() < 0.7
    while True:
        fps, beat = random.choice([25.0, 30.0, 50.0, 60.0, 120.0]), random.uniform(0.4, 3.0)
        largest = random.uniform(0.3, 1.2)
        links = spacing * (LINKS if uneven else np.ones(len(LINKS))) * random.uniform(0.9, 1.1, len(LINKS))
        along = np.clip((np.arange(len(links)) - 1) / (len(links) - 2), 0, 1) ** random.uniform(0.5, 1.0)
        clip = FastStart(
            look=str(random.choice(list(LOOKS))),
            size_px=(int(1.5 * links.sum()), int(1.5 * links.sum())),
            fps=float(fps),
            beat_hz=beat,
            link_px=links,
            swing_rad=largest * along,
            lag_rad=random.uniform(1.0, 3.5) * along,
            phase_rad=0.0,
            heading_rad=random.uniform(-np.pi, np.pi),
            speed_px=random.uniform(-0.05, 0.05, 2) * spacing,
            dot_px=dot,
            exposure=random.uniform(0.05, 0.5),
            blur_px=random.uniform(0.6, 1.2),
            noise=random.uniform(1, 4),
            seed=int(random.integers(2**31)),
        )
        beats = np.linspace(0, 2 * np.pi, 32, endpoint=False)
        now, then = clip.shapes(beats), clip.shapes(beats + 2 * np.pi * beat / fps)
        apart = np.abs(now[:, :, None] - then[:, None])  # (b, m, m)
        own = np.diagonal(apart, axis1=1, axis2=2).copy()
        apart[:, np.arange(MARKERS), np.arange(MARKERS)] = np.inf
        nearest = (apart.min(axis=2) / np.maximum(own, 1.0)).min(axis=1)  # small is hard
        if 0.3 * spacing <= own.max() <= spacing and nearest.min() < (1.05 if hard else np.inf):
            return replace(clip, phase_rad=float(beats[nearest.argmin()]))


@dataclass(frozen=True)
class Followed:
    """Scores of the tracker on some clips, as shares of all samples.

    Attributes:
        clips: number of clips.
        samples: number of samples.
        identity: share at the place of another marker.
        lost: share not seen, or more than 6 px off.
        rms_px: error an axis of the others.
    """

    clips: int
    samples: int
    identity: float
    lost: float
    rms_px: float


def follow_clips(clips: Sequence[FastStart], frames: int = 60, joined: bool = True) -> Followed:
    """Track the clips frame by frame, from boxes up to 1 px off, without the judgement that comes after.

    Where the markers are not joined, each takes the nearest dot: what a student would try.
    """
    scores = [_follow(clip, frames, joined) for clip in clips]
    identity, lost, squares, right = (np.array(part) for part in zip(*scores, strict=True))
    rms = float(np.sqrt(squares.sum() / max(2 * right.sum(), 1)))
    return Followed(len(clips), len(clips) * frames * MARKERS, float(identity.mean()), float(lost.mean()), rms)


def _follow(clip: FastStart, frames: int, joined: bool) -> tuple[float, float, float, int]:
    truth = clip.truth(frames)
    pictures = clip.frames(frames)
    tracker, first = MarkerTracker.begin(next(pictures), *clip.boxes(), threads=1)
    if not joined:
        tracker.spacing = Spacing.begin(first.position_px, one_body=False)
    sightings = [first, *(tracker.step(luma) for luma in pictures)]
    place, seen = (np.stack(part) for part in zip(*((s.position_px, s.seen) for s in sightings), strict=True))
    apart = np.linalg.norm(place[:, :, None] - truth[:, None], axis=3)
    own = np.diagonal(apart, axis1=1, axis2=2)
    others = np.where(np.eye(truth.shape[1], dtype=bool), np.inf, apart).min(axis=2)
    wrong = own > WRONG_PX
    right = seen & ~wrong
    squares = float(((place - truth)[right] ** 2).sum())
    return float((seen & wrong & (others < OTHER_PX)).mean()), float((~right).mean()), squares, int(right.sum())


def fast_starts_table(count: int, progress: Progress) -> Table:
    """Score the tracker on clips of 40 frames, and on a fifth of them one whose markers take the nearest dot."""
    clips = draw_clips(seed=0, count=count)
    fewer = clips[: max(count // 5, 1)]
    rows = []
    for name, joined, own in (("all markers at once", True, clips), ("each the nearest dot", False, fewer)):
        progress(f"clips that begin in full beat, {name}", None)
        found = follow_clips(own, TABLE_FRAMES, joined)
        shares = [f"{100 * share:.2f}" for share in (found.identity, found.lost)]
        rows.append((name, str(found.clips), str(found.samples), *shares, f"{found.rms_px:.3f}"))
    columns = ("tracker", "clips", "samples", "another's place, %", "lost, %", "rms, px")
    return Table("Clips that begin in full beat", columns, tuple(rows))
