"""Mechanisms of hinges and masses of the tail."""

from dataclasses import replace

import numpy as np

from benchmarks.reality.instant import Instant
from benchmarks.reality.layout import Layout
from benchmarks.reality.mechanism import AtStrength, Mechanism
from benchmarks.reality.parameters import Parameters
from swimcal.robot import load_robot


class StiffnessError(Mechanism):
    """Factor on the stiffness of each gap of the tail: one print's error of thickness, nearly the same everywhere."""

    ln_factor: tuple[float, ...]  # (gaps,) ln of the factor on each gap of the robot, from the head on

    def prepare(self, parameters: Parameters, layout: Layout) -> Parameters:
        """Set other springs."""
        factor = np.exp(np.array(self.ln_factor)[layout.gap_of_hinge])
        return replace(parameters, hinge_stiffness_n_m=parameters.hinge_stiffness_n_m * factor)


def stiffness_error(random: np.random.Generator) -> AtStrength:
    """Draw all stiffer, or all softer, by 10 % at strength 1, uneven by a twentieth of that; exponential."""
    ln, uneven = 0.1, 0.05
    ln_factor = ln * random.choice([-1.0, 1.0]) * (1 + uneven * random.standard_normal(5))
    return lambda strength: (StiffnessError(tuple(strength * ln_factor)),)


class StiffnessGradient(Mechanism):
    """Stiffness that grows, or falls, exponentially along the tail, as with a taper of thickness; its mean stays."""

    ln_ratio: float  # ln of the ratio of the rearmost hinge to one half-way
    power: float  # 1 for an even taper; more where the ends differ most, less where the middle does

    def prepare(self, parameters: Parameters, layout: Layout) -> Parameters:
        """Set other springs."""
        x = layout.origin_m[1:]
        rear = np.interp(x, [x[0], x[-1]], [-1.0, 1.0])
        factor = np.exp(self.ln_ratio * np.sign(rear) * np.abs(rear) ** self.power)
        return replace(parameters, hinge_stiffness_n_m=parameters.hinge_stiffness_n_m * factor / factor.mean())


def stiffness_gradient(random: np.random.Generator) -> AtStrength:
    """Draw either end stiffer, by 20 % against the middle at strength 1; saturates at a factor of e^1.5."""
    ln, most_ln = 0.2, 1.5
    sign, power = random.choice([-1.0, 1.0]), random.uniform(0.7, 1.5)
    return lambda strength: ((StiffnessGradient(sign * most_ln * float(np.tanh(ln * strength / most_ln)), power),))


class StiffnessHardening(Mechanism):
    """A toe and then a steeper line: torque k (q + r (q - a arctan(q / a))) of a gap at bend q.

    Slopes k where straight and k (1 + r) where far bent, as of a gap whose edges come to bear; k (1 + r q^2 / 3 a^2) q
    between.
    """

    ratio: float  # r
    toe_rad: float  # a

    def prepare(self, parameters: Parameters, layout: Layout) -> Parameters:  # noqa: ARG002
        """Take the steepest derivative implicitly."""
        return parameters.taken_implicitly(self.ratio * parameters.hinge_stiffness_n_m)

    def force(self, now: Instant, state: np.ndarray) -> np.ndarray:  # noqa: ARG002
        """Return what comes on top of Hooke's law; hinges in series share the bend of their gap."""
        toe = self.toe_rad / now.layout.hinges_per_gap
        bent = now.pose.hinge_rad - now.parameters.hinge_rest_rad
        return now.bend(-self.ratio * now.parameters.hinge_stiffness_n_m * (bent - toe * np.arctan(bent / toe)))


def stiffness_hardening(random: np.random.Generator) -> AtStrength:
    """Draw k q (1 + 2 q^2) for a slight bend at strength 1; the slope at a large one is linear in strength."""
    cubic = 2.0  # 1/rad^2, where the bend is small
    toe = random.uniform(0.15, 0.3)
    return lambda strength: (StiffnessHardening(3 * toe**2 * cubic * strength, toe),)


class JointDamping(Mechanism):
    """A damper parallel to the hinge's own whose fluid thins with shear: torque c r w / (1 + |w| / w_0), w the rate."""

    share: float  # r, of the damping c of the described robot; negative: some of that is missing
    thinning_rad_s: float  # w_0 of a gap

    def prepare(self, parameters: Parameters, layout: Layout) -> Parameters:  # noqa: ARG002
        """Take its derivative where slow implicitly."""
        return parameters.taken_implicitly(damping=max(self.share, 0.0) * parameters.hinge_damping_n_m_s)

    def force(self, now: Instant, state: np.ndarray) -> np.ndarray:  # noqa: ARG002
        """Return what comes on top of the hinge's own damper."""
        rate = now.pose.hinge_rate_rad_s
        thinned = rate / (1 + np.abs(rate) * now.layout.hinges_per_gap / self.thinning_rad_s)
        return now.bend(-self.share * now.parameters.hinge_damping_n_m_s * thinned)


def joint_damping(random: np.random.Generator) -> AtStrength:
    """Draw mostly more: by half at 1 rad/s at strength 1, linear; else less, saturating short of none at all."""
    typical, least, more_often = 0.5, 0.9, 0.75
    more, thinning = random.random() < more_often, random.uniform(2.0, 6.0)

    def share(strength: float) -> float:
        linear = typical * strength
        return linear * (1 + 1 / thinning) if more else -least * float(np.tanh(linear / least))

    return lambda strength: (JointDamping(share(strength), thinning),)


_BRISTLE_RAD = 0.005  # The bristles of a hinge slip at this bend.


class JointFriction(Mechanism):
    """LuGre's friction: bristles bend before they slip, with a higher torque to break away than to keep sliding.

    Canudas de Wit, Olsson, Astrom and Lischinsky, IEEE Trans. Automatic Control 40 (1995): z' = w - |w| z s_0 / g(w),
    torque s_0 z, g(w) = T (1 + e exp(-(w / w_s)^2)); the hinge's own damper replaces that of the bristles. The state
    is where the bristles' roots are, q - z, so that within a step they are a spring.
    """

    torque_n_m: float  # T, torque in sliding
    excess: float  # e, excess of the break-away torque
    stribeck_rad_s: float  # w_s

    def prepare(self, parameters: Parameters, layout: Layout) -> Parameters:  # noqa: ARG002
        """Take the bristles implicitly."""
        return parameters.taken_implicitly(self.torque_n_m / _BRISTLE_RAD)

    def start(self, now: Instant) -> np.ndarray:
        """Return (n, h) roots, the bristles upright."""
        return now.pose.hinge_rad

    def advance(self, now: Instant, state: np.ndarray, step_s: float) -> np.ndarray:
        """Move the roots where the bristles slip: exact at an even rate, for the mean bend over a step."""
        rate = now.pose.hinge_rate_rad_s
        slipping = _BRISTLE_RAD * (1 + self.excess * np.exp(-((rate / self.stribeck_rad_s) ** 2)))
        beyond = now.pose.hinge_rad - state + rate * step_s / 2 - np.sign(rate) * slipping
        return np.asarray(state + rate * step_s - beyond * np.expm1(-np.abs(rate) * step_s / slipping))

    def force(self, now: Instant, state: np.ndarray) -> np.ndarray:
        """Return the force of the bristles on the hinges."""
        return now.bend(-self.torque_n_m / _BRISTLE_RAD * (now.pose.hinge_rad - state))


def joint_friction(random: np.random.Generator) -> AtStrength:
    """Draw 0.03 N m in each gap at strength 1; saturates at 0.3 N m, which holds a gap bent by half a radian."""
    torque_n_m, most_n_m = 0.03, 0.3
    excess, stribeck = random.uniform(0.05, 0.2), random.uniform(0.02, 0.1)
    return lambda strength: (
        (JointFriction(most_n_m * float(np.tanh(torque_n_m * strength / most_n_m)), excess, stribeck),)
    )


class BendOffset(Mechanism):
    """Tail curved where it is flexible: each gap rests at an angle in proportion to its length, more towards one end.

    The tendons keep the lengths at which they hold the tail straight.
    """

    mean_rad: float  # mean over the gaps
    rearward: float  # 0 for an even curvature; 1 if it grows from nothing at the first gap

    def prepare(self, parameters: Parameters, layout: Layout) -> Parameters:
        """Set another rest."""
        gap_m = np.array([segment.gap_m for segment in layout.robot.tail.segment])
        curved = gap_m * (1 + self.rearward * np.linspace(-1.0, 1.0, len(gap_m)))
        rest = self.mean_rad * curved / curved.mean() / layout.hinges_per_gap
        return replace(parameters, hinge_rest_rad=parameters.hinge_rest_rad + rest[layout.gap_of_hinge])


def bend_offset(random: np.random.Generator) -> AtStrength:
    """Draw either side, 0.03 rad a gap at strength 1; saturates at 0.5 rad."""
    mean_rad, most_rad = 0.03, 0.5
    sign, rearward = random.choice([-1.0, 1.0]), random.uniform(-0.4, 0.4)
    return lambda strength: ((BendOffset(sign * most_rad * float(np.tanh(mean_rad * strength / most_rad)), rearward),))


class MassDistribution(Mechanism):
    """Lumps at the tendon guides, of glue and markers, that were weighed with the head; the total stays."""

    share: float  # share of the head's mass
    at_guide: tuple[float, ...]  # (g,) share of each guide in the lumps, from the first to the last; they add up to 1

    def prepare(self, parameters: Parameters, layout: Layout) -> Parameters:
        """Move masses and their moments."""
        head = np.where(np.arange(layout.hinges + 1) == 0, 1 - self.share, 1.0)
        lump = self.share * parameters.link_mass_kg[0, 0] * np.array(self.at_guide)
        return parameters.reweighed(head, layout.on_links(layout.guide_link, lump, layout.guide_place_m))


def mass_distribution(random: np.random.Generator) -> AtStrength:
    """Draw a hundredth of the head's mass at strength 1, shared by the guides nearly as the tail's own mass is.

    Saturates at 8 hundredths.
    """
    share, most = 0.01, 0.08
    even = 400.0  # concentration of the draw: a tenth more or less on a guide
    kg = load_robot().tail_mass_kg
    at_guide = tuple(random.dirichlet(even * kg / kg.sum()))
    return lambda strength: ((MassDistribution(most * float(np.tanh(share * strength / most)), at_guide),))


class EntrainedWater(Mechanism):
    """A layer on both sides of tail and fin that deepens rearwards, as boundary layers do; none in air.

    With s the place between the first hinge (0) and the rear edge (1), the layer is t (1 + p) s^p deep.
    """

    mean_m: float  # t, mean depth over the tail's length
    power: float  # p

    def prepare(self, parameters: Parameters, layout: Layout) -> Parameters:
        """Make the links behind the head heavier, the water on either side hanging on their surface."""
        strips = layout.strips
        x = layout.origin_m[strips.link] + strips.place_m
        along = np.clip((x - layout.origin_m[1]) / (x[-1] + strips.length_m[-1] / 2 - layout.origin_m[1]), 0.0, 1.0)
        depth = self.mean_m * (1 + self.power) * along**self.power
        density = parameters.density_kg_m3[0, 0]
        kg = np.where(strips.link > 0, 2 * depth * 2 * strips.half_height_m * strips.length_m * density, 0.0)
        added = layout.on_links(strips.link, kg, strips.place_m)
        np.add.at(added[2], strips.link, kg * (strips.length_m**2 / 12 + depth**2 / 3))
        return parameters.reweighed(1.0, added)


def entrained_water(random: np.random.Generator) -> AtStrength:
    """Draw 2 mm on the mean at strength 1, deepening with the power 0.3 to 0.8; saturates at 20 mm."""
    mean_m, most_m = 0.002, 0.02
    power = random.uniform(0.3, 0.8)
    return lambda strength: ((EntrainedWater(most_m * float(-np.expm1(-mean_m * strength / most_m)), power),))
