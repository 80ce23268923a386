"""Mechanisms of camera, markers and tracker."""

from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline

from benchmarks.reality.camera import Picture, Sight
from benchmarks.reality.mechanism import AtStrength, Mechanism, Wearing
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.robot import load_robot


class HeadFrameMisalignment(Mechanism):
    """Box placed to one side in the first frame, whose offset turns after the head as the template learns.

    A template that is renewed a little in every frame keeps its offset in the picture at first and takes over how the
    head has turned within its memory: slow turns it follows as if it were glued, a fast beat hardly (Bolme et al.
    2010, Visual object tracking using adaptive correlation filters: a running average with a learning rate).
    """

    follows_s: float  # memory of the template
    # nose_m, neck_m: shifts towards the fish's right side in the first frame
    nose_m: float
    neck_m: float

    def place(self, sight: Sight) -> Sight:
        """Shift two markers to the side as the head lay a while ago."""
        nose, neck = sight.names.index("nose"), sight.names.index("neck")
        line = sight.marker_m[:, neck] - sight.marker_m[:, nose]
        line = line / np.abs(line)
        kept = np.exp(-np.diff(sight.time_s) / self.follows_s)
        side = np.array(line)
        for frame, share in enumerate(kept, 1):
            side[frame] = share * side[frame - 1] + (1 - share) * line[frame]
        marker_m = sight.marker_m.copy()
        marker_m[:, [nose, neck]] += 1j * np.outer(side / np.abs(side), [self.nose_m, self.neck_m])
        return replace(sight, marker_m=marker_m)


def head_frame_misalignment(random: np.random.Generator) -> AtStrength:
    """Draw how the error is shared between the two boxes, to which sides, and for how long a template remembers."""
    typical_m = 0.003
    least_s, most_s = 0.05, 2.0
    angle = random.uniform(0, 2 * np.pi)
    shares = np.cos(angle), np.sin(angle)
    follows_s = float(np.exp(random.uniform(*np.log((least_s, most_s)))))
    return lambda strength: (HeadFrameMisalignment(follows_s, *(typical_m * strength * share for share in shares)),)


class ScaleError(Mechanism):
    """Box of nose or neck, or both, too far along the line between them; it stays so in the picture."""

    # nose_m, neck_m: shifts tailwards along the first frame's line from nose to neck
    nose_m: float
    neck_m: float

    def place(self, sight: Sight) -> Sight:
        """Shift two markers by a constant."""
        nose, neck = sight.names.index("nose"), sight.names.index("neck")
        line = sight.marker_m[0, neck] - sight.marker_m[0, nose]
        marker_m = sight.marker_m.copy()
        marker_m[:, [nose, neck]] += line / abs(line) * np.array([self.nose_m, self.neck_m])
        return replace(sight, marker_m=marker_m)


def scale_error(random: np.random.Generator) -> AtStrength:
    """Draw whether the two are too far apart or too close, and the nose's share of it (mostly it is the neck's)."""
    typical = 0.02
    nose_to_neck_m = 0.142
    sign, nose_share = random.choice([-1.0, 1.0]), random.uniform(0.0, 0.3)
    shares = np.array([-nose_share, 1 - nose_share])
    return lambda strength: (ScaleError(*(sign * typical * strength * nose_to_neck_m * shares)),)


class CameraParallax(Mechanism):
    """Markers at their heights above the plane of the scale, times `nearness`; the pinhole does the rest.

    Heights n times as large under a camera of height H are seen exactly as the true ones are from H / n, at the same
    scale.
    """

    nearness: float  # nearness of the camera; 1 is one at the height that the scale was made for
    height_m: tuple[tuple[str, float], ...]  # height above the nose, by name of marker

    def place(self, sight: Sight) -> Sight:
        """Move markers up or down, nowhere else."""
        height = dict(self.height_m)
        own = np.array([height.get(name, 0.0) for name in sight.names])
        return replace(sight, height_m=sight.height_m + self.nearness * own)


def camera_parallax(random: np.random.Generator) -> AtStrength:
    """Draw how the fish is trimmed in pitch, and how far each marker is from its published height.

    The nearness saturates at 10, as from 0.25 m above the fish instead of 2.5 m.
    """
    trim_rad, glued_m = 0.01, 0.003
    markers = load_robot().markers
    nose = markers["nose"].position_m
    trim = trim_rad * random.standard_normal()
    at = [marker.position_m for marker in markers.values()]
    height = [z - nose[2] + trim * (x - nose[0]) + glued_m * random.standard_normal() for x, _, z in at]
    return lambda strength: (CameraParallax(10 * np.tanh(strength / 10), tuple(zip(markers, height, strict=True))),)


class LensDistortion(Mechanism):
    """Lens that draws a radius r about its own centre at r (1 + k1 r^2 + k2 r^4); r = 1 at the picture's lower edge.

    Brown (1966), Photogrammetric Engineering 32: two radial terms, and a centre that is not the picture's.
    """

    # k1, k2: coefficients
    k1: float
    k2: float
    # right_px, down_px: way from the picture's middle to the centre of distortion
    right_px: float
    down_px: float

    def picture(self, picture: Picture) -> Picture:
        """Move each position along its radius."""
        centre = picture.camera.centre_px + np.array([self.right_px, self.down_px])
        off = picture.position_px - centre
        square = (off**2).sum(axis=-1, keepdims=True) / (picture.camera.height_px / 2) ** 2
        return replace(picture, position_px=picture.position_px + off * square * (self.k1 + self.k2 * square))


def lens_distortion(random: np.random.Generator) -> AtStrength:
    """Draw barrel or cushion, how much of it the second term takes back, and the centre.

    Saturates at k1 = 0.25, where a barrel would begin to fold the picture's corners over.
    """
    typical, most = 0.03, 0.25
    sign, back = random.choice([-1.0, 1.0]), random.uniform(0.05, 0.1)
    right, down = 8.0 * random.standard_normal(2)

    def at(strength: float) -> tuple[Mechanism, ...]:
        k1 = float(sign * most * np.tanh(typical / most * strength))
        return (LensDistortion(k1, float(-back * k1), float(right), float(down)),)

    return at


_SWAY_S = 3.0  # period of the clock's sway


class TimeBaseError(Mechanism):
    """Frames further apart than their stamps: by the share `relative` in the long run, now more and now less.

    The clock's oscillator sways about its mean by the share `sway` of the error, with a period of three seconds.
    """

    relative: float  # growth of a second on the camera's clock; more than -1 / (1 + sway)
    sway: float  # share of the error that sways, 0 to 1
    phase_rad: float  # phase of the sway at the first frame

    def expose(self, time_s: np.ndarray) -> np.ndarray:
        """Return the true times: the integral of 1 + relative (1 + sway cos(w t + phase))."""
        w = 2 * np.pi / _SWAY_S
        swayed = (np.sin(w * time_s + self.phase_rad) - np.sin(self.phase_rad)) / w
        return np.asarray(time_s + self.relative * (time_s + self.sway * swayed))


def time_base_error(random: np.random.Generator) -> AtStrength:
    """Draw a clock that is fast or slow, and how it sways; the error saturates at a half."""
    typical, most = 0.02, 0.5
    sign, sway, phase = random.choice([-1.0, 1.0]), random.uniform(0.0, 0.1), random.uniform(0, 2 * np.pi)
    return lambda strength: (TimeBaseError(sign * most * np.tanh(typical / most * strength), sway, phase),)


_ROUNDS = 6


class RollingShutter(Mechanism):
    """Shutter that draws each marker where it is when the line it is drawn on is read.

    The instant is solved for, not taken to first order. Meingast, Geyer and Sastry (2005), Geometric models of
    rolling-shutter cameras.
    """

    readout_s: float  # time from the first line to the last
    stamped: float  # share of the lines that are read before the time stamp of the frame

    def picture(self, picture: Picture) -> Picture:
        """Read places off the paths through all frames: fixed points of x(t + readout (line / lines - stamped))."""
        time_s, lines = picture.time_s, picture.camera.height_px
        found = picture.position_px.copy()
        for marker in range(found.shape[1]):
            path = CubicSpline(time_s, picture.position_px[:, marker])
            at = found[:, marker]
            for _ in range(_ROUNDS):
                at = path(time_s + self.readout_s * ((at[:, 1] + 0.5) / lines - self.stamped))
            found[:, marker] = at
        return replace(picture, position_px=found)


def rolling_shutter(random: np.random.Generator) -> AtStrength:
    """Draw which line a frame's stamp belongs to; the readout saturates at 40 ms."""
    typical_s, most_s = 0.01, 0.04
    stamped = random.uniform(0.3, 0.7)
    return lambda strength: (RollingShutter(most_s * np.tanh(typical_s / most_s * strength), stamped),)


class MarkerOffset(Mechanism):
    """Markers glued off their places, and boxes placed off their markers.

    What is glued turns with its link; a box keeps its offset as it was in the first frame.
    """

    # offset by name of marker, in the axes of its link: along (tailwards) and across
    offset_m: tuple[tuple[str, complex], ...]
    glued: float  # share of it that turns with the link

    def place(self, sight: Sight) -> Sight:
        """Shift markers by both."""
        offset = dict(self.offset_m)
        own = np.array([offset.get(name, 0j) for name in sight.names])
        turned = self.glued * sight.axis + (1 - self.glued) * sight.axis[:1]
        return replace(sight, marker_m=sight.marker_m + own * turned)


def marker_offset(random: np.random.Generator) -> AtStrength:
    """Draw how many markers are off, which ones, where to, and whether by their glue or by their boxes."""
    typical_m = 0.004
    others = [name for name in FISHSIM_MARKERS if name not in {"nose", "neck"}]
    off = random.choice(others, size=random.integers(1, len(others) + 1), replace=False)
    way = random.standard_normal(len(off)) + 1j * random.standard_normal(len(off))
    glued = random.uniform(0.5, 1.0)

    def at(strength: float) -> tuple[Mechanism, ...]:
        offset = tuple((str(name), complex(typical_m * strength * by)) for name, by in zip(off, way, strict=True))
        return (MarkerOffset(offset, float(glued)),)

    return at


_HELD_M = 0.04  # A box that slid this far holds on to something else.


class TrackerDrift(Wearing):
    """Slide of each box along the body: a random walk with a trend, bounded by the size of a box.

    Matthews, Ishikawa and Baker (2004), The template update problem: small errors of a template that is renewed add up.
    The trend is a matter of the marker, the same in every trial; the walk is another at every time in use.
    """

    pace_m_s: tuple[tuple[str, float], ...]  # pace tailwards, by name of marker
    walk_m: float  # spread of the walk in a second
    seed: int  # seed of the walk

    def place(self, sight: Sight) -> Sight:
        """Slide boxes further along the link from frame to frame."""
        marker_m = sight.marker_m.copy()
        elapsed_s = sight.time_s - sight.time_s[0]
        steps_s = np.diff(sight.time_s)
        for number, (name, pace) in enumerate(self.pace_m_s):
            if name in sight.names:
                random = np.random.default_rng([self.seed, number, round(1000 * self.before_s)])
                walk = np.cumsum(self.walk_m * np.sqrt(steps_s) * random.standard_normal(len(steps_s)))
                slid = pace * elapsed_s + np.append(0.0, walk)
                i = sight.names.index(name)
                marker_m[:, i] += _HELD_M * np.tanh(slid / _HELD_M) * sight.axis[:, i]
        return replace(sight, marker_m=marker_m)


def tracker_drift(random: np.random.Generator) -> AtStrength:
    """Draw which boxes slide, at what pace, and how they waver. Each saturates where it has slid by 4 cm."""
    typical_m_s = 0.001
    walk_m = 0.0001  # spread in a second, at strength 1
    others = [name for name in FISHSIM_MARKERS if name not in {"nose", "neck"}]
    sliding = random.choice(others, size=random.integers(1, len(others) + 1), replace=False)
    pace = random.standard_normal(len(sliding))
    seed = int(random.integers(2**31))

    def at(strength: float) -> tuple[Mechanism, ...]:
        paces = tuple((str(name), float(typical_m_s * strength * by)) for name, by in zip(sliding, pace, strict=True))
        return (TrackerDrift(paces, walk_m * strength, seed),)

    return at


_APART_S = 0.7  # mean time from one exchange to the next


class MarkerSwap(Wearing):
    """True exchange of two tracks' markers, in bursts that begin at random and are longer the larger their share.

    Identity switches: Milan et al. (2016), MOT16. The bursts go on from one trial to the next, by the time in use.
    """

    # front, rear: names of the two markers
    front: str
    rear: str
    share: float  # share of the time
    seed: int  # seed of the bursts' beginnings

    def picture(self, picture: Picture) -> Picture:
        """Exchange markers in some frames, leave the others untouched."""
        front, rear = picture.names.index(self.front), picture.names.index(self.rear)
        frames = self._mark_exchanged(picture.time_s)
        position_px = picture.position_px.copy()
        position_px[frames, front] = picture.position_px[frames, rear]
        position_px[frames, rear] = picture.position_px[frames, front]
        return replace(picture, position_px=position_px)

    def _mark_exchanged(self, time_s: np.ndarray) -> np.ndarray:
        """Return (f,) whether they are exchanged: in the last `share` of each stretch from one recovery to the next."""
        random = np.random.default_rng(self.seed)
        in_use_s = self.before_s + time_s
        ends = np.cumsum(random.exponential(_APART_S, int(4 * (in_use_s[-1] / _APART_S + 4))))
        stretch = np.searchsorted(ends, in_use_s, side="right")
        begins = np.append(0.0, ends)[stretch]
        return np.asarray(ends[stretch] - in_use_s <= self.share * (ends[stretch] - begins))


def marker_swap(random: np.random.Generator) -> AtStrength:
    """Draw one pair of neighbours on the tail, or two; their share saturates at 90 % of the time."""
    typical, most = 0.1, 0.9
    tail = FISHSIM_MARKERS[FISHSIM_MARKERS.index("tail_1") :]
    first = random.permutation(len(tail) - 1)[: random.integers(1, 3)]
    seeds = random.integers(2**31, size=len(first))

    def at(strength: float) -> tuple[Mechanism, ...]:
        share = float(-most * np.expm1(-typical / most * strength))
        return tuple(MarkerSwap(tail[i], tail[i + 1], share, int(seed)) for i, seed in zip(first, seeds, strict=True))

    return at
