"""Tracking noise that lasts: its size at each marker, its duration, and its correlation between neighbours.

Errors of a box stay for several frames, so a trial holds far fewer independent samples than frames. The noise of each
marker is taken as an Ornstein-Uhlenbeck process with a share of white noise (the tracker's grid); where the tracks ask
for it a slow smooth process is added, as real fish sway besides their beat, and neighbours do so together. `noise_of`
finds all of it by restricted maximum likelihood (Patterson and Thompson 1971) in the residual after drift and
harmonics.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import brentq, minimize
from threadpoolctl import threadpool_limits

from fitting.features import FeatureReader
from fitting.pool import determined, smooth_swim
from tracking.body_model import rows_alike

_HARMONICS = 5  # harmonics that are taken out
_DRIFT = 3  # degree of the drift that is taken out
_START = (np.log(0.08), -1.5)  # ln seconds, logit of the white share
_WITH_SWAY = (np.log(0.06), -1.5, np.log(0.25), 0.5)  # also ln seconds of a sway, logit of its share of the rest
_STEP = 0.8  # step of each of these in the first simplex
_PRIOR_SD = 1.5  # prior standard deviation of each of these
_WORTH = 10.0  # fall of -2 ln likelihood that supports a sway: chance makes it in fewer than 1 of 100 trials
_LEAST_M = 1e-6  # least standard deviation of a marker
_JITTER = 1e-9  # added to a diagonal so that roots exist
_WORST = 1e4  # variance of drift and harmonics, see `determined`: they are only taken out
_AT_ONCE = 512  # frames between which covariances are held at once
_MOST_FRAMES = 1200  # frames that the noise is estimated from, at most: 20 s at 60 frames a second
_LEAST_EIGENVALUE = 0.02  # least eigenvalue of correlations between markers


# Parts of the noise, and how they go from marker to marker.


@dataclass(frozen=True, eq=False)
class NoisePart:
    """A part of the noise of every marker.

    Attributes:
        share: share of a marker's variance.
        scale_s: time in which the correlation of an Ornstein-Uhlenbeck process falls to 1/e; of a smooth process
            (squared exponential) to exp(-1/2).
        smooth: which of the two it is.
        across: (m, m) correlation between markers; (0, 0) where it is not known yet.
    """

    share: float
    scale_s: float
    smooth: bool
    across: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))

    def over(self, time_s: np.ndarray, other_s: np.ndarray | None = None) -> np.ndarray:
        """Return the covariance (n, k) of a marker of unit variance.

        Args:
            time_s: (n,) times, s.
            other_s: (k,) times against which; default: the same.
        """
        other_s = time_s if other_s is None else other_s
        return self.share * falling(np.abs(time_s[:, None] - other_s), self.scale_s, self.smooth)

    def spread(self, rows: np.ndarray, time_s: np.ndarray) -> np.ndarray:
        """Return rows (..., n) times the covariance between times (n,), which is never held as a whole.

        Args:
            rows: (..., n).
            time_s: (n,) times, s.
        """
        flat, firsts = rows.reshape(-1, len(time_s)), range(0, len(time_s), _AT_ONCE)
        found = [flat @ self.over(time_s, time_s[first : first + _AT_ONCE]) for first in firsts]
        return np.concatenate(found, axis=-1).reshape(rows.shape)


def falling(lag_s: np.ndarray, scale_s: float, smooth: bool) -> np.ndarray:
    """Return the correlation over a lag of any shape.

    Args:
        lag_s: lags, s.
        scale_s: time scale, s.
        smooth: whether it is a squared exponential; else it is exponential.
    """
    lags = lag_s / scale_s
    return np.exp(-0.5 * lags**2) if smooth else np.exp(-lags)


def across_markers(
    series: np.ndarray,
    usable: np.ndarray,
    columns: np.ndarray,
    parts: Sequence[np.ndarray],
    correlation: np.ndarray,
) -> list[np.ndarray]:
    """Estimate the correlation between markers (m, m) of each part of the noise.

    One step of Fisher's scoring of the restricted likelihood from independent markers, which are Rao's minimum norm
    quadratic estimates (MINQUE; Rao 1971, J. Multivar. Anal. 1, 257). Slow parts of real tracks are common to
    neighbours and fast ones are not, so each part has a correlation of its own. It is shrunk towards one that is the
    same between all markers by how much chance alone would scatter it (Schaefer and Strimmer 2005, Stat. Appl. Genet.
    Mol. Biol. 4, 32; the target of Ledoit and Wolf 2004, J. Portf. Manag. 30, 110): towards independence, what all have
    in common, which moves the speed most, would be lost.

    Args:
        series: (n, m, 2) of the markers, in their standard deviations; both coordinates count alike.
        usable: (n, m) samples that count.
        columns: (n, c) that are taken out of each.
        parts: (n, n) covariance in time of each part.
        correlation: (n, n) in time of them all and of white noise.
    """
    groups, which = list(rows_alike(usable.T)), np.zeros(usable.shape[1], int)
    for number, (_, alike) in enumerate(groups):
        which[alike] = number
    masks = np.column_stack([mask for mask, _ in groups])
    shown = determined(columns, masks, _WORST)
    restricted = [_restrict(columns, mask & good, correlation) for mask, good in zip(masks.T, shown, strict=True)]
    reach = [[inverse @ part for inverse in restricted] for part in parts]  # [p][g] (n, n)
    # Fisher's information (p, p, g, g) of two coordinates, between parts, for a pair of independent markers
    fisher = np.array([[[[2 * (a * b.T).sum() for b in other] for a in own] for other in reach] for own in reach])
    common = fisher[:, :, which[:, None], which]  # (p, p, m, m)
    clean = np.where(usable[..., None], series, 0.0)
    residual = np.stack([restricted[group] @ clean[:, m] for m, group in enumerate(which)])  # (m, n, 2)
    across = (np.einsum("inx,nk,jkx->ij", residual, part, residual, optimize=True) for part in parts)
    seen = np.array(list(across))  # (p, m, m)
    information = np.moveaxis(common, (0, 1), (-2, -1))  # (m, m, p, p)
    # One more sample, of independent markers, gives a pair that is never seen together an inverse.
    inverse = np.linalg.inv(information + np.eye(len(parts)))
    found = np.einsum("ijpq,qij->pij", inverse, seen)
    variance = np.einsum("ijpq,ijqr,ijrp->pij", inverse, information, inverse)
    return [_shrink(*pair) for pair in zip(found, variance, strict=True)]


def _restrict(columns: np.ndarray, mask: np.ndarray, correlation: np.ndarray) -> np.ndarray:
    """Return the inverse (n, n) of the correlation in the frames of a mask, less columns (n, c); 0 in all others."""
    frames, result = np.flatnonzero(mask), np.zeros_like(correlation)
    if len(frames):
        inverse, design = np.linalg.inv(correlation[np.ix_(frames, frames)]), columns[frames]
        solved = inverse @ design
        result[np.ix_(frames, frames)] = inverse - solved @ np.linalg.solve(design.T @ solved, solved.T)
    return result


def _shrink(found: np.ndarray, variance: np.ndarray) -> np.ndarray:
    """Shrink a correlation (m, m) by how far chance scatters it.

    Each pair goes towards what all pairs have in common in the mean, by how much of their scatter chance alone would
    give; and that towards independence. A pair that was never seen together has what all have in common.
    """
    pairs = np.triu(variance > 0, 1)  # pairs that were seen together
    if not pairs.any():
        return np.eye(len(found))
    common = _remove_chance(found[pairs].mean(), variance[pairs].mean() / pairs.sum())
    own = _remove_chance(found - common, variance[pairs].mean(), np.mean((found[pairs] - common) ** 2))
    matrix = common + np.where(variance > 0, own, 0.0)
    np.fill_diagonal(matrix, 1.0)
    values, vectors = np.linalg.eigh((matrix + matrix.T) / 2)
    definite = (vectors * np.maximum(values, _LEAST_EIGENVALUE)) @ vectors.T
    size = np.sqrt(np.diag(definite))
    return np.asarray(definite / np.outer(size, size))


def _remove_chance(found: np.ndarray, chance: float, square: float | None = None) -> np.ndarray:
    """Shrink an estimate by the share of its mean square (default: its own square) that chance would give."""
    square = float(found**2) if square is None else square
    return max(1.0 - chance / max(square, 1e-12), 0.0) * found


# The noise of a trial's tracks.


@dataclass(frozen=True, eq=False)
class FeatureNoise:
    """Noise of one trial's tracks.

    Attributes:
        sd_m: (m,) standard deviation of each marker in each coordinate; nan for those that are not read.
        parts: the parts that last, with their correlation between markers; the rest of the variance is white.
        time_s: (n,) times of the frames.
    """

    sd_m: np.ndarray
    parts: Sequence[NoisePart]
    time_s: np.ndarray

    @classmethod
    def typical(cls, noises: Sequence["FeatureNoise"], time_s: np.ndarray) -> "FeatureNoise":
        """Build the mean of the noises of some trials, for frames at times (n,); sizes are their medians."""
        parts = [replace(part, share=part.share / len(noises)) for noise in noises for part in noise.parts]
        sizes = np.array([noise.sd_m for noise in noises])
        worst = np.nanmax(sizes)  # size for a marker that none of them shows
        middle = [np.median(own[np.isfinite(own)]) if np.isfinite(own).any() else worst for own in sizes.T]
        return cls(np.array(middle), parts, time_s)

    @property
    def white(self) -> float:
        """Share of the variance that is white, and each marker's own."""
        return 1.0 - sum(part.share for part in self.parts)

    @property
    def lasts_s(self) -> float:
        """Time in which the correlation of all parts together falls to 1/e, s."""

        def above(lag_s: float) -> float:
            parts = self.parts
            return float(sum(p.share * (falling(np.array(lag_s), p.scale_s, p.smooth) - np.exp(-1)) for p in parts))

        return float(brentq(above, 0.0, 2.0 * max(part.scale_s for part in self.parts)))

    @property
    def effective(self) -> float:
        """Number of independent frames that would determine a mean as well."""
        n, ones = len(self.time_s), np.ones(len(self.time_s))
        return float(n**2 / (n * self.white + sum(part.spread(ones, self.time_s).sum() for part in self.parts)))

    def correlation(self, time_s: np.ndarray) -> np.ndarray:
        """Return the correlation (n, n) of a marker between times (n,)."""
        return _correlation(self.parts, time_s)

    def drawn(self, time_s: np.ndarray, random: np.random.Generator) -> np.ndarray:
        """Draw errors (n, m, 2) like these in frames at times (n,), m.

        Args:
            time_s: (n,) times of the frames.
            random: the generator.
        """
        shape = (2, len(time_s), len(self.sd_m))
        total = np.sqrt(max(self.white, 0.0)) * random.standard_normal(shape)
        for part in self.parts:
            in_time, across = (
                np.linalg.cholesky(matrix + _JITTER * np.eye(len(matrix)))
                for matrix in (part.over(time_s), part.across)
            )
            total += in_time @ random.standard_normal(shape) @ across.T
        return np.moveaxis(total, 0, -1) * np.nan_to_num(self.sd_m)[:, None]

    def covariance(self, reader: FeatureReader) -> np.ndarray:
        """Return the covariance (k, k) of the features of these frames."""
        each = self.between(reader.readers, reader.time_s)
        both = np.moveaxis(reader.sums, 1, 0).reshape(2, len(reader.sums), -1)  # (2, k, m r)
        return np.asarray(sum(sums @ each.reshape((sums.shape[1],) * 2) @ sums.T for sums in both))

    def between(self, readers: np.ndarray, time_s: np.ndarray) -> np.ndarray:
        """Return the covariance (m, r, m, r) of what readers (m, r, n) read of each marker, along or across.

        Args:
            readers: (m, r, n) weights of the frames.
            time_s: (n,) times of the frames.
        """
        rows = np.nan_to_num(self.sd_m)[:, None, None] * readers
        each = np.zeros(rows.shape[:2] * 2)
        for part in self.parts:
            spread = part.spread(rows, time_s)
            each += part.across[:, None, :, None] * np.einsum("iam,jbm->iajb", spread, rows)
        for m, own in enumerate(rows):
            each[m, :, m] += (self.white + _JITTER) * own @ own.T
        return each


def noise_of(reader: FeatureReader, position_m: np.ndarray, *, may_sway: bool = True) -> FeatureNoise:
    """Estimate the noise of tracks.

    Of more than `_MOST_FRAMES` frames it reads every second, third and so on: work grows with the cube of their number.

    Args:
        reader: reader of n frames.
        position_m: (n, m, 2) positions in these, m.
        may_sway: whether a slow smooth process may be part of it.
    """
    some = slice(None, None, -(-len(position_m) // _MOST_FRAMES))
    columns, time_s, usable = (each[some] for each in (beside(reader), reader.time_s, reader.usable))
    position_m = position_m[some]
    groups = _by_mask(usable, position_m, columns)
    with threadpool_limits(1):  # the matrices are small: threads cost more than they save
        parts, sd_m = _in_time(groups, columns, time_s, usable.shape[1], may_sway)
        sd_m = np.where(np.isfinite(sd_m), np.maximum(sd_m, _LEAST_M), np.nanmax(sd_m))  # hardly seen: as the worst
        sd_m[~reader.read] = np.nan
        in_time, correlation = [part.over(time_s) for part in parts], _correlation(parts, time_s)
        across = across_markers(position_m / sd_m[:, None], usable, columns, in_time, correlation)
    together = [replace(part, across=each) for part, each in zip(parts, across, strict=True)]
    return FeatureNoise(sd_m, together, reader.time_s)


def covariance_of_creeps(reader: FeatureReader, position_m: np.ndarray, along_m: np.ndarray) -> np.ndarray:
    """Return the covariance (m, m) of `FeatureReader.creeps` by the noise of tracks, m^2/s^2.

    A marker sways together with its neighbours, and less against them than by itself. So the noise is estimated from
    its places against its neighbours.

    Args:
        reader: reader of n frames.
        position_m: (n, m, 2) positions in these, m.
        along_m: (m,) places of the markers along the straight robot.
    """
    aside_m, usable = reader.aside_of_neighbours(position_m, along_m)
    found, judged = np.zeros((len(along_m),) * 2), np.flatnonzero(usable.any(axis=0))
    if len(judged):
        own = replace(reader, usable=usable[:, judged])
        noise = noise_of(own, np.stack([aside_m.real, aside_m.imag], axis=-1)[:, judged], may_sway=False)
        found[np.ix_(judged, judged)] = noise.between(reader.readers_of_pace[judged, None], reader.time_s)[:, 0, :, 0]
    return found


def beside(reader: FeatureReader) -> np.ndarray:
    """Return the regressors (n, 14) of drift and harmonics that are fitted before noise is estimated.

    There are fewer harmonics where a beat has few frames.
    """
    turn_a_frame = float(np.ptp(reader.turn_rad)) / (len(reader.turn_rad) - 1)
    harmonics = min(_HARMONICS, int((2 * np.pi / turn_a_frame - 1) / 2))
    return smooth_swim(reader.time_s, reader.turn_rad, _DRIFT, harmonics)


def _plain(x: np.ndarray) -> list[NoisePart]:
    return [NoisePart(1.0 - _logistic(x[1]), float(np.exp(x[0])), False)]


def _swaying(x: np.ndarray) -> list[NoisePart]:
    lasting, sway = 1.0 - _logistic(x[1]), _logistic(x[3])
    return [
        NoisePart(lasting * (1.0 - sway), float(np.exp(x[0])), False),
        NoisePart(lasting * sway, float(np.exp(x[2])), True),
    ]


def _in_time(
    groups: Sequence["_Group"], columns: np.ndarray, time_s: np.ndarray, markers: int, may_sway: bool
) -> tuple[list[NoisePart], np.ndarray]:
    """Return the lasting parts, and the standard deviations (m,); nan for a marker that is hardly seen."""

    def found(parts_of: Callable[[np.ndarray], list[NoisePart]], start: np.ndarray) -> tuple[float, list[NoisePart]]:
        def deviance(x: np.ndarray) -> float:
            matrix = _correlation(parts_of(x), time_s)
            prior = (((x - start) / _PRIOR_SD) ** 2).sum()
            return sum(group.restricted(columns, matrix)[0] for group in groups) + prior

        simplex = start + _STEP * np.vstack([np.zeros(len(start)), np.eye(len(start))])
        options = {"xatol": 0.03, "fatol": 0.3, "initial_simplex": simplex}
        best = minimize(deviance, start, method="Nelder-Mead", options=options)
        return float(best.fun), parts_of(best.x)

    plain = found(_plain, np.array(_START))
    swaying = found(_swaying, np.array(_WITH_SWAY)) if may_sway else plain
    parts = swaying[1] if swaying[0] < plain[0] - _WORTH else plain[1]
    matrix, sd_m = _correlation(parts, time_s), np.full(markers, np.nan)
    for group in groups:
        sd_m[group.markers] = group.restricted(columns, matrix)[1]
    return parts, sd_m


def _correlation(parts: Sequence[NoisePart], time_s: np.ndarray) -> np.ndarray:
    """Return the correlation (n, n) of lasting parts, and of white noise for the rest of the variance."""
    matrix = sum((part.over(time_s) for part in parts), np.zeros((len(time_s), len(time_s))))
    matrix[np.diag_indices_from(matrix)] = 1.0 + _JITTER
    return matrix


def _logistic(value: float) -> float:
    return float(1 / (1 + np.exp(-value)))


@dataclass(frozen=True, eq=False)
class _Group:
    """Markers seen in the same frames: frames (k,), markers (g,), series (k, 2 g)."""

    frames: np.ndarray
    markers: np.ndarray
    series: np.ndarray

    def restricted(self, columns: np.ndarray, correlation: np.ndarray) -> tuple[float, np.ndarray]:
        """Return -2 ln of the restricted likelihood, and the standard deviations (g,)."""
        factor = cho_factor(correlation[np.ix_(self.frames, self.frames)], lower=True)
        design = columns[self.frames]
        solved = cho_solve(factor, design)
        information = design.T @ solved
        residual = self.series - design @ np.linalg.solve(information, solved.T @ self.series)
        squares = (residual * cho_solve(factor, residual)).sum(axis=0)  # (2 g,)
        freedom = len(self.frames) - columns.shape[1]
        variance = squares.reshape(-1, 2).mean(axis=1) / freedom + _LEAST_M**2  # (g,)
        volume = 2 * np.log(np.diag(factor[0])).sum() + np.linalg.slogdet(information)[1]
        return float(2 * (freedom * np.log(variance)).sum() + len(squares) * volume), np.sqrt(variance)


def _by_mask(usable: np.ndarray, position_m: np.ndarray, columns: np.ndarray) -> list[_Group]:
    """Group markers by the frames they are seen in, if these determine drift and harmonics."""
    patterns = list(rows_alike(usable.T))
    masks = np.column_stack([mask for mask, _ in patterns])
    shown = determined(columns, masks, _WORST)
    shown = shown if shown.any() else masks.sum(axis=0) == masks.sum(axis=0).max()
    groups = []
    for mask, markers in (pattern for pattern, good in zip(patterns, shown, strict=True) if good):
        frames = np.flatnonzero(mask)
        groups.append(_Group(frames, markers, position_m[np.ix_(frames, markers)].reshape(len(frames), -1)))
    return groups
