"""What goes beside the beat: motion of the whole fish in no step with the crank, and beats that keep no time.

Features hold what repeats with the crank; what does not would pass for tracking noise. But a tracker errs at each
marker by itself. Waves, eddies, a tether or a camera that shakes move all markers together; a recorder that loses
frames, or a drive that slips, makes all of them late by the same time, each by as much as it moves in that. So what
drift and harmonics leave of the markers, but for how a swim settles, is split over short stretches of time into a
motion of the whole (along, across, turning), into a delay, and the rest, which tells the noise. Under noise alone all
have the same variance (analysis of variance; Fisher 1925).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.special import logsumexp

from diagnosis.constants import LEAST_OF_DELAY, LEAST_OF_MOTION, MOST_BESIDE
from fitting.model.features import FeatureReader
from fitting.model.noise import beside
from fitting.trial import MeasuredTrial

_STRETCH_S = 0.25  # longer than trackers err alike
_LASTING = 0.5  # of all stretches, as many as count for independent: trackers err alike for a little longer yet
_SIZES = 10  # that are tried
_WANDERS_S = 0.5  # in which a beat comes earlier or later
_SLOWLY = 3  # power of time up to which a beat comes earlier or later as motors warm and slow down
_SETTLES_S = (0.3, 1.0)  # in which a fish that has just started comes up to its speed
_WHOLE = 3  # along, across, turning
_MOSTLY = 0.8  # of the frames, in which a marker must count
_LEAST_M = 1e-4  # noise of a marker, below which none is believed
_LEAST_SQUARE = 1e-9  # of tracks without any noise
_ROUNDS = 3  # in which each marker's own noise is found


class NonPeriodicSize(NamedTuple):
    """One kind: rms without noise, m of a motion, s of a delay; log Bayes factor against noise alone."""

    rms: float
    log_odds: float


class NonPeriodic(NamedTuple):
    """Of a session: the motion of the whole fish, and how late its beats are."""

    motion: NonPeriodicSize
    delay: NonPeriodicSize


class _Squares(NamedTuple):
    """Mean squares in units of each marker's noise: of one kind and of the rest, and numbers of either; and `rms`."""

    own: float
    rest: float
    own_count: float
    rest_count: float
    rms: float


@dataclass(frozen=True, eq=False)
class _Swim:
    """n frames of a trial in which all m markers count that mostly do; places along + i across, m."""

    columns: np.ndarray  # (n, c) drift, harmonics and settling
    fitted: np.ndarray  # (n, m) what these are of the markers
    residual: np.ndarray  # (n, m) what these leave
    speed: np.ndarray  # (n, m) of the markers, m/s
    time_s: np.ndarray  # (n,)
    stretch: np.ndarray  # (n,) number of each frame's

    @classmethod
    def of(cls, trial: MeasuredTrial) -> "_Swim | None":
        """None where frames, or markers, are too few."""
        features = FeatureReader.of(trial)
        usable = features.usable.mean(axis=0) >= _MOSTLY
        frames = np.flatnonzero(features.usable[:, usable].all(axis=1))
        begun_s = features.time_s - features.time_s[0]
        columns = np.column_stack([beside(features), *(np.exp(-begun_s / each) for each in _SETTLES_S)])[frames]
        stretch = np.floor(features.time_s[frames] / _STRETCH_S).astype(int)
        if len(np.unique(stretch)) <= columns.shape[1] or usable.sum() <= _WHOLE:
            return None
        time_s = features.time_s[frames]
        place, cruise = (each[frames] for each in features.cruising(trial.position_m[trial.kept]))
        residual = _beside(columns, place[:, usable])
        fitted = place[:, usable] - residual
        speed = cruise[:, None] + np.gradient(fitted, time_s, axis=0)
        return cls(columns, fitted, residual, speed, time_s, stretch)

    @cached_property
    def _numbers(self) -> np.ndarray:
        return np.unique(self.stretch)

    @property
    def motion(self) -> _Squares:
        """Of the whole, however a beat wanders in time, and beside what is late."""
        count = max(round(float(np.ptp(self.time_s)) / _WANDERS_S), 1) + 1
        knots = np.linspace(self.time_s[0], self.time_s[-1], count)
        hats = np.maximum(1 - np.abs(self.time_s[:, None] - knots) / (knots[1] - knots[0]), 0.0)
        split = self._split(self.residual - self._late(hats), delay_first=True)
        return self._squares(split.own, split.rest, float(np.sqrt(2 * np.mean(split.moved_m**2))))

    @property
    def delay(self) -> _Squares:
        """Of the beat, but for what is slow, and beside what moves the whole."""
        begun = np.linspace(-1.0, 1.0, len(self.time_s))
        residual = self.residual - self._late(np.vander(begun, _SLOWLY + 1))
        split = self._split(residual, delay_first=False)
        return self._squares(split.own, split.rest, float(np.sqrt((split.own**2).sum() / (split.of_one**2).sum())))

    def _squares(self, own: np.ndarray, rest: np.ndarray, rms: float) -> _Squares:
        # Slow delays take no further numbers: in the sessions of development drift and harmonics already hold them.
        free = 1 - self.columns.shape[1] / len(own)
        rest_count = len(own) * (2 * self.residual.shape[1] - _WHOLE - 1)
        own_square, rest_square = (own**2).sum() / own.size, (np.abs(rest) ** 2).sum() / rest_count
        rest_square = max(rest_square, 0.5)  # where markers are better than is believed
        share = max(1 - rest_square / max(own_square, _LEAST_SQUARE), 0.0)
        return _Squares(own_square, rest_square, free * own.size, free * rest_count, float(np.sqrt(share) * rms))

    def _late(self, delays: np.ndarray) -> np.ndarray:
        """(n, m) what is left when beats come late by a mixture of delays (n, d), as much as explains most."""
        shifted = _beside(self.columns, (self.speed[..., None] * delays[:, None]).reshape(len(delays), -1))
        shifted = shifted.reshape(-1, delays.shape[1])
        both, residual = np.concatenate([shifted.real, shifted.imag]), self.residual.ravel()
        amounts = np.linalg.lstsq(both, np.concatenate([residual.real, residual.imag]), rcond=None)[0]
        return np.asarray((shifted @ amounts).reshape(self.residual.shape))

    def _split(self, residual: np.ndarray, delay_first: bool) -> "_Split":
        """Of what is left (n, m), each marker's noise found on the way."""
        noise = np.ones(residual.shape[1])
        for _ in range(_ROUNDS):
            stretches = [self._stretch(residual, noise, self.stretch == each, delay_first) for each in self._numbers]
            split = _Split(*map(np.array, zip(*stretches, strict=True)))
            noise = np.maximum(np.sqrt((np.abs(split.rest) ** 2).mean(axis=0)) * noise, _LEAST_M)
        return split

    def _stretch(self, residual: np.ndarray, noise: np.ndarray, own: np.ndarray, delay_first: bool) -> "_Split":
        """Of the frames of one (n,)."""
        arm = self.fitted[own].mean(axis=0) - self.fitted[own].mean()
        whole, late = [np.ones_like(arm), 1j * np.ones_like(arm), 1j * arm], [self.speed[own].mean(axis=0)]
        modes = np.array([*late, *whole] if delay_first else [*whole, *late])
        weight, markers = np.concatenate([1 / noise, 1 / noise]), len(noise)
        basis, triangle = np.linalg.qr(np.hstack([modes.real, modes.imag]).T * weight[:, None])  # (2 m, 4)
        seen = residual[own].mean(axis=0)
        row = np.concatenate([seen.real, seen.imag]) * weight
        parts = basis.T @ row
        rest = row - basis @ parts
        second = slice(1, None) if delay_first else slice(_WHOLE, None)
        return _Split(
            parts[second],
            rest[:markers] + 1j * rest[markers:],
            (basis[:, second] @ parts[second]) / weight,
            np.diag(triangle)[second],
        )


class _Split(NamedTuple):
    """Of b stretches, or of one: of the kind that is asked for, beside the other."""

    own: np.ndarray  # (b, d) in directions of its own, over noise
    rest: np.ndarray  # (b, m) what neither kind holds, over each marker's noise
    moved_m: np.ndarray  # (b, 2 m) by which markers are moved, along and then across
    of_one: np.ndarray  # (b, d) what one unit of it would be in these directions


def non_periodic(trials: Sequence[MeasuredTrial]) -> NonPeriodic:
    """What moves the fish in these trials, or makes it late; nothing where no trial tells."""
    swims = [each for each in map(_Swim.of, trials) if each is not None]
    return NonPeriodic(
        _together([each.motion for each in swims], LEAST_OF_MOTION),
        _together([each.delay for each in swims], LEAST_OF_DELAY),
    )


def _together(squares: Sequence[_Squares], least: float) -> NonPeriodicSize:
    if not squares:
        return NonPeriodicSize(0.0, 0.0)
    own, rest = (sum(getattr(each, name) for each in squares) for name in ("own_count", "rest_count"))
    ratio = sum(each.own / each.rest * each.own_count for each in squares) / own
    rms = float(np.sqrt(np.mean([each.rms**2 for each in squares])))
    return NonPeriodicSize(rms, _log_odds(ratio, _LASTING * own, _LASTING * rest, least))


def _log_odds(ratio: float, own: float, rest: float, least: float) -> float:
    """Of a ratio of mean squares of so many numbers: by variances `least` times apart or more, against equal ones."""
    excess, ratios = own * ratio / rest, np.geomspace(least, MOST_BESIDE, _SIZES)
    logs = -0.5 * own * np.log(ratios) + 0.5 * (own + rest) * (np.log1p(excess) - np.log1p(excess / ratios))
    return float(logsumexp(logs) - np.log(len(logs)))


def _beside(columns: np.ndarray, series: np.ndarray) -> np.ndarray:
    """(n, k) what columns (n, c) leave of series (n, k)."""
    return np.asarray(series - columns @ np.linalg.lstsq(columns, series, rcond=None)[0])
