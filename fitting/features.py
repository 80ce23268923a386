"""Features of a trial: its cruising speed and the beat of every marker, the few numbers that tell of the fluid.

Place and heading of the fish and the bend of its course are nuisances of a trial: they are taken out as a smooth pose
(a heading quadratic in time, a path cubic in time), in the same way from tracks and from simulations (`FeatureReader`).
The rest is the forward speed, and each marker's mean and first harmonics in the frame that cruises with the fish. To
tell whether the fish goes straight at all, and whether its markers stay where they are, the course is read too: the
mean of what was taken out, and how fast each marker slides along the fish.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from fitting.pool import determined, smooth_swim, waves
from fitting.trial import HARMONICS, MeasuredTrial, degrees_of
from swimcal.errors import NotEnoughData

SPEED = 0  # place of the forward speed in features; the markers follow
OF_A_MARKER = 1 + 2 * HARMONICS  # mean, then cosine and sine of each harmonic, for x and then for y
COURSE = ("sideways", "turning")  # the last numbers of features, where they are read
SLIDES = 2 * OF_A_MARKER - len(COURSE) - 1
"""Largest number of markers whose sliding is read with the course.

So all that follows the markers is less than one more marker.
"""
_SHARE_OF_FRAMES = 0.5  # share of frames in which a marker must be seen to carry the path
_PATH_INFLATION = 1000.0  # largest variance inflation of a cubic path, smooth by itself, see `determined`


@dataclass(frozen=True, eq=False)
class FeatureReader:
    """Reader of features from marker positions in the frames of one trial that are compared.

    They are (1 + 14 m,): forward speed (m/s), then (m, 2, 7) for each marker, along and across the fish, its mean and
    the cosines and sines of three harmonics of the crank's turn since time 0 (m). With the course there follow the
    speed at which each marker, up to the eleventh, slides forward along the fish (m/s, relative to the smooth path of
    all), the speed of its middle to the left (m/s), and the rate of turning, counter-clockwise (rad/s).

    A marker whose samples do not determine its mean, harmonics and drift takes no part: none of its samples is usable,
    and all of its numbers are 0, in tracks as in simulations. `observed` tells which numbers are read.

    Attributes:
        time_s: (n,) times of the frames.
        turn_rad: (n,) turn of the crank since time 0.
        usable: (n, m) samples that count, of the markers that are read.
        nose, neck: their places among the markers.
        span_m: distance between nose and neck; where it is given, the course is read too.
    """

    time_s: np.ndarray
    turn_rad: np.ndarray
    usable: np.ndarray
    nose: int
    neck: int
    span_m: float | None = None

    @classmethod
    def of(cls, trial: MeasuredTrial, with_course: bool = False) -> "FeatureReader":
        """Make the reader for the kept frames of a trial.

        Args:
            trial: the trial.
            with_course: whether the course is read too.

        Raises:
            NotEnoughData: nose and neck are seen together in too few of these frames.
        """
        time_s = trial.time_s[trial.kept]
        turn_rad = trial.crank_rad(time_s, trial.frequency.hz)
        usable = (trial.weight[trial.kept] > 0) & np.isfinite(trial.position_m[trial.kept]).all(axis=-1)
        nose, neck = (trial.markers.index(name) for name in ("nose", "neck"))
        read = cls(time_s, turn_rad, usable, nose, neck)
        head_seen = read._head_seen[:, None]
        too_few = len(time_s) < 2  # no stretch of time, over which anything could be read
        if too_few or not (determined(read._columns, head_seen)[0] and read._determined[[nose, neck]].all()):
            raise NotEnoughData(
                f"trial {trial.name}: nose and neck are seen together in {int(read._head_seen.sum())} of "
                f"{len(time_s)} frames, which do not tell its heading; see the flags of these two markers"
            )
        read = replace(read, usable=usable & read._determined)
        if not with_course:
            return read
        head = trial.position_m[trial.kept][read._head_seen]
        span_m = float(np.median(np.linalg.norm(head[:, nose] - head[:, neck], axis=-1)))
        return replace(read, span_m=span_m)

    def __call__(self, position_m: np.ndarray) -> np.ndarray:
        """Return the features (..., k) of positions (..., n, m, 2); samples that do not count may be nan."""
        flat = position_m.reshape(-1, *position_m.shape[-3:])
        place, path, speed, turning = self._cruise(flat)
        beats, slid = self._read_beats(place - path[..., None])
        slid = slid.real
        parts = np.stack([beats.real, beats.imag], axis=2)  # (s, m, 2, 7)
        pieces = [speed.real.mean(axis=-1)[:, None], parts.reshape(len(parts), -1)]
        if self.span_m is not None:
            pieces.append(np.column_stack([slid[:, :SLIDES], speed.imag.mean(axis=-1), turning.mean(axis=-1)]))
        features = np.concatenate(pieces, axis=1)
        return features.reshape(*position_m.shape[:-3], features.shape[-1])

    def creeps(self, position_m: np.ndarray, along_m: np.ndarray) -> np.ndarray:
        """Return how fast each marker slides to the left of its neighbours, (..., m) m/s; no bend of the body does so.

        Args:
            position_m: (..., n, m, 2); samples that do not count may be nan.
            along_m: (m,) places of the markers along the straight robot.
        """
        flat = position_m.reshape(-1, *position_m.shape[-3:])
        place, path, *_ = self._cruise(flat)
        aside = self._read_beats(place - path[..., None])[1].imag
        found = aside @ self.against_neighbours(along_m).T
        return np.asarray(found.reshape(*position_m.shape[:-3], -1))

    def aside_of_neighbours(self, position_m: np.ndarray, along_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return where markers are from the line through their neighbours, along + i aside, and which samples count.

        Both are (n, m).

        Args:
            position_m: (n, m, 2).
            along_m: (m,) places of the markers along the straight robot.
        """
        take = self.against_neighbours(along_m)
        hidden = (~self.usable).astype(float) @ np.abs(np.sign(take)).T  # samples that a place rests on and that lack
        return self._cruise(position_m[None])[0][0] @ take.T, (hidden == 0) & take.any(axis=1)

    def against_neighbours(self, along_m: np.ndarray) -> np.ndarray:
        """Return the matrix (m, m) that takes from each marker's way aside that of the line through its neighbours.

        Rows of markers that are not judged are 0: of nose and neck, on which the heading rests, of the first and the
        last, which have one neighbour, and of those that are not read.

        Args:
            along_m: (m,) places of the markers along the straight robot.
        """
        found = np.zeros((len(along_m),) * 2)
        order = [i for i in np.argsort(along_m, kind="stable") if self.read[i]]
        for front, own, rear in zip(order, order[1:], order[2:], strict=False):
            if own not in (self.nose, self.neck) and along_m[rear] > along_m[front]:
                place = (along_m[own] - along_m[front]) / (along_m[rear] - along_m[front])
                found[own, [front, own, rear]] = place - 1, 1.0, -place
        return found

    def _read_beats(self, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return mean and harmonics (s, m, 7) and paces (s, m) of places (s, n, m), all along + i across."""
        beats = np.einsum("mcn,snm->smc", self._beats, place)  # (s, m, 8)
        return beats[..., :OF_A_MARKER], beats[..., OF_A_MARKER]

    def _cruise(self, position_m: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Split positions (s, n, m, 2) into places along headings, the smooth path (s, n), its speed and its turning.

        All are along + i across, m, m and m/s; turning is in rad/s.
        """
        trend = self._heading(position_m)  # (s, n)
        place = self._along(position_m, trend)
        path = self._path(place)
        turning = np.gradient(trend, self.time_s, axis=-1, edge_order=2)
        return place, path, np.gradient(path, self.time_s, axis=-1, edge_order=2) + 1j * turning * path, turning

    @property
    def _determined(self) -> np.ndarray:
        """Return whether each marker's samples determine its mean, harmonics and drift, (m,)."""
        return determined(self._columns, self.usable)

    @property
    def _columns(self) -> np.ndarray:
        """Regressors of drift and harmonics, (n, 9)."""
        return smooth_swim(self.time_s, self.turn_rad, self.degrees[1], HARMONICS)

    @property
    def read(self) -> np.ndarray:
        """Return whether each marker is read, (m,)."""
        return np.asarray(self.usable.any(axis=0))

    @property
    def observed(self) -> np.ndarray:
        """Return whether these frames tell each number, (k,); the others are 0."""
        slides = [] if self.span_m is None else [self.read[:SLIDES], np.ones(len(COURSE), bool)]
        return np.concatenate([[True], np.repeat(self.read, 2 * OF_A_MARKER), *slides])

    @cached_property
    def degrees(self) -> tuple[int, int]:
        """Degrees in time of the smooth path and of the smooth heading."""
        return degrees_of(self.turn_rad)

    def _drift(self, degree: int) -> np.ndarray:
        """Return the powers of scaled time (n, degree + 1)."""
        return smooth_swim(self.time_s, self.turn_rad, degree, 0)

    @cached_property
    def _beats(self) -> np.ndarray:
        """Readers (m, 8, n) of each marker's mean, harmonics and pace, fitted with a small error of the trend."""
        means = np.column_stack([np.ones(len(self.time_s)), waves(self.turn_rad, HARMONICS)])
        trends = self._drift(self.degrees[1])[:, 1:]
        trends = trends - trends.mean(axis=0)
        read = _readers(np.column_stack([means, trends]), self.usable)[:, : OF_A_MARKER + 1]
        read[:, OF_A_MARKER] *= 2 / np.ptp(self.time_s)  # scaled time becomes seconds
        return read

    @property
    def readers_of_pace(self) -> np.ndarray:
        """Readers (m, n) of how fast each marker slides, along or across."""
        return self._beats[:, OF_A_MARKER]

    @cached_property
    def _powers(self) -> np.ndarray:
        """Readers (m, 4, n) of the powers of scaled time in each marker."""
        columns = smooth_swim(self.time_s, self.turn_rad, self.degrees[0], HARMONICS)
        return _readers(columns, self.usable)[:, : self.degrees[0] + 1]

    @cached_property
    def carriers(self) -> np.ndarray:
        """Share of each marker in the path, (m,)."""
        columns = smooth_swim(self.time_s, self.turn_rad, self.degrees[0], HARMONICS)
        smooth = determined(columns, self.usable, _PATH_INFLATION)
        often = smooth & (self.usable.mean(axis=0) >= _SHARE_OF_FRAMES)
        seen = next(each for each in (often, smooth, self.read) if each.any())
        return seen / seen.sum()

    @cached_property
    def readers(self) -> np.ndarray:
        """Derivatives (m, r, n) by a shift of each sample, along or across.

        They are those of the speed that way, of turning and of the beats. Where the course is read, the pace of the
        path comes before the beats, and that of the marker after them.
        """
        drift = self._drift(self.degrees[0])
        rates = np.gradient(drift, self.time_s, axis=0, edge_order=2).mean(axis=0)
        pieces = [(self.carriers[:, None] * np.einsum("c,mcn->mn", rates, self._powers))[:, None]]
        if self.span_m is not None:
            turning = np.zeros((self.usable.shape[1], 1, len(self.time_s)))
            columns, read = self._trend
            rate = np.gradient(columns, self.time_s, axis=0, edge_order=2).mean(axis=0) @ read / self.span_m
            turning[self.nose, 0, self._head_seen], turning[self.neck, 0, self._head_seen] = rate, -rate
            paces = self.carriers @ (self._beats[:, OF_A_MARKER] @ drift)  # paces of the path, as read off a marker
            path = self.carriers[:, None] * np.einsum("c,mcn->mn", paces, self._powers)
            pieces += [turning, path[:, None], self._beats]
        else:
            pieces.append(self._beats[:, :OF_A_MARKER])
        return np.concatenate(pieces, axis=1)

    @cached_property
    def sums(self) -> np.ndarray:
        """Weights (k, 2, m, r) with which the readers, along and across, add up to each number of the features.

        They hold to first order. The effect of an error of the heading on the forward speed is left out: some 0.2 mm/s
        sideways.
        """
        markers, readers, _ = self.readers.shape
        slides, course = (0, 0) if self.span_m is None else (min(markers, SLIDES), len(COURSE))
        markers_end = 1 + 2 * OF_A_MARKER * markers
        result = np.zeros((markers_end + slides + course, 2, markers, readers))
        result[SPEED, 0, :, 0] = 1.0
        result[markers_end + slides + np.arange(course), 1, :, np.arange(course)] = 1.0
        of_beats = 1 if self.span_m is None else len(COURSE) + 1
        beats = result[1:markers_end].reshape(markers, 2, OF_A_MARKER, 2, markers, readers)  # a view
        for axis in range(2):
            for marker in range(markers):
                beats[marker, axis, :, axis, marker, of_beats : of_beats + OF_A_MARKER] = np.eye(OF_A_MARKER)
        for marker in range(slides):
            result[markers_end + marker, 0, :, len(COURSE)] = -1.0
            result[markers_end + marker, 0, marker, -1] = 1.0
        return result

    def _along(self, position_m: np.ndarray, trend_rad: np.ndarray) -> np.ndarray:
        """Return the places (s, n, m) from the middle of the swim, x + i y, along headings (s, n).

        They are 0 where nothing counts.
        """
        place = np.where(self.usable, as_complex(position_m), 0.0)
        middle = place.sum(axis=(1, 2), keepdims=True) / self.usable.sum()
        return np.where(self.usable, (place - middle) * np.exp(-1j * trend_rad)[..., None], 0.0)

    def _path(self, place: np.ndarray) -> np.ndarray:
        """Return the smooth path (s, n) of the middle of the markers at places (s, n, m), x + i y.

        It is along the heading: there a beat stays a beat while the fish turns, and does not pass for a drift.
        """
        powers = np.einsum("m,mcn,snm->sc", self.carriers, self._powers, place)
        return powers @ self._drift(self.degrees[0]).T

    def _heading(self, position_m: np.ndarray) -> np.ndarray:
        """Return the smooth heading (s, n) from neck to nose, rad, of positions (s, n, m, 2)."""
        seen = self._head_seen
        axis = as_complex(position_m[:, seen, self.nose] - position_m[:, seen, self.neck])  # (s, k)
        columns, read = self._trend
        return np.unwrap(np.angle(axis), axis=-1) @ read.T @ columns.T

    @property
    def _head_seen(self) -> np.ndarray:
        """Return whether each frame shows nose and neck, (n,)."""
        return np.asarray(self.usable[:, self.nose] & self.usable[:, self.neck])

    @cached_property
    def _trend(self) -> tuple[np.ndarray, np.ndarray]:
        """Powers of scaled time (n, 3), and their reader (3, k) in the k frames that show nose and neck."""
        drift = self._drift(self.degrees[1])
        read = np.linalg.pinv(self._columns[self._head_seen])
        return drift, read[: drift.shape[1]]


def marker_part(features: np.ndarray) -> np.ndarray:
    """Return the part of features (..., k) that describes their markers, along and across, (..., m, 2, 7)."""
    return features[..., marker_slice(features.shape[-1])].reshape(*features.shape[:-1], -1, 2, OF_A_MARKER)


def marker_slice(length: int) -> slice:
    """Return the place of the markers in features of k numbers: between the speed and the course."""
    return slice(SPEED + 1, length - (length - 1) % (2 * OF_A_MARKER))


def places_of_slides(length: int) -> slice:
    """Return the place of the markers' slides in features of k numbers with a course."""
    return slice(marker_slice(length).stop, length - len(COURSE))


def harmonics_of(features: np.ndarray) -> np.ndarray:
    """Return the complex harmonics a - i b (..., m, 2, 3) of features (..., k): place = Re(harmonic exp(i h turn))."""
    beats = marker_part(features)
    return beats[..., 1::2] - 1j * beats[..., 2::2]


def advance_phase(features: np.ndarray, phase_rad: ArrayLike) -> np.ndarray:
    """Return the features (..., k) of the same swim with the crank ahead by an angle (...,).

    Args:
        features: (..., k).
        phase_rad: (...,) rad.
    """
    angles = np.multiply.outer(phase_rad, np.arange(1, HARMONICS + 1))
    turned = harmonics_of(features) * np.exp(1j * angles)[..., None, None, :]
    result, beats = np.array(features), np.array(marker_part(features))
    beats[..., 1::2], beats[..., 2::2] = turned.real, -turned.imag
    result[..., marker_slice(features.shape[-1])] = beats.reshape(*features.shape[:-1], -1)
    return result


def phase_between(features: np.ndarray, measured: np.ndarray, tail: list[int]) -> np.ndarray:
    """Return the phase (...,) by which features must be advanced to beat in step with the measured tail.

    Args:
        features: (..., k) simulated features.
        measured: (k,) measured features.
        tail: indices of the tail markers.
    """
    simulated, seen = (harmonics_of(part)[..., 0][..., tail, :] for part in (features, measured))
    return np.angle((simulated.conj() * seen).sum(axis=(-2, -1)))


def beat_phase(features: np.ndarray, tail: list[int]) -> np.ndarray:
    """Return the phase (...,) of the tail's sideways beat at time 0, rad; 0: it is farthest left.

    Args:
        features: (..., k).
        tail: indices of the tail markers.
    """
    return np.angle(harmonics_of(features)[..., tail, 1, 0].sum(axis=-1))


def _readers(columns: np.ndarray, usable: np.ndarray) -> np.ndarray:
    """Return the least-squares readers (m, c, n) of columns (n, c) over the usable samples (n, m) of each marker."""
    return np.stack([np.linalg.pinv(np.where(seen[:, None], columns, 0.0)) for seen in usable.T])


def as_complex(position_m: np.ndarray) -> np.ndarray:
    """Return places (..., 2) as complex numbers (...)."""
    return position_m[..., 0] + 1j * position_m[..., 1]
