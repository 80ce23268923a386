"""The aquarium: many swimmers in one pool, as a Rerun recording or as a film that needs no screen.

`swim_together` lets the `Shoal` swim, each fish on its own way; `write_shoal` writes it, and `draw` draws the pool from
above.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import Any, cast

import av
import cv2
import numpy as np
import rerun as rr

from swimcal.errors import Fault, InputError
from swimcal.results import writing_whole
from swimgym.course import Course, Rules, Targets, beat_action
from swimgym.policy import Controller, Policy, Swum, reach
from swimgym.swimmers import Fish, Swimmers

# The shoal and its film.
FPS = 25
KINDS = (".rrd", ".mp4", ".gif")
_PIXELS = 960
_MARGIN_M = 0.6
_SLOWEST_HZ = 0.5  # slowest beat without a policy
_FASTEST_HZ = 2.0  # fastest beat without a policy
_M2_EACH = 0.5  # area of the pool for each swimmer
_GAIN = 1.5  # how much a beat without a policy is to one side, per rad of bearing

# The pool from above.
WATER = (214, 232, 240)
FISH = (44, 90, 120)
HEAD = (225, 120, 60)
TARGET = (200, 60, 60)
COLOURS = (WATER, FISH, HEAD, TARGET)
PIXELS = 480
_ROUND_M = 0.006  # half the width of a swimmer's line


class Roaming(Targets):
    """Targets anywhere in a pool of `size_m` (2,) about the origin.

    A swimmer that reaches its target gets the next one.
    """

    def __init__(self, count: int, size_m: np.ndarray, rng: np.random.Generator) -> None:
        super().__init__(count)
        self._pool_m, self._rng = size_m, rng
        self.places = self.drawn(count)

    def drawn(self, count: int) -> np.ndarray:
        """Draw (n, 2) places in the pool, m."""
        return (self._rng.random((count, 2)) - 0.5) * self._pool_m

    def begin(self, rows: np.ndarray, rng: np.random.Generator) -> None:
        """Leave the targets as they are: they were drawn with the pool."""

    def reached(self, distance: np.ndarray) -> np.ndarray:
        """Draw new targets for the swimmers that reached theirs, and return (n,) False: no episode ends."""
        near = distance <= self.reach_m
        self.places[near] = self.drawn(int(near.sum()))
        return np.zeros(len(distance), bool)


@dataclass(frozen=True, eq=False)
class Shoal:
    """The swimmers of an aquarium, frame by frame.

    Attributes:
        lines_m: (k, n, l, 2) nose, hinges and tip of n swimmers in every frame, m.
        targets_m: (k, n, 2) targets, m.
        corners_m: (2, 2) lower left and upper right corner of what is shown, m.
        wall_s: duration of the simulation.
        seconds: simulated time.
        diverged: (n,) whether the simulation of a swimmer diverged.
    """

    lines_m: np.ndarray
    targets_m: np.ndarray
    corners_m: np.ndarray
    wall_s: float
    seconds: float
    diverged: np.ndarray

    @property
    def in_real_time(self) -> int:
        """The number of swimmers that could be simulated in real time."""
        return int(self.lines_m.shape[1] * self.seconds / self.wall_s)


def swim_together(
    fish: Fish, count: int, seconds: float, *, policy: Policy | None = None, seed: int = 0, workers: int = 0
) -> Shoal:
    """Simulate n swimmers that roam a pool whose size suits their number; several models are dealt out to them.

    Without a policy they beat at 0.5 to 2 Hz, each at its own frequency, towards their targets.

    Args:
        fish: the robot, with one model or several.
        count: n.
        seconds: simulated time.
        policy: steers the swimmers.
        seed: draws places, headings, targets and frequencies.
        workers: threads; 0 for all cores.
    """
    rng = np.random.default_rng(seed)
    size = np.sqrt(_M2_EACH * max(count, 20)) * np.array([1.3, 1 / 1.3])
    rules = replace(policy.card.rules if policy else Rules(), seconds=np.inf)
    swimmers = Swimmers(fish.models, count, interval_s=rules.interval_s, workers=workers)
    task = Roaming(count, size, rng)
    course, hz = Course(swimmers, task, rules), rng.uniform(_SLOWEST_HZ, _FASTEST_HZ, count)
    swimmers.rest(np.arange(count), task.drawn(count), rng.uniform(-np.pi, np.pi, count))
    lines: list[np.ndarray] = []
    seen, targets, every = course.look()[0], [], 1 / FPS / rules.interval_s
    began = perf_counter()
    for k in range(round(seconds / rules.interval_s)):
        if k >= every * len(lines):
            lines.append(outline(swimmers))
            targets.append(task.places.copy())
        aside = np.tanh(_GAIN * np.arctan2(-seen[:, -4], -seen[:, -5]))  # towards the target
        seen = course.act(policy.act(seen) if policy else beat_action(rules, seen, hz, aside)).seen
    wall = perf_counter() - began
    corners = np.array([-0.5, 0.5])[:, None] * (size + _MARGIN_M)
    return Shoal(np.array(lines), np.array(targets), corners, wall, seconds, swimmers.diverged)


def play(
    course: Course, controller: Controller, target_m: tuple[float, float] | None = None, seed: int = 0
) -> tuple[Swum, Shoal]:
    """Simulate one episode of one swimmer, and return it with what there is to see of it.

    See `swimgym.policy.reach`.

    Args:
        course: one swimmer with its task.
        controller: steers it.
        target_m: x and y of the target from the start, m; None: the task's own.
        seed: draws the target.

    Raises:
        InputError: the target is no place, or is not reached in the time of an episode.
    """
    lines: list[np.ndarray] = []
    targets, calls = [], 0

    def watch(seen: np.ndarray) -> np.ndarray:
        nonlocal calls
        if calls * course.rules.interval_s >= len(lines) / FPS - 1e-9:
            lines.append(outline(course.swimmers))
            targets.append(course.task.ahead(course.swimmers.centre[0])[0].copy())
        calls += 1
        return controller(seen)

    began = perf_counter()
    swum = reach(course, watch, target_m, seed)
    wall, shown = perf_counter() - began, np.concatenate([np.reshape(lines, (-1, 2)), np.reshape(targets, (-1, 2))])
    corners = np.array([shown.min(axis=0) - _MARGIN_M / 2, shown.max(axis=0) + _MARGIN_M / 2])
    return swum, Shoal(np.array(lines), np.array(targets), corners, wall, float(swum.seconds[0]), swum.diverged)


def check_kind(file: Path) -> None:
    """Raise an `InputError` for a file of another kind than .rrd, .mp4 and .gif."""
    if file.suffix not in KINDS:
        fault = Fault(str(file), "", "not a kind of recording", repr(file.suffix), "a file of one of these", KINDS)
        raise InputError([fault])


def write_shoal(shoal: Shoal, file: Path) -> None:
    """Write a recording (.rrd) or a film (.mp4, .gif) of 25 frames a second.

    Raises:
        InputError: the name ends otherwise.
        ResultsNotWritable: it cannot be written.
    """
    check_kind(file)
    with writing_whole(file) as part:
        if file.suffix == ".rrd":
            _record(shoal, part)
        else:
            _film(shoal, part)


def _record(shoal: Shoal, file: Path) -> None:
    stream, up = rr.RecordingStream("swimcal_aquarium"), np.array([1.0, -1.0])  # the viewer's y is downwards
    stream.save(file)
    for k, (lines, targets) in enumerate(zip(shoal.lines_m * up, shoal.targets_m * up, strict=True)):
        stream.set_time("time", duration=k / FPS)
        whole = np.isfinite(lines).all(axis=(1, 2))
        stream.log("pool/swimmers", rr.LineStrips2D(list(lines[whole]), radii=0.012, colors=(80, 150, 190)))
        stream.log("pool/targets", rr.Points2D(targets[whole], radii=0.02, colors=(220, 90, 80)))
    stream.flush()
    stream.disconnect()


def _film(shoal: Shoal, file: Path) -> None:
    codec, form = ("gif", "pal8") if file.suffix == ".gif" else ("libx264", "yuv420p")
    with av.open(str(file), "w") as container:
        stream = cast(av.VideoStream, container.add_stream(codec, rate=FPS))
        for k, (lines, targets) in enumerate(zip(shoal.lines_m, shoal.targets_m, strict=True)):
            image = draw(lines, targets, shoal.corners_m, _PIXELS)
            if k == 0:
                (stream.height, stream.width), stream.pix_fmt = image.shape[:2], form
            if form == "pal8":
                indexed: Any = _index_colours(image)  # PyAV's types know nothing of palettes
                frame = av.VideoFrame.from_ndarray(indexed, format=form)
            else:
                frame = av.VideoFrame.from_ndarray(image, format="rgb24").reformat(format=form)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())


def _index_colours(image: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Reduce an image to 256 colours: (p, q) numbers, and (256, 4) colours, alpha first.

    Shades have 3, 3 and 2 bits; the colours of the drawing are kept exactly.
    """
    palette = np.full((256, 4), 255, np.uint8)
    number = np.arange(256)
    palette[:, 1:] = np.stack([(number >> 5) * 36, (number >> 2 & 7) * 36, (number & 3) * 85], axis=1)
    for colour in COLOURS:
        palette[_shade(np.array(colour)), 1:] = colour
    return _shade(image), palette


def _shade(colour: np.ndarray) -> np.ndarray:
    red, green, blue = (colour[..., i].astype(int) for i in range(3))
    return np.asarray((red >> 5) << 5 | (green >> 5) << 2 | blue >> 6).astype(np.uint8)


# The pool from above.


def outline(swimmers: Swimmers) -> np.ndarray:
    """Compute the outline of each swimmer in the pool: (n, l + 1, 2) nose, hinges and tip, m."""
    head, hinges = swimmers.head, swimmers.tail[0]
    points = swimmers.joints_m
    turned = head[:, 2:] + np.concatenate([np.zeros((len(head), 1)), np.cumsum(hinges, axis=1)], axis=1)
    steps = np.diff(points)  # nose to first hinge, …, last hinge to tip
    along = np.stack([np.cos(turned), np.sin(turned)], axis=2) * steps[:, None]
    nose = head[:, :2] + points[0] * along[:, 0] / steps[0]
    return np.concatenate([nose[:, None], nose[:, None] + np.cumsum(along, axis=1)], axis=1)


def draw(lines: np.ndarray, targets: np.ndarray, corners: np.ndarray, pixels: int) -> np.ndarray:
    """Draw swimmers and their targets between two corners of the pool, (p, q, 3) RGB.

    x points to the right, so a robot that heads along -x swims to the left.

    Args:
        lines: (n, k, 2) outlines of the swimmers, m.
        targets: (n, 2) their targets, m.
        corners: (2, 2) corners of the pool, the lower left one first, m.
        pixels: length of the picture's longer side.
    """
    low, high = corners
    scale = pixels / float(np.max(high - low))
    width, height = (2 * np.round(scale * (high - low) / 2)).astype(int)
    image = np.full((height, width, 3), WATER, np.uint8)

    def at(place: np.ndarray) -> np.ndarray:
        flipped = np.stack([place[..., 0] - low[0], high[1] - place[..., 1]], axis=-1)
        return np.round(16 * scale * flipped).astype(np.int32)  # fixed point of 4 binary digits

    for target in np.unique(at(targets), axis=0):
        cv2.circle(image, tuple(map(int, target)), int(16 * 0.03 * scale), TARGET, 1, cv2.LINE_AA, 4)
    thick, finite = max(1, round(2 * _ROUND_M * scale)), np.isfinite(lines).all(axis=(1, 2))
    placed = at(lines[finite])
    cv2.polylines(image, list(placed), False, FISH, thick, cv2.LINE_AA, 4)
    cv2.polylines(image, list(placed[:, :2]), False, HEAD, 2 * thick, cv2.LINE_AA, 4)
    return image


def view_from_above(course: Any) -> np.ndarray:
    """Draw the swimmers of a course and their targets, (p, q, 3) RGB."""
    lines = outline(course.swimmers)
    targets = course.task.ahead(course.swimmers.centre[0])[0]
    low, high = np.array([-4.3, -2.3]), np.array([0.7, 2.3])
    seen = np.concatenate([lines.reshape(-1, 2), targets])
    seen = seen[np.isfinite(seen).all(axis=1)]
    corners = np.array([np.minimum(low, seen.min(axis=0) - 0.1), np.maximum(high, seen.max(axis=0) + 0.1)])
    return draw(lines, targets, corners, PIXELS)
