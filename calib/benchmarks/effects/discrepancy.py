"""What remains between reality in its base state and the refitted twin, which every diagnosis may know."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from sklearn.covariance import ledoit_wolf

from calib.benchmarks.effects.drawn import draw_world
from calib.benchmarks.effects.filming import Filming, film_together
from calib.benchmarks.effects.rows import SessionRows
from calib.benchmarks.effects.suite import SessionPlan, recorded_by
from reality import Nuisances

LENGTH = 127  # of a gait of nine markers
_STARTED_M = 2e-4  # standard deviation that refits start from, m and m/s


def left_by_twin(seed: int) -> np.ndarray:
    """(t, 127) what the twin, refitted to a robot that is as described in water of some kind, leaves of its swims."""
    return film_together([_left(seed)])[0]


def _left(seed: int) -> Filming[np.ndarray]:
    plan = SessionPlan(f"base-{seed}", seed, recorded_by(np.random.default_rng([seed, 1])), "null")
    drawn = yield from draw_world(plan)
    drawn = replace(drawn, world=replace(drawn.world, nuisances=Nuisances()))
    rows = SessionRows.of(drawn, (yield from drawn.recorded()), _STARTED_M**2 * np.eye(LENGTH))
    return rows.left_of_gaits


def discrepancy_of(left: Sequence[np.ndarray]) -> np.ndarray:
    """(127, 127) second moments of what is left (t, 127) in many sessions, shrunk (Ledoit and Wolf 2004).

    About zero, not about their mean: what the twin leaves of every swim alike is its error too.
    """
    pooled = np.vstack(left)
    scale = np.sqrt((pooled**2).mean(axis=0))
    shrunk, _ = ledoit_wolf(pooled / scale, assume_centered=True)
    return np.asarray(shrunk * np.outer(scale, scale))


def save_discrepancy(path: Path, covariance: np.ndarray, seeds: Sequence[int]) -> None:
    """Writes it with the seeds of the sessions that it was found from."""
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez_compressed(path, covariance=covariance.astype(np.float32), seeds=np.array(seeds))


def load_discrepancy(path: Path) -> np.ndarray:
    """(127, 127) as it was saved."""
    with np.load(path) as stands:
        return np.asarray(stands["covariance"], float)
