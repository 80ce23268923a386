"""Doubts about a robot's description: numbers that fit its file, but no swimmer.

Most are in another unit than their keys say. They are no faults, as nobody knows every robot.
"""

from collections.abc import Iterator
from math import pi, prod

from swimcal.mjcf import build_mjcf, natural_hz
from swimcal.robot import RobotSpec

LONGEST = 0.5
"""Largest share of the robot's length that one of its parts has."""
USUAL_DENSITY_KG_M3 = (900.0, 1300.0)
USUAL_VISCOSITY_PA_S = (3e-4, 5e-3)
USUAL_SHARE_OF_FIN = (0.0, 0.5)
"""Mass of the fin over that of the robot."""
USUAL_OVER_DISPLACED = (0.2, 6.0)
"""Mass of the robot over that of the water in the head's ellipsoid: the published one has 1.2."""
USUAL_NATURAL_HZ = (0.3, 20.0)
"""Natural frequency of the tail in air."""


def robot_doubts(robot: RobotSpec) -> tuple[str, ...]:
    """Return what no such robot has, a sentence each.

    Args:
        robot: the robot as described.
    """
    return (*_long_parts(robot), *_unusual_numbers(robot))


def _long_parts(robot: RobotSpec) -> Iterator[str]:
    fin, whole_m = robot.caudal_fin, robot.length_m
    lengths_m = {"crank.arm_m": robot.crank.arm_m}
    lengths_m |= {f"caudal_fin.{key}": getattr(fin, key) for key in ("length_m", "chord_m", "span_m", "thickness_m")}
    lengths_m |= {f"head.fluid_half_size_m[{k}]": size for k, size in enumerate(robot.head.fluid_half_size_m)}
    for number, segment in enumerate(robot.tail.segment):
        sizes = {key: getattr(segment, key) for key in ("gap_m", "length_m", "thickness_m", "half_height_m")}
        lengths_m |= {f"tail.segment[{number}].{key}": size for key, size in sizes.items()}
    for key, m in lengths_m.items():
        if m > LONGEST * whole_m:
            yield f"{key} = {m:g}: {100 * m / whole_m:.0f} % of the {whole_m:.3g} m from nose to fin. Is it in metres?"


def _unusual_numbers(robot: RobotSpec) -> Iterator[str]:
    mass_kg = float(build_mjcf(robot).compile().body_mass.sum())
    displaced_kg = robot.water.density_kg_m3 * 4 / 3 * pi * prod(robot.head.fluid_half_size_m)
    fin_share, over_displaced = robot.caudal_fin.mass_kg / mass_kg, mass_kg / displaced_kg
    ranges = (
        ("water.density_kg_m3", robot.water.density_kg_m3, "", USUAL_DENSITY_KG_M3),
        ("water.viscosity_pa_s", robot.water.viscosity_pa_s, "", USUAL_VISCOSITY_PA_S),
        ("caudal_fin.mass_kg over the robot's mass", fin_share, "", USUAL_SHARE_OF_FIN),
        ("its mass over that of water in head.fluid_half_size_m", over_displaced, "", USUAL_OVER_DISPLACED),
        ("its tail's frequency in air, by tail.hinge_stiffness_n_m", natural_hz(robot), " Hz", USUAL_NATURAL_HZ),
    )
    for name, value, unit, (low, high) in ranges:
        if not low <= value <= high:
            usual = f"usual are {low:g} to {high:g}{unit}"
            yield f"{name}: {value:.3g}{unit}, {usual}. Are the units those of the keys?"
