"""The robot as its maker describes it: geometry, masses, tendon routing, hinges, markers, water.

A `RobotSpec` is read from a TOML file and validated when it is made. Lengths are in metres, masses in kilograms,
angles in radians. The robot frame has x from nose to tail along the straight body, z up, y to complete a
right-handed frame; the robot swims towards -x.
"""

from functools import cached_property, lru_cache
from importlib.resources import as_file, files
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field, model_validator

from session import Table, load_toml

Positive = Annotated[float, Field(gt=0)]
NonNegative = Annotated[float, Field(ge=0)]
Point = tuple[float, float, float]  # x, y, z in the robot frame, m
HalfSize = tuple[Positive, Positive, Positive]


class Water(Table):
    """The medium of the swims; the dry experiments take none."""

    density_kg_m3: Positive
    viscosity_pa_s: NonNegative


class Part(Table):
    """A box of uniform density that gives the head its mass and inertia."""

    name: str
    centre_m: Point
    half_size_m: HalfSize
    mass_kg: Positive


class Head(Table):
    """The passive frame: one fluid ellipsoid, any number of massive parts."""

    fluid_centre_m: Point
    fluid_half_size_m: HalfSize
    part: Annotated[tuple[Part, ...], Field(min_length=1)]


class Crank(Table):
    """The shaft (along y) with two arms 180 degrees apart; a tendon is anchored near the end of each."""

    position_m: Point
    arm_m: Positive
    anchor_inset_m: NonNegative
    anchor_offset_m: Positive
    armature_kg_m2: Positive
    speed_gain_n_m_s: Positive

    @property
    def anchor_radius_m(self) -> float:
        """Distance of the tendon anchor from the shaft, m."""
        return self.arm_m - self.anchor_inset_m


class Segment(Table):
    """A rigid tail segment and the flexible gap before it, which bends at one hinge in its middle."""

    gap_m: Positive
    length_m: Positive
    thickness_m: Positive
    half_height_m: Positive
    guide_offset_m: NonNegative
    tendon_crosses: bool = False


class Tail(Table):
    """The articulated part: segments in order from the head, all hinges alike."""

    start_m: float
    hinge_stiffness_n_m: Positive
    hinge_damping_n_m_s: NonNegative
    density_kg_m3: Positive
    guide_inset_m: NonNegative
    segment: Annotated[tuple[Segment, ...], Field(min_length=1)]


class CaudalFin(Table):
    """The fin, rigid with the last segment; a plate of span x chord at the centre of its planform."""

    gap_m: NonNegative
    centre_m: float
    chord_m: Positive
    span_m: Positive
    thickness_m: Positive
    mass_kg: Positive


class Tendons(Table):
    """Both tendons alike: springs and dampers along their path, at rest where the tail is straight."""

    stiffness_n_m: Positive
    damping_n_s_m: NonNegative


class Marker(Table):
    """A marker: the link that carries it and its place on the straight robot (robot frame)."""

    body: str
    position_m: Point


class ElongatedBody(Table):
    """What elongated body theory needs: depth d at the trailing edge and the reference area S of the drag."""

    depth_m: Positive
    reference_area_m2: Positive


class RobotSpec(Table):
    """A tendon-driven swimmer. See `swimmer/robots/fish_057.toml` for every key with its unit.

    Raises:
        session.InputError: from `load_robot`, with every fault of the file.
    """

    name: str
    water: Water
    head: Head
    crank: Crank
    tail: Tail
    caudal_fin: CaudalFin
    tendons: Tendons
    markers: dict[str, Marker]
    elongated_body: ElongatedBody

    @model_validator(mode="after")
    def _fits_together(self) -> "RobotSpec":
        wrong = [f"{name} (on {m.body})" for name, m in self.markers.items() if m.body not in self.links]
        if wrong:
            raise ValueError(f"markers on links the robot lacks: {', '.join(wrong)}; links: {', '.join(self.links)}")
        if missing := {"nose", "neck"} - self.markers.keys():
            raise ValueError(f"the head frame needs the markers nose and neck; missing: {', '.join(sorted(missing))}")
        off = [n for n in ("nose", "neck") if self.markers[n].body != "head"]
        if off:
            raise ValueError(f"nose and neck must be carried by the head; {', '.join(off)} is not")
        if self.markers["nose"].position_m[0] >= self.markers["neck"].position_m[0]:
            raise ValueError("the nose must lie before the neck (smaller x)")
        if self.crank.anchor_inset_m >= self.crank.arm_m:
            raise ValueError("crank.anchor_inset_m must be smaller than crank.arm_m")
        if self.crank.position_m[0] + self.crank.arm_m >= self.tail.start_m:
            raise ValueError("the crank must turn clear of the tail: position_m[0] + arm_m < tail.start_m")
        if short := [i for i, s in enumerate(self.tail.segment) if s.length_m < self.tail.guide_inset_m]:
            raise ValueError(f"tail.guide_inset_m is longer than tail.segment[{short[0]}]")
        return self

    @cached_property
    def links(self) -> tuple[str, ...]:
        """Names of the rigid links that can carry markers, from the head to the last segment."""
        return ("head", *self.hinges)

    @cached_property
    def hinges(self) -> tuple[str, ...]:
        """Names of the tail hinges, which are also those of the bodies behind them."""
        return tuple(f"tail_{i + 1}" for i in range(len(self.tail.segment)))

    @cached_property
    def hinge_x_m(self) -> np.ndarray:
        """(h,) x of each hinge on the straight robot, m."""
        gaps = np.array([s.gap_m for s in self.tail.segment])
        lengths = np.array([s.length_m for s in self.tail.segment])
        return self.tail.start_m + np.cumsum(gaps + lengths) - lengths - gaps / 2

    @cached_property
    def segment_x_m(self) -> np.ndarray:
        """(h, 2) x of the front and rear end of each segment on the straight robot, m."""
        half_gaps = np.array([s.gap_m for s in self.tail.segment]) / 2
        lengths = np.array([s.length_m for s in self.tail.segment])
        front = self.hinge_x_m + half_gaps
        return np.stack([front, front + lengths], axis=1)

    @cached_property
    def fin_root_x_m(self) -> float:
        """The caudal fin's root on the straight robot, m."""
        return float(self.segment_x_m[-1, 1]) + self.caudal_fin.gap_m

    @property
    def scale_length_m(self) -> float:
        """Nose to neck, the length scale of every video, m."""
        return float(np.linalg.norm(np.subtract(self.markers["neck"].position_m, self.markers["nose"].position_m)[:2]))

    @property
    def length_m(self) -> float:
        """From the nose marker to the end of the caudal fin, m."""
        end = self.fin_root_x_m + self.caudal_fin.centre_m + self.caudal_fin.chord_m / 2
        return end - self.markers["nose"].position_m[0]

    def marker_positions_m(self, names: tuple[str, ...]) -> np.ndarray:
        """(m, 3) places of the named markers on the straight robot, robot frame, m."""
        return np.array([self.markers[name].position_m for name in names])


def load_robot(path: Path | None = None) -> RobotSpec:
    """The robot described in a TOML file, or the published 0.57 m fish.

    Raises:
        session.InputError: all faults of the file, each with its line.
    """
    return _default_robot() if path is None else load_toml(Path(path), RobotSpec)


@lru_cache(maxsize=1)
def _default_robot() -> RobotSpec:
    with as_file(files("swimmer") / "robots" / "fish_057.toml") as path:
        return load_toml(path, RobotSpec)
