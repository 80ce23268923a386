"""Mechanisms of crank arms and tendons."""

from dataclasses import replace

import numpy as np

from benchmarks.reality.instant import Instant
from benchmarks.reality.layout import Layout
from benchmarks.reality.mechanism import AtStrength, Mechanism
from benchmarks.reality.parameters import Parameters


class CrankArmError(Mechanism):
    """Anchor of either tendon further from the shaft than described, by a share."""

    left: float
    right: float

    def prepare(self, parameters: Parameters, layout: Layout) -> Parameters:  # noqa: ARG002
        """Set other radii."""
        return replace(parameters, anchor_radius_m=parameters.anchor_radius_m * (1 + np.array([self.left, self.right])))


def crank_arm_error(random: np.random.Generator) -> AtStrength:
    """Draw longer or shorter, which arm is the more wrong, and by how much less the other: each is drilled by itself.

    Arms become at most a half shorter, and 1.8 % longer: at 2.3 to 6 % the tail of the base state folds in its
    second gap, at once when at rest.
    """
    typical, shortest, longest = 0.05, 0.5, 0.018
    most = random.choice([-shortest, longest])
    shares = random.permutation([1.0, random.uniform(0.4, 1.0)])
    return lambda strength: (CrankArmError(*(most * np.tanh(typical / abs(most) * strength) * shares)),)


_YIELDS_M = 0.001  # The knots give over this stretch.


class TendonCompliance(Mechanism):
    """Fittings that are springs in series with the lines, and whose knots rub as they stretch.

    The friction is a bristle of Dahl's in parallel: z' = s' - |s'| z / 1 mm, tension `loss` k z, with k the spring of
    the whole and s its stretch; a loop of force over stretch that does not depend on speed.
    """

    # left, right: compliance of either line's fittings over that of the line
    left: float
    right: float
    loss: float  # height of the loop, in a millimetre of stretch

    def prepare(self, parameters: Parameters, layout: Layout) -> Parameters:  # noqa: ARG002
        """Set softer springs with the same time constant."""
        softer = 1 / (1 + np.array([self.left, self.right]))
        return replace(
            parameters,
            tendon_stiffness_n_m=parameters.tendon_stiffness_n_m * softer,
            tendon_damping_n_s_m=parameters.tendon_damping_n_s_m * softer,
        )

    def start(self, now: Instant) -> np.ndarray:
        """Return (n, 2) bristles, unbent, m."""
        return np.zeros_like(now.pull.stretch_m)

    def advance(self, now: Instant, state: np.ndarray, step_s: float) -> np.ndarray:
        """Return the bristles a step later, exact at constant speed."""
        moved = now.pull.rate_m_s * step_s
        end = _YIELDS_M * np.sign(moved)
        return np.asarray(end + (state - end) * np.exp(-np.abs(moved) / _YIELDS_M))

    def force(self, now: Instant, state: np.ndarray) -> np.ndarray:
        """Return the force of the bristles."""
        return now.tighten(self.loss * now.parameters.tendon_stiffness_n_m * state)


def tendon_compliance(random: np.random.Generator) -> AtStrength:
    """Draw how differently the two lines are held, and how much the knots rub."""
    typical = 2.0
    uneven, loss = random.uniform(-0.05, 0.05), random.uniform(0.05, 0.15)

    def at(strength: float) -> tuple[Mechanism, ...]:
        relative = typical * strength
        rubbing = float(loss * relative / (1 + relative))  # share of the stretch that the fittings take
        return (TendonCompliance(float(relative * (1 + uneven)), float(relative * (1 - uneven)), rubbing),)

    return at


_KNEE = 0.15  # A line comes tight over this share of the slack.


class TendonSlack(Mechanism):
    """Play of line and rod ends: a tendon pulls when stretched by more than its slack, and pushes beyond its play.

    The tendons of the base state push more than they pull, so both ends of the play matter. Each end comes tight over a
    smooth knee of width w: T = k (soft(s - slack) - soft(-s - play)), soft(u) = w log(1 + exp(u / w)), and the damper
    with the slope of it.
    """

    # pull_left_m, pull_right_m: slack
    pull_left_m: float
    pull_right_m: float
    push_m: float  # play

    def force(self, now: Instant, state: np.ndarray) -> np.ndarray:  # noqa: ARG002
        """Return what the tension is more than that of tight tendons."""
        pull_m = np.concatenate(np.broadcast_arrays(self.pull_left_m, self.pull_right_m), axis=1)
        width = _KNEE * (pull_m + self.push_m) / 2
        stretch, p = now.pull.stretch_m, now.parameters
        tight, loose = (stretch - pull_m) / width, (-stretch - self.push_m) / width
        held = width * (np.logaddexp(0, tight) - np.logaddexp(0, loose))
        slope = 0.5 * (1 + np.tanh(tight / 2)) + 0.5 * (1 + np.tanh(loose / 2))
        tension = p.tendon_stiffness_n_m * held + p.tendon_damping_n_s_m * slope * now.pull.rate_m_s
        return now.tighten(tension - now.pull.tension_n)


def tendon_slack(random: np.random.Generator) -> AtStrength:
    """Draw how differently long the two lines are, and how much play there is to the slack. Saturates at 12 mm."""
    typical_m, most_m = 0.002, 0.012
    uneven, play = random.uniform(-0.05, 0.05), random.uniform(0.9, 1.1)
    shares = np.array([1 + uneven, 1 - uneven, play])
    return lambda strength: (TendonSlack(*(most_m * np.tanh(typical_m / most_m * strength) * shares)),)


_TENSION_N = 50.0  # Tendons in use have this tension.
_BRISTLE_M = 0.0002  # A line gives by this before it slides.
_STRIBECK_M_S = 0.01
_STICKING = 1.1  # ratio of the friction at rest to that in sliding
_MARGIN = 2.0  # The implicit stiffness exceeds that of the bristles by this factor, for stability.


class TendonFriction(Mechanism):
    """Friction of each line at each guide it slides through, by LuGre's bristles (Canudas de Wit et al. 1995).

    z' = v - |v| z k / level(v), and friction k z; in sliding it has its level at z = 0.2 mm. A share of the level grows
    with the line's tension (Euler's capstan), the rest is there always; at rest it is a tenth more. A line slides
    through a guide as its way behind it gets longer, so friction there resists all hinges behind with the line's arm at
    each.
    """

    level_n: float  # friction in sliding, at 50 N of tension
    loaded: float  # share of it that is in proportion to the tension

    def prepare(self, parameters: Parameters, layout: Layout) -> Parameters:
        """Take more than the bristles' stiffness implicitly at each hinge (Gershgorin's rows)."""
        arms = np.abs(_measure_straight_arms_m(layout))
        stiffness = np.zeros(layout.hinges)
        for behind in _mark_behind(layout):
            stiffness += 2 * arms * behind * (arms @ behind)
        return parameters.taken_implicitly(_MARGIN * self.level_n / _BRISTLE_M * stiffness * _mark_strung(parameters))

    def start(self, now: Instant) -> np.ndarray:
        """Return (n, 2 g) bristles, unbent, m."""
        return np.zeros((len(now.time_s), 2 * len(_mark_behind(now.layout))))

    def advance(self, now: Instant, state: np.ndarray, step_s: float) -> np.ndarray:
        """Return the bristles a step later, exact at constant speed."""
        speed = (_measure_arms_m(now) * now.pose.hinge_rate_rad_s[:, None]) @ _mark_behind(now.layout).T  # (n, 2, g)
        sticking = 1 + (_STICKING - 1) * np.exp(-((speed / _STRIBECK_M_S) ** 2))
        load = 1 - self.loaded + self.loaded * np.abs(now.pull.tension_n) / _TENSION_N  # (n, 2)
        most = _BRISTLE_M * sticking * load[:, :, None]
        kept = np.exp(-np.abs(speed) * step_s / most)
        bent = state.reshape(speed.shape) * kept + np.sign(speed) * most * (1 - kept)
        return np.asarray(bent.reshape(state.shape))

    def force(self, now: Instant, state: np.ndarray) -> np.ndarray:
        """Return the friction against the hinges behind each guide."""
        friction = np.reshape(self.level_n / _BRISTLE_M * _mark_strung(now.parameters) * state, (len(state), 2, -1))
        along = friction @ _mark_behind(now.layout)  # (n, 2, h) summed over the guides before each hinge
        return now.bend(-(along * _measure_arms_m(now)).sum(axis=1))


def _mark_strung(parameters: Parameters) -> np.ndarray:
    """Return (n, 1): 1 where there are tendons, 0 where not."""
    return np.asarray((parameters.tendon_stiffness_n_m > 0).all(axis=1, keepdims=True), float)


def _mark_behind(layout: Layout) -> np.ndarray:
    """Return (g, h): 1 where a hinge is behind a guide; the last guide, where the lines end, is none."""
    return (layout.gap_of_hinge > np.arange(layout.gap_of_hinge[-1])[:, None]).astype(float)


def _measure_arms_m(now: Instant) -> np.ndarray:
    """Return (n, 2, h) by how much each tendon grows with the angle of each hinge."""
    by_link = now.pull.gradient_m[:, :, 3:]
    return np.asarray(np.cumsum(by_link[:, :, ::-1], axis=2)[:, :, ::-1])


def _measure_straight_arms_m(layout: Layout) -> np.ndarray:
    """Return (h,) the largest distance of the tendons from the hinges of the straight tail."""
    offset = np.abs(layout.guide_offset_m[0])
    before = np.append(layout.robot.crank.anchor_offset_m, offset[:-1])
    return np.maximum(before, offset)[layout.gap_of_hinge]


def tendon_friction(random: np.random.Generator) -> AtStrength:
    """Draw how much of the friction is by the lines' own tension. The level saturates at 5 N."""
    typical_n, most_n = 0.5, 5.0
    loaded = random.uniform(0.0, 0.1)
    return lambda strength: (TendonFriction(most_n * np.tanh(typical_n / most_n * strength), loaded),)


class TendonAsymmetry(Mechanism):
    """Free length of either tendon beyond that of the straight tail."""

    left_m: float
    right_m: float

    def prepare(self, parameters: Parameters, layout: Layout) -> Parameters:  # noqa: ARG002
        """Set other lengths."""
        extra_m = parameters.tendon_extra_m + np.array([self.left_m, self.right_m])
        return replace(parameters, tendon_extra_m=extra_m)


def tendon_asymmetry(random: np.random.Generator) -> AtStrength:
    """Draw which side is short, which tendon is the more wrong, and by how much less the other: each has its knot.

    Saturates at 12 mm each.
    """
    typical_m, most_m = 0.001, 0.012
    sign, shares = random.choice([-1.0, 1.0]), random.permutation([1.0, random.uniform(0.25, 1.0)])
    signed = [-1.0, 1.0] * shares
    return lambda strength: (TendonAsymmetry(*(sign * most_m * np.tanh(typical_m / most_m * strength) * signed)),)
