"""Numbers that differ between simulations: one row each, made from the layout, then changed by whoever likes."""

from dataclasses import dataclass, fields, replace
from typing import Self

import numpy as np

from benchmarks.reality.layout import Layout


@dataclass(frozen=True, eq=False)
class Parameters:
    """Body, drive, water and markers of n simulations (l links, h hinges, s strips, m markers)."""

    # link_mass_kg, link_moment_kg_m, link_inertia_kg_m2: (n, l); moments about the link's origin
    link_mass_kg: np.ndarray
    link_moment_kg_m: np.ndarray
    link_inertia_kg_m2: np.ndarray
    hinge_stiffness_n_m: np.ndarray  # (n, h) stiffness, per rad
    hinge_damping_n_m_s: np.ndarray  # (n, h) damping, per rad
    hinge_rest_rad: np.ndarray  # (n, h) angle at which a hinge's spring is at rest
    # tendon_stiffness_n_m, tendon_damping_n_s_m: (n, 2), left and right
    tendon_stiffness_n_m: np.ndarray
    tendon_damping_n_s_m: np.ndarray
    tendon_extra_m: np.ndarray  # (n, 2) free length beyond that of the straight fish
    anchor_radius_m: np.ndarray  # (n, 2) distance from the shaft to each tendon's anchor
    coefficients: np.ndarray  # (n, 5, s) blunt, slender and angular drag, Kutta and Magnus lift, on each strip
    density_kg_m3: np.ndarray  # (n, 1) density of the fluid; 0 in air
    # (n, 1) additional wet height of every strip, m. Mechanisms with heights in them keep to the described ones, as
    # their strengths do.
    sunk_m: np.ndarray
    # (n, s) share at each strip, 0 to 1, of elongated body theory's reactive force; see `benchmarks.reality.fluid`
    added_mass_reaction: np.ndarray
    current_m_s: np.ndarray  # (n, 1) velocity of the water in the pool, complex
    head_clamped: np.ndarray  # (n, 1) whether the head is held where it is
    marker_m: np.ndarray  # (n, m) places from the origin of their link, in its axes, complex
    # extra_implicit_stiffness_n_m, extra_implicit_damping_n_m_s: (n, h) largest additions by a mechanism's own torques
    # at the hinges, so that the integrator stays stable. They exert nothing themselves.
    extra_implicit_stiffness_n_m: np.ndarray
    extra_implicit_damping_n_m_s: np.ndarray

    def __len__(self) -> int:
        return len(self.link_mass_kg)

    def reweighed(self, factor: np.ndarray | float, added: np.ndarray) -> Self:
        """Scale all masses by a factor (l,), and add mass, first and second moment (3, l) of more on the links."""
        return replace(
            self,
            link_mass_kg=self.link_mass_kg * factor + added[0],
            link_moment_kg_m=self.link_moment_kg_m * factor + added[1],
            link_inertia_kg_m2=self.link_inertia_kg_m2 * factor + added[2],
        )

    def taken_implicitly(self, stiffness: np.ndarray | float = 0.0, damping: np.ndarray | float = 0.0) -> Self:
        """Add what more of a mechanism's torques at the hinges the integrator is to take implicitly."""
        return replace(
            self,
            extra_implicit_stiffness_n_m=self.extra_implicit_stiffness_n_m + stiffness,
            extra_implicit_damping_n_m_s=self.extra_implicit_damping_n_m_s + damping,
        )

    @classmethod
    def stacked(cls, parts: list[Self]) -> Self:
        """Stack all rows of all parts, in order."""
        return cls(**{f.name: np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(cls)})


def nominal_parameters(layout: Layout, markers: tuple[str, ...], coefficients: tuple[float, ...]) -> Parameters:
    """Build one row: the robot as described, swimming in still water, its markers in the plane of the scale."""
    robot, hinges = layout.robot, layout.hinges
    each = layout.hinges_per_gap  # hinges in series: each stiffer by their number
    link = np.array([layout.link_of(robot.markers[name].body) for name in markers])
    place = robot.marker_positions_m(markers)

    def row(values: np.ndarray | complex, count: int) -> np.ndarray:
        return np.broadcast_to(np.asarray(values), (1, count)).copy()

    return Parameters(
        link_mass_kg=layout.mass_kg[None].copy(),
        link_moment_kg_m=layout.moment_kg_m[None].copy(),
        link_inertia_kg_m2=layout.inertia_kg_m2[None].copy(),
        hinge_stiffness_n_m=row(each * robot.tail.hinge_stiffness_n_m, hinges),
        hinge_damping_n_m_s=row(each * robot.tail.hinge_damping_n_m_s, hinges),
        hinge_rest_rad=row(0.0, hinges),
        tendon_stiffness_n_m=row(robot.tendons.stiffness_n_m, 2),
        tendon_damping_n_s_m=row(robot.tendons.damping_n_s_m, 2),
        tendon_extra_m=row(0.0, 2),
        anchor_radius_m=row(robot.crank.anchor_radius_m, 2),
        coefficients=np.repeat(np.array(coefficients, float)[None, :, None], len(layout.strips.link), axis=2),
        density_kg_m3=row(robot.water.density_kg_m3, 1),
        sunk_m=row(0.0, 1),
        added_mass_reaction=row(0.0, len(layout.strips.link)),
        current_m_s=row(0.0 + 0.0j, 1),
        head_clamped=row(False, 1),
        marker_m=(place[:, 0] - layout.origin_m[link] + 1j * place[:, 1])[None],
        extra_implicit_stiffness_n_m=row(0.0, hinges),
        extra_implicit_damping_n_m_s=row(0.0, hinges),
    )
