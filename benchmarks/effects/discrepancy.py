"""Residual between the second simulator in its base state and the refitted twin, which every diagnosis may know.

`python -m benchmarks.effects.discrepancy diagnosis/discrepancy.npz` measures it anew, on all cores.
"""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from scipy.linalg import solve_triangular
from scipy.optimize import minimize, nnls
from scipy.special import logsumexp
from sklearn.covariance import ledoit_wolf

from benchmarks.cases import Run, run_cases
from benchmarks.effects.drawn import draw_world
from benchmarks.effects.filming import Filming, film_together
from benchmarks.effects.rows import SessionRows
from benchmarks.effects.suite import SessionPlan, recorded_by
from benchmarks.reality import Nuisances
from diagnosis.constants import SCALES
from diagnosis.discrepancy import Discrepancy, nearness
from fitting.features import advance_phase, beat_phase, harmonics_of
from fitting.pool import tail_markers
from fitting.signatures import PRIOR_SD, little, row_slopes
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.effects.catalogue import catalogue
from swimcal.robot import load_robot

LENGTH = 127  # Nine markers have this many features.
SEEDS = range(9000, 9200)  # Each seed makes one session.
WITH_EFFECTS = 25  # The responses to effects are simulated for this many sessions.
_START_SD_M = 2e-4  # Refits start from this standard deviation of the discrepancy, m and m/s.
_TOGETHER = 5  # This many sessions are simulated at a time.
_SIZES = np.geomspace(0.35, 1.4, 9)  # A twin's error may have these sizes, against its mean square over sessions.
_ROBUST_ROUNDS = 6
# A strength counts from this gain of log likelihood on: one session of 25 that calls for it is a false alarm.
_MIN_GAIN = 0.2
# Only a smaller strength counts: what is more is no twin's error that only looks like the effect.
_MAX_STRENGTH = 0.5
_START_STRENGTH = 0.1  # The search for a strength starts here.
_PRIOR_PAIRS = 5.0  # As many pairs of swims that have nothing in common are added, for all that is known before.
_MAX_COMMON_SHARE = 0.97  # Two swims have at most this share of a direction's variance in common.
HEAVY = {"segment_coefficients": (3.0, 0.1)}
"""Factor and share by effect: in a share of sessions the twin's own error looks like so many times as much of it.

Of 30 base sessions three call for 0.3 to 0.4 standard deviations of how coefficients change along the body, and most
for none: e^4.5 times as probable as if all had alike much. Of stiffness, damping, tendons and a current ahead nothing
of the kind shows; of a current across as much does, but of that the course tells.
"""
_TAIL = tail_markers(load_robot(), FISHSIM_MARKERS)
# A twin's error shows nothing of the effects of this family, as reality sees as it is.
_EXCLUDED_FAMILY = "measurement"


@dataclass(frozen=True, eq=False)
class BaseSession:
    """A robot that is as described, in water of some kind, with the twin refitted to it; without noise."""

    seed: int  # seed of the session
    frequency_hz: np.ndarray  # (t,) frequency of each swim
    measured: np.ndarray  # (t, 127) features of the swims, m and m/s
    residual: np.ndarray  # (t, 127) residual of the twin
    slopes: np.ndarray  # (k, 5) slopes of the features with the coefficients
    noise: np.ndarray  # (k, k) covariance that a tracker would add
    # (k,) change by one standard deviation of the prior, by effect and parameter; empty where it is not asked for
    columns: Mapping[tuple[str, int], np.ndarray]

    @property
    def phase_rad(self) -> np.ndarray:
        """(t,) phases at which the tails begin."""
        return beat_phase(self.measured, _TAIL)

    @property
    def in_phase(self) -> np.ndarray:
        """(t, 127) residual when all tails begin at phase 0."""
        return advance_phase(self.residual, -self.phase_rad)

    @property
    def noise_in_phase(self) -> np.ndarray:
        """(127, 127) mean noise covariance of the features of a trial, at that phase."""
        own = [slice(LENGTH * i, LENGTH * (i + 1)) for i in range(len(self.residual))]
        turns = [advance_phase(np.eye(LENGTH), -phase) for phase in self.phase_rad]
        return np.mean([turn.T @ self.noise[i, i] @ turn for turn, i in zip(turns, own, strict=True)], axis=0)


def base_sessions(seeds: Sequence[int], with_effects: bool) -> list[BaseSession]:
    """Simulate base sessions together, in the order of their seeds."""
    return film_together([_build_session(seed, with_effects) for seed in seeds])


def _build_session(seed: int, with_effects: bool) -> Filming[BaseSession]:
    plan = SessionPlan(f"base-{seed}", seed, recorded_by(np.random.default_rng([seed, 1])), "null")
    drawn = yield from draw_world(plan)
    drawn = replace(drawn, world=replace(drawn.world, nuisances=Nuisances()))
    plain = Discrepancy.independent(_START_SD_M**2 * np.eye(LENGTH))
    rows = SessionRows.of(drawn, (yield from drawn.recorded()), plain)
    residual = rows.residual_features
    columns: dict[tuple[str, int], np.ndarray] = {}
    if with_effects:
        every = {name: effect for name, effect in catalogue().items() if effect.family != _EXCLUDED_FAMILY}
        for signature in rows.signatures(every):
            for number, parameter in enumerate(signature.effect.parameters):
                slope = little(signature, number)
                if slope is not None:
                    columns[signature.effect.name, number] = parameter.sd * slope[: residual.size]
    slopes = row_slopes(rows.model, rows.coefficients)[: residual.size]
    hertz = np.array([each.trial.frequency.hz for each in rows.model.trials])
    return BaseSession(
        seed, hertz, rows.model.measured.reshape(residual.shape), residual, slopes, rows.tracking, columns
    )


def discrepancy_of(sessions: Sequence[BaseSession]) -> Discrepancy:
    """Estimate the discrepancy from many sessions: per trial, between two trials, and among all of a session.

    Its size maximises the likelihood of all sessions, each with a factor of its own; so does the strength of each
    effect that it resembles, alone, in the sessions with responses of effects.
    """
    found = in_common(sessions, robust_covariance([session.in_phase for session in sessions]))
    sizes = {size * scale for size in _SIZES for scale in SCALES}
    rows = {size: [_Row.of(session, found, size) for session in sessions] for size in sizes}
    by_size = [_compute_cost(_scale_rows(rows, size)) for size in _SIZES]
    size = _SIZES[int(np.argmin(by_size))]
    asked = [number for number, session in enumerate(sessions) if session.columns]
    rows = {each: [own[number] for number in asked] for each, own in rows.items()}
    strengths = _find_strengths(_scale_rows(rows, size))
    names = dict.fromkeys(name for name, _ in strengths)
    counts = {name: len(catalogue()[name].parameters) for name in names}
    by_name = {name: tuple(strengths.get((name, i), 0.0) for i in range(counts[name])) for name in names}
    return replace(found, directions=size * found.directions, strengths=by_name)


def in_common(sessions: Sequence[BaseSession], covariance: np.ndarray) -> Discrepancy:
    """Estimate what swims of one session have in common, by directions in which the residual is independent.

    Directions are those of a covariance (127, 127) against the noise of the tracks. In each of them both shares come
    from products of the residuals of two trials, by least squares with some pairs added that have nothing in common.
    """
    noise = np.mean([session.noise_in_phase for session in sessions], axis=0)
    root = np.linalg.cholesky(noise)
    half = solve_triangular(root, covariance, lower=True)
    variances, vectors = np.linalg.eigh(solve_triangular(root, half.T, lower=True))
    directions = root @ vectors * np.sqrt(variances)  # (127, 127)
    near, products, squares = [], [], []
    for session in sessions:
        along = np.linalg.solve(directions, session.in_phase.T)  # (127, t)
        along /= np.sqrt((along**2).mean())
        one, other = np.triu_indices(along.shape[1], 1)
        near += list(nearness(session.frequency_hz)[one, other])
        products += list((along[:, one] * along[:, other]).T)
        squares.append((along**2).mean(axis=1))
    variance = np.mean(squares, axis=0)  # shrinking has made the large ones too small
    design = np.vstack([np.column_stack([np.ones(len(near)), near]), np.sqrt(_PRIOR_PAIRS) * np.eye(2)])
    common = np.array([nnls(design, np.append(own, [0.0, 0.0]))[0] for own in np.transpose(products / variance)])
    common *= np.minimum(1.0, _MAX_COMMON_SHARE / np.maximum(common.sum(axis=1), _MAX_COMMON_SHARE))[:, None]
    beats = [advance_phase(session.measured, -session.phase_rad) for session in sessions]
    beat = np.mean(np.concatenate([harmonics_of(features)[:, :, 1, 0] for features in beats]), axis=0)
    return Discrepancy(directions * np.sqrt(variance), common, beat=beat)


def robust_covariance(residual: Sequence[np.ndarray]) -> np.ndarray:
    """Return the (127, 127) second moments of the residual (t, 127) in many sessions, shrunk (Ledoit and Wolf 2004).

    About zero, not about their mean: what the twin leaves of every swim alike is its error too. A session counts by its
    directions, not by its size (Tyler 1987), so that a few in which the twin is far off do not say how all are.
    """
    found = _shrink(residual)
    for _ in range(_ROBUST_ROUNDS):
        root = np.linalg.cholesky(found)
        sizes = np.array([np.sqrt((solve_triangular(root, own.T, lower=True) ** 2).mean()) for own in residual])
        sizes /= np.exp(np.log(sizes).mean())
        found = _shrink([own / size for own, size in zip(residual, sizes, strict=True)])
    return found


def _shrink(residual: Sequence[np.ndarray]) -> np.ndarray:
    pooled = np.vstack(residual)
    scale = np.sqrt((pooled**2).mean(axis=0))
    shrunk, _ = ledoit_wolf(pooled / scale, assume_centered=True)
    return np.asarray(shrunk * np.outer(scale, scale))


def _find_strengths(rows: Mapping[float, Sequence["_Row"]]) -> dict[tuple[str, int], float]:
    """Find the likeliest strength of each parameter when there is no other: how much of it these sessions look like.

    Of those that make the residual likelier.
    """
    every = sorted(set.intersection(*(set(row.across) for own in rows.values() for row in own)))
    without = _compute_cost(rows)
    found = {
        one: minimize(
            lambda log, one=one: _compute_cost(rows, one, np.exp(log[0])),
            [np.log(_START_STRENGTH)],
            method="Nelder-Mead",
        )
        for one in every
    }
    return {
        one: float(np.exp(best.x[0]))
        for one, best in found.items()
        if without - best.fun > _MIN_GAIN and np.exp(best.x[0]) < _MAX_STRENGTH
    }


@dataclass(frozen=True, eq=False)
class _Row:
    """A session, whitened: squares of the residual and of columns, their products, and the rest of its log density."""

    square: float
    squares: Mapping[tuple[str, int], float]
    across: Mapping[tuple[str, int], float]
    volume: float

    @classmethod
    def of(cls, session: BaseSession, discrepancy: Discrepancy, size: float) -> "_Row":
        of_features = size**2 * discrepancy.of_features(session.frequency_hz, session.phase_rad) + session.noise
        root = np.linalg.cholesky(of_features + session.slopes @ np.diag(PRIOR_SD**2) @ session.slopes.T)
        noise = np.linalg.cholesky(session.noise) @ np.random.default_rng([session.seed, 7]).standard_normal(len(root))
        residual = solve_triangular(root, session.residual.ravel() + noise, lower=True)
        white = {key: solve_triangular(root, column, lower=True) for key, column in session.columns.items()}
        return cls(
            float(residual @ residual),
            {key: float(column @ column) for key, column in white.items()},
            {key: float(column @ residual) for key, column in white.items()},
            -float(np.log(np.diag(root)).sum()),
        )

    def log_density(self, one: tuple[str, int] | None, strength: float) -> float:
        """Return the log density, up to a constant, with so much of one parameter's column, or with none."""
        alone = self.volume - 0.5 * self.square
        if one is None:
            return alone
        freed = 1 + strength**2 * self.squares[one]
        return float(alone + 0.5 * (strength * self.across[one]) ** 2 / freed - 0.5 * np.log(freed))


def _scale_rows(rows: Mapping[float, Sequence[_Row]], size: float) -> dict[float, Sequence[_Row]]:
    """Return rows by the size that a session may have relative to most."""
    return {scale: rows[size * scale] for scale in SCALES}


def _compute_cost(
    rows: Mapping[float, Sequence[_Row]], one: tuple[str, int] | None = None, strength: float = 0.0
) -> float:
    """Return -ln of the likelihood of so much of one parameter, or of none; each session has one of the sizes."""
    of_sizes = [[row.log_density(one, strength) + np.log(SCALES[scale]) for row in own] for scale, own in rows.items()]
    return -float(logsumexp(of_sizes, axis=0).sum())


def save(found: Discrepancy, path: Path, seeds: Sequence[int]) -> None:
    """Write the discrepancy, for `Discrepancy.load`, with the seeds of the sessions that it was found from."""
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez_compressed(
        path,
        directions=found.directions.astype(np.float32),
        common=found.common.astype(np.float32),
        effects=np.array([name for name, own in found.strengths.items() for _ in own], dtype=np.str_),
        strengths=np.array([strength for own in found.strengths.values() for strength in own], dtype=float),
        beat=found.beat.astype(np.complex64),
        heavy=np.array(list(found.heavy), dtype=np.str_),
        heavy_tails=np.reshape(list(found.heavy.values()), (-1, 2)),
        seeds=np.array(seeds),
    )


def measure(path: Path, workers: int = 0) -> None:
    """Simulate the sessions, and write the discrepancy that they show."""
    asked, others = SEEDS[:WITH_EFFECTS], SEEDS[WITH_EFFECTS:]
    found: list[BaseSession] = []
    for seeds, with_effects in ((asked, True), (others, False)):
        batches = {str(first): list(seeds[first : first + _TOGETHER]) for first in range(0, len(seeds), _TOGETHER)}
        run = Run(workers, progress=lambda done, _: print(f"{_TOGETHER} sessions each: {done}", file=sys.stderr))
        work = partial(base_sessions, with_effects=with_effects)
        if failures := run_cases(work, batches, run, found.extend):
            raise RuntimeError(f"{failures[0].name}: {failures[0].message}")
    found.sort(key=lambda session: session.seed)
    save(replace(discrepancy_of(found), heavy=HEAVY), path, list(SEEDS))


if __name__ == "__main__":
    measure(Path(sys.argv[1]))
