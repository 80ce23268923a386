"""What remains between reality in its base state and the refitted twin, which every diagnosis may know.

`python -m calib.benchmarks.effects.discrepancy diagnosis/discrepancy.npz` measures it anew, on all cores.
"""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from scipy.linalg import block_diag, solve_triangular
from scipy.optimize import minimize
from sklearn.covariance import ledoit_wolf

from calib.benchmarks.effects.drawn import draw_world
from calib.benchmarks.effects.filming import Filming, film_together
from calib.benchmarks.effects.rows import SessionRows
from calib.benchmarks.effects.suite import SessionPlan, recorded_by
from calib.benchmarks.spread import spread
from diagnosis import Discrepancy
from diagnosis.normal import Normal
from fitting.signatures.session_row import PRIOR_SD, row_slopes
from fitting.signatures.slopes import little
from reality import Nuisances
from swimmer.effects import catalogue

LENGTH = 127  # of a gait of nine markers
SEEDS, WITH_EFFECTS = range(9000, 9200), 25  # of sessions; how many of them are asked what effects would do
_STARTED_M = 2e-4  # standard deviation that refits start from, m and m/s
_TOGETHER = 5  # sessions that are simulated at a time
_SIZES = np.geomspace(0.35, 1.4, 9)  # of a twin's error against its mean square over sessions
_ROBUST = 6  # rounds
_GAIN = 3.0  # of log likelihood, for which one more effect is taken in
_FIRST = 0.1  # strength that is tried first
_NEVER = "measurement"  # family of effects of which a twin's error shows nothing: reality sees as it is


@dataclass(frozen=True, eq=False)
class BaseSession:
    """A robot that is as described, in water of some kind, beside the twin refitted to it; without noise.

    Attributes:
        seed: of the session.
        left: (t, 127) what the twin leaves of each swim's gait.
        slopes: (k, 5) of these with the coefficients.
        noise: (k, k) that a tracker would add.
        columns: by effect and parameter, (k,) what one standard deviation of its prior does; empty where not asked.
    """

    seed: int
    left: np.ndarray
    slopes: np.ndarray
    noise: np.ndarray
    columns: Mapping[tuple[str, int], np.ndarray]


def base_sessions(seeds: Sequence[int], with_effects: bool) -> list[BaseSession]:
    """Simulated together, in this order."""
    return film_together([_session(seed, with_effects) for seed in seeds])


def _session(seed: int, with_effects: bool) -> Filming[BaseSession]:
    plan = SessionPlan(f"base-{seed}", seed, recorded_by(np.random.default_rng([seed, 1])), "null")
    drawn = yield from draw_world(plan)
    drawn = replace(drawn, world=replace(drawn.world, nuisances=Nuisances()))
    plain = Discrepancy(_STARTED_M**2 * np.eye(LENGTH))
    rows = SessionRows.of(drawn, (yield from drawn.recorded()), plain)
    left = rows.left_of_gaits
    columns: dict[tuple[str, int], np.ndarray] = {}
    if with_effects:
        every = {name: effect for name, effect in catalogue().items() if effect.family != _NEVER}
        for signature in rows.signatures(every):
            for number, parameter in enumerate(signature.effect.parameters):
                slope = little(signature, number)
                if slope is not None:
                    columns[signature.effect.name, number] = parameter.sd * slope[: left.size]
    slopes = row_slopes(rows.model, rows.coefficients)[: left.size]
    return BaseSession(seed, left, slopes, rows.tracking, columns)


def discrepancy_of(sessions: Sequence[BaseSession]) -> Discrepancy:
    """Of many sessions: what a twin leaves of each gait, and what it leaves of all gaits of a session alike.

    What it leaves of each gait is as large as it is in most sessions; effects are taken in one after the other for as
    long as they make what is left likelier, their strengths by maximum likelihood.
    """
    covariance = robust_covariance([session.left for session in sessions])
    asked = [session for session in sessions if session.columns]
    by_size = [_unlikely([_Row.of(each, size**2 * covariance) for each in asked], [], np.zeros(0)) for size in _SIZES]
    covariance = _SIZES[int(np.argmin(by_size))] ** 2 * covariance
    strengths = _strengths(asked, covariance)
    names = dict.fromkeys(name for name, _ in strengths)
    counts = {name: len(catalogue()[name].parameters) for name in names}
    return Discrepancy(
        covariance, {name: tuple(strengths.get((name, i), 0.0) for i in range(counts[name])) for name in names}
    )


def robust_covariance(left: Sequence[np.ndarray]) -> np.ndarray:
    """(127, 127) second moments of what is left (t, 127) in many sessions, shrunk (Ledoit and Wolf 2004).

    About zero, not about their mean: what the twin leaves of every swim alike is its error too. A session counts by its
    directions, not by its size (Tyler 1987), so that a few in which the twin is far off do not say how all are.
    """
    found = _shrunk(left)
    for _ in range(_ROBUST):
        root = np.linalg.cholesky(found)
        sizes = np.array([np.sqrt((solve_triangular(root, own.T, lower=True) ** 2).mean()) for own in left])
        sizes /= np.exp(np.log(sizes).mean())
        found = _shrunk([own / size for own, size in zip(left, sizes, strict=True)])
    return found


def _shrunk(left: Sequence[np.ndarray]) -> np.ndarray:
    pooled = np.vstack(left)
    scale = np.sqrt((pooled**2).mean(axis=0))
    shrunk, _ = ledoit_wolf(pooled / scale, assume_centered=True)
    return np.asarray(shrunk * np.outer(scale, scale))


def _strengths(sessions: Sequence[BaseSession], covariance: np.ndarray) -> dict[tuple[str, int], float]:
    """Of those parameters that make what is left likelier, forward."""
    rows = [_Row.of(session, covariance) for session in sessions]
    every = sorted(set.intersection(*(set(session.columns) for session in sessions)))
    chosen: list[tuple[str, int]] = []
    logs, best = np.zeros(0), _unlikely(rows, chosen, np.zeros(0))
    while len(chosen) < len(every):
        start, tries = np.append(logs, np.log(_FIRST)), {}
        for one in (each for each in every if each not in chosen):
            unlikely = partial(_unlikely, rows, [*chosen, one])
            tries[one] = minimize(unlikely, start, method="Nelder-Mead")
        one = min(tries, key=lambda each: tries[each].fun)
        if best - tries[one].fun < _GAIN:
            break
        chosen, logs, best = [*chosen, one], tries[one].x, tries[one].fun
    return dict(zip(chosen, map(float, np.exp(logs)), strict=True))


@dataclass(frozen=True, eq=False)
class _Row:
    """A session, whitened: what is left, columns, and what its log density has beside."""

    left: np.ndarray
    columns: Mapping[tuple[str, int], np.ndarray]
    volume: float

    @classmethod
    def of(cls, session: BaseSession, covariance: np.ndarray) -> "_Row":
        of_gaits = block_diag(*[covariance] * len(session.left)) + session.noise
        root = np.linalg.cholesky(of_gaits + session.slopes @ np.diag(PRIOR_SD**2) @ session.slopes.T)
        noise = np.linalg.cholesky(session.noise) @ np.random.default_rng([session.seed, 7]).standard_normal(len(root))
        white = partial(solve_triangular, root, lower=True)
        columns = {key: white(column) for key, column in session.columns.items()}
        return cls(white(session.left.ravel() + noise), columns, -float(np.log(np.diag(root)).sum()))

    def log_density(self, chosen: Sequence[tuple[str, int]], strengths: np.ndarray) -> float:
        """But for a constant."""
        columns = np.column_stack([np.zeros((len(self.left), 0)), *(self.columns[key] for key in chosen)]) * strengths
        return self.volume + Normal(self.left, np.ones(len(self.left)), columns).log_density


def _unlikely(rows: Sequence[_Row], chosen: Sequence[tuple[str, int]], logs: np.ndarray) -> float:
    """-ln of the likelihood of these strengths, given by their logarithms."""
    return -sum(row.log_density(chosen, np.exp(logs)) for row in rows)


def measure(path: Path, workers: int = 0) -> None:
    """Simulates the sessions, and writes what is found."""
    asked, others = SEEDS[:WITH_EFFECTS], SEEDS[WITH_EFFECTS:]
    found: list[BaseSession] = []
    for seeds, with_effects in ((asked, True), (others, False)):
        batches = [list(seeds[first : first + _TOGETHER]) for first in range(0, len(seeds), _TOGETHER)]
        for done in spread(partial(base_sessions, with_effects=with_effects), batches, workers, None):
            found += done
            print(f"{len(found)} of {len(SEEDS)} sessions", file=sys.stderr)
    found.sort(key=lambda session: session.seed)
    discrepancy_of(found).save(path, list(SEEDS))


if __name__ == "__main__":
    measure(Path(sys.argv[1]))
