"""What can be switched on in reality: each effect of the catalogue in a form of its own, and others outside of it.

A mechanism stands in the module of its family, with a function of its name: a generator draws what differs from one
session to the next (sign, side, marker, shape), and the function that comes back gives the mechanisms at a strength
above 0, typical of robots as they are built at 1.
"""

from collections.abc import Callable, Mapping
from functools import lru_cache
from importlib import import_module
from types import MappingProxyType

import numpy as np

from benchmarks.reality.mechanism import Mechanism

AtStrength = Callable[[float], tuple[Mechanism, ...]]
"""Mechanisms at a strength >= 0."""
Drawn = Callable[[np.random.Generator], AtStrength]

CATALOGUED: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "measurement": (
            "head_frame_misalignment",
            "scale_error",
            "camera_parallax",
            "lens_distortion",
            "time_base_error",
            "rolling_shutter",
            "marker_offset",
            "tracker_drift",
            "marker_swap",
        ),
        "drive": ("drive_ratio_error", "motor_speed_sag", "motor_speed_ripple", "motor_start_delay"),
        "tendons": ("crank_arm_error", "tendon_compliance", "tendon_slack", "tendon_friction", "tendon_asymmetry"),
        "structure": (
            "stiffness_error",
            "stiffness_gradient",
            "stiffness_hardening",
            "joint_damping",
            "joint_friction",
            "bend_offset",
            "mass_distribution",
            "entrained_water",
        ),
        "fluid": (
            "added_mass_reaction",
            "segment_coefficients",
            "fluid_memory",
            "background_current",
            "wall_proximity",
            "wave_drag",
            "surface_motion",
        ),
    }
)
"""Names by family, as in the catalogue of effects."""
OUTSIDE: tuple[str, ...] = (
    "loosening_marker",
    "timing_glitch",
    "slipping_coupling",
    "creeping_tendon",
    "cracked_segment",
    "water_in_hull",
    "cambered_fin",
    "vortex_buffeting",
    "trapped_bubble",
    "propwash",
    "tether",
)
"""Names of what the catalogue does not hold."""


def drawn_of(family: str, name: str) -> Drawn:
    """How one mechanism is drawn; at strength 0 there is none.

    Args:
        family: of the catalogue, or "outside".
        name: of the mechanism.
    """
    draw: Drawn = getattr(import_module(f"{__name__}.{family}"), name)

    def drawn(random: np.random.Generator) -> AtStrength:
        at = draw(random)
        return lambda strength: at(strength) if strength else ()

    return drawn


@lru_cache(maxsize=1)
def catalogued() -> Mapping[str, Drawn]:
    """Each effect of the catalogue, by its name."""
    return MappingProxyType({name: drawn_of(family, name) for family, names in CATALOGUED.items() for name in names})


@lru_cache(maxsize=1)
def uncatalogued() -> Mapping[str, Drawn]:
    """Each mechanism outside the catalogue, by its name."""
    return MappingProxyType({name: drawn_of("outside", name) for name in OUTSIDE})
