"""Tendons that rub in their guides."""

from dataclasses import dataclass, replace

import numpy as np

from benchmarks.reality.instant import Instant
from benchmarks.reality.layout import Layout
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms import AtStrength
from benchmarks.reality.parameters import Parameters

_TYPICAL_N, _MOST_N = 0.5, 5.0
_TENSION_N = 50.0  # of tendons in use
_BRISTLE_M = 0.0002  # that a line gives before it slides
_STRIBECK_M_S = 0.01
_STICKING = 1.1  # of the friction at rest over that in sliding
_MARGIN = 2.0  # by which the implicit stiffness exceeds that of the bristles, for stability


@dataclass(frozen=True)
class TendonFriction(Mechanism):
    """Each line rubs at each guide it slides through, by LuGre's bristles (Canudas de Wit et al. 1995).

    z' = v - |v| z k / level(v), and friction k z; in sliding it has its level at z = 0.2 mm. A share of the level grows
    with the line's tension (Euler's capstan), the rest is there always; at rest it is a tenth more. A line slides
    through a guide as its way behind it gets longer, so friction there resists all hinges behind with the line's arm at
    each.

    Attributes:
        level_n: in sliding, at 50 N of tension.
        loaded: share of it that is in proportion to the tension.
    """

    level_n: float
    loaded: float

    def prepare(self, parameters: Parameters, layout: Layout) -> Parameters:
        """What the integrator takes implicitly: more than the bristles' stiffness at each hinge (Gershgorin's rows)."""
        arms = np.abs(_straight_arms_m(layout))
        stiffness = np.zeros(layout.hinges)
        for behind in _behind(layout):
            stiffness += 2 * arms * behind * (arms @ behind)
        extra = _MARGIN * self.level_n / _BRISTLE_M * stiffness * _strung(parameters)
        return replace(parameters, extra_implicit_stiffness_n_m=parameters.extra_implicit_stiffness_n_m + extra)

    def start(self, now: Instant) -> np.ndarray:
        """(n, 2 g) bristles, unbent, m."""
        return np.zeros((len(now.time_s), 2 * len(_behind(now.layout))))

    def advance(self, now: Instant, state: np.ndarray, step_s: float) -> np.ndarray:
        """The bristles a step later, exact at constant speed."""
        speed = (_arms_m(now) * now.pose.hinge_rate_rad_s[:, None]) @ _behind(now.layout).T  # (n, 2, g)
        sticking = 1 + (_STICKING - 1) * np.exp(-((speed / _STRIBECK_M_S) ** 2))
        load = 1 - self.loaded + self.loaded * np.abs(now.pull.tension_n) / _TENSION_N  # (n, 2)
        most = _BRISTLE_M * sticking * load[:, :, None]
        kept = np.exp(-np.abs(speed) * step_s / most)
        bent = state.reshape(speed.shape) * kept + np.sign(speed) * most * (1 - kept)
        return np.asarray(bent.reshape(state.shape))

    def force(self, now: Instant, state: np.ndarray) -> np.ndarray:
        """Against the hinges behind each guide."""
        friction = np.reshape(self.level_n / _BRISTLE_M * _strung(now.parameters) * state, (len(state), 2, -1))
        along = friction @ _behind(now.layout)  # (n, 2, h) summed over the guides before each hinge
        return now.bend(-(along * _arms_m(now)).sum(axis=1))


def _strung(parameters: Parameters) -> np.ndarray:
    """(n, 1) 1 where there are tendons, 0 where not."""
    return np.asarray((parameters.tendon_stiffness_n_m > 0).all(axis=1, keepdims=True), float)


def _behind(layout: Layout) -> np.ndarray:
    """(g, h) 1 where a hinge lies behind a guide; the last guide, where the lines end, is none."""
    return (layout.gap_of_hinge > np.arange(layout.gap_of_hinge[-1])[:, None]).astype(float)


def _arms_m(now: Instant) -> np.ndarray:
    """(n, 2, h) by how much each tendon grows with the angle of each hinge."""
    by_link = now.pull.gradient_m[:, :, 3:]
    return np.asarray(np.cumsum(by_link[:, :, ::-1], axis=2)[:, :, ::-1])


def _straight_arms_m(layout: Layout) -> np.ndarray:
    """(h,) distance of the tendons from the hinges of the straight tail, at most."""
    offset = np.abs(layout.guide_offset_m[0])
    before = np.append(layout.robot.crank.anchor_offset_m, offset[:-1])
    return np.maximum(before, offset)[layout.gap_of_hinge]


def drawn(random: np.random.Generator) -> AtStrength:
    """Draws how much of the friction is by the lines' own tension. The level saturates at 5 N."""
    loaded = random.uniform(0.0, 0.1)

    def at(strength: float) -> tuple[Mechanism, ...]:
        if strength == 0:
            return ()
        return (TendonFriction(float(_MOST_N * np.tanh(_TYPICAL_N / _MOST_N * strength)), float(loaded)),)

    return at
