"""Swims of policies, made by hand: straight ways to targets, and circles that ripple."""

import numpy as np

from reports.context import PolicySwims


def made_targets(count: int = 60) -> PolicySwims:
    """Straight to targets at 0.2 m/s; the nearest one is missed."""
    random = np.random.default_rng(3)
    start = (random.random((count, 2)) - [1.0, 0.5]) * 4.0
    away = np.hypot(*start.T)
    path = np.linspace(0.0, 1.0, 20)[:, None, None] * start[:40]
    none = np.full((2, count), np.nan)
    hit = away > away.min()
    return PolicySwims("target", "search", 300.0, 0, True, start, hit, np.zeros(count, bool), away / 0.2, none, path)


def made_circles() -> PolicySwims:
    """A circle of 1 m to either side, 5 mm off at most."""
    lap = np.linspace(0.0, 2 * np.pi, 300)
    radius = 1.0 + 0.005 * np.sin(40 * lap)
    paths = [np.stack([-radius * np.sin(lap), side * (radius * np.cos(lap) - 1)], axis=1) for side in (1.0, -1.0)]
    start, off = np.array([[-0.3, -0.045], [-0.3, 0.045]]), np.array([[0.003] * 2, [0.005] * 2])
    done, lasted = np.ones(2, bool), np.full(2, 33.0)
    return PolicySwims("circle", "sac", 60.0, 0, False, start, done, ~done, lasted, off, np.stack(paths, axis=1), 1.0)
