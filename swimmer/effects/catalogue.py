"""All effects that are known: the built-in ones, and whatever users have added through the entry point group."""

from collections.abc import Mapping
from functools import lru_cache
from importlib import import_module
from importlib.metadata import entry_points
from types import MappingProxyType

from swimmer.effects.added import GROUP, added_effects
from swimmer.effects.effect import Effect

BUILT_IN: Mapping[str, tuple[str, ...]] = MappingProxyType(
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
"""Names by family; each is a module of `swimmer.effects.<family>` with one effect, `EFFECT`."""


@lru_cache(maxsize=1)
def catalogue() -> Mapping[str, Effect]:
    """Every effect by its name, built-in ones first.

    Raises:
        InputError: what is wrong with effects of users, all of it at once.
    """
    found = {
        name: import_module(f"swimmer.effects.{family}.{name}").EFFECT
        for family, names in BUILT_IN.items()
        for name in names
    }
    return MappingProxyType(found | added_effects(entry_points(group=GROUP), found))
