"""Mechanisms of the third generator: what is no matter of the water as in reality, the rest by own forms.

The base state has added mass, a memory of the water and another load on fin and hull than any twin already: of these
effects there is none to switch on.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from benchmarks.reality.instant import Instant
from benchmarks.reality.layout import Layout
from benchmarks.reality.mechanism import AtStrength, Mechanism
from benchmarks.reality.mechanisms import FAMILIES, Drawn, none_at_zero
from benchmarks.reality.parameters import Parameters
from benchmarks.reality.world import Trial, World


class UniformStream(Mechanism):
    """Water that moves as one."""

    # right_m_s, up_m_s: velocity in the picture
    right_m_s: float
    up_m_s: float

    def prepare(self, parameters: Parameters, layout: Layout) -> Parameters:  # noqa: ARG002
        """Let the stream carry wakes along too."""
        return replace(parameters, current_m_s=parameters.current_m_s + self.right_m_s + 1j * self.up_m_s)


def _background_current(random: np.random.Generator) -> AtStrength:
    """Draw 0.015 m/s at strength 1, to anywhere; linear."""
    way = 0.015 * np.exp(1j * random.uniform(0.0, 2 * np.pi))
    return lambda strength: (UniformStream(float(strength * way.real), float(strength * way.imag)),)


class MirrorWall(Mechanism):
    """A plane wall: the lattice and its wake have images behind it, so that no water passes (method of images)."""

    side: float  # +1 left, -1 right
    distance_m: float  # distance from the head's origin at the start
    slant_rad: float  # angle of the wall to the fish's heading then, away from it

    def plane(self, trial: Trial) -> tuple[complex, complex]:
        """Return a place on the wall, m, and its unit normal towards the fish, in the pool."""
        outward = 1j * self.side * np.exp(1j * (trial.heading_rad + self.side * self.slant_rad))
        return complex(trial.place_m + self.distance_m * outward), complex(-outward)


def _wall_proximity(random: np.random.Generator) -> AtStrength:
    """Draw left or right, 0.35 m off at strength 1, nearer with more; never nearer than 0.15 m."""
    nearest_m, further_m = 0.15, 0.2 * random.uniform(0.8, 1.25)
    side, slant = random.choice([-1.0, 1.0]), random.uniform(0.0, 0.05)
    return lambda strength: (MirrorWall(side, nearest_m + further_m / strength, slant),)


def wall_of(world: World) -> MirrorWall | None:
    """Return the wall in a world, if there is one."""
    return next((each for each in world.mechanisms if isinstance(each, MirrorWall)), None)


class RoughSkin(Mechanism):
    """More friction of the flat plate, by a share at every Reynolds number."""

    more: float


def _skin_friction(random: np.random.Generator) -> AtStrength:
    """Draw twice as much again at strength 1, linear."""
    more = 2.0 * random.uniform(0.8, 1.25)
    return lambda strength: (RoughSkin(more * strength),)


def roughness_of(world: World) -> float:
    """Return the factor on a smooth plate's friction that mechanisms make."""
    return 1.0 + sum(each.more for each in world.mechanisms if isinstance(each, RoughSkin))


_GRAVITY_M_S2 = 9.81
_DENSITY_KG_M3 = 1000.0


class WaveResistance(Mechanism):
    """R = 1/2 rho S c exp(-b / Fr^2) U^2, Fr = U / sqrt(g L): waves of a body that are too short to be made when slow.

    The exponential is that of the wave resistance of a submerged body (Havelock 1917, Proc. R. Soc. A 93: exp(-2 g f /
    U^2) at a depth f), here with the draught for the depth.
    """

    size: float  # c
    fades: float  # b

    def force(self, now: Instant, state: np.ndarray) -> np.ndarray:  # noqa: ARG002
        """Return the resistance against the head's way through the water."""
        robot, direction = now.layout.robot, now.pose.direction[:, :1]
        way = now.pose.velocity_m_s[:, :1] - now.parameters.current_m_s
        speed = (way * direction.conj()).real
        keel_m, height_m = 2 * robot.head.fluid_half_size_m[0], 2 * robot.head.fluid_half_size_m[2]
        froude = np.maximum(speed**2 / (_GRAVITY_M_S2 * keel_m), 1e-9)
        pressed = 0.5 * _DENSITY_KG_M3 * keel_m * height_m * self.size * np.exp(-self.fades / froude)
        return now.push(0, 0.0, -pressed * np.abs(speed) * speed * direction)


def _wave_drag(random: np.random.Generator) -> AtStrength:
    """Draw 1 at strength 1, linear; fades below 0.05 to 0.08 m/s."""
    fades = random.uniform(0.001, 0.002)
    return lambda strength: (WaveResistance(strength, fades),)


_OWN: Mapping[str, Drawn] = {
    "background_current": _background_current,
    "wall_proximity": _wall_proximity,
    "wave_drag": _wave_drag,
    "skin_friction": _skin_friction,
}
# These pull by a cable, or change what is seen, so they need no strips.
_OF_NO_STRIPS = ("linear_drag", "surface_motion", "hull_roll")
_DRY = ("measurement", "drive", "tendons", "structure")
CATALOGUED: Mapping[str, Drawn] = {
    **{name: draw for family in _DRY for name, draw in FAMILIES[family].items()},
    **{name: none_at_zero(draw) for name, draw in _OWN.items()},
    **{name: FAMILIES["fluid"][name] for name in _OF_NO_STRIPS},
}
"""Effects of the catalogue that can be made, by name."""
