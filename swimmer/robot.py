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
from pydantic import Field, ValidationInfo, field_validator

from session.toml_source import Table, key_error, load_toml
from swimmer.robot_checks import crank_faults, guide_faults, marker_faults, part_faults, raise_together

Positive = Annotated[float, Field(gt=0)]
NonNegative = Annotated[float, Field(ge=0)]
# What the engine can hold; and a length in millimetres, or a mass in grams, is most likely outside.
Length = Annotated[float, Field(ge=1e-5, le=10.0)]
Offset = Annotated[float, Field(ge=0.0, le=10.0)]
Coordinate = Annotated[float, Field(ge=-10.0, le=10.0)]
Mass = Annotated[float, Field(ge=1e-6, le=100.0)]
Point = tuple[Coordinate, Coordinate, Coordinate]  # x, y, z in the robot frame, m
HalfSize = tuple[Length, Length, Length]


class Water(Table):
    """The medium of the swim trials; the dry experiments take none."""

    density_kg_m3: Positive
    viscosity_pa_s: NonNegative


class Part(Table):
    """A box of uniform density that gives the head its mass and inertia."""

    name: str
    centre_m: Point
    half_size_m: HalfSize
    mass_kg: Mass


class Head(Table):
    """The passive frame: one fluid ellipsoid, any number of massive parts."""

    fluid_centre_m: Point
    fluid_half_size_m: HalfSize
    part: Annotated[tuple[Part, ...], Field(min_length=1)]

    @field_validator("part")
    @classmethod
    def _differ(cls, part: tuple[Part, ...]) -> tuple[Part, ...]:
        raise_together(part_faults([one.name for one in part]))
        return part


class Crank(Table):
    """The shaft (along y) with two arms 180 degrees apart; a tendon is anchored near the end of each."""

    position_m: Point
    arm_m: Length
    anchor_inset_m: Offset
    anchor_offset_m: Length
    armature_kg_m2: Positive
    speed_gain_n_m_s: Positive

    @field_validator("anchor_inset_m")
    @classmethod
    def _on_the_arm(cls, anchor_inset_m: float, info: ValidationInfo) -> float:
        arm_m = info.data.get("arm_m")
        if arm_m is not None and anchor_inset_m >= arm_m:
            raise key_error("the tendon anchor is not on the arm", expected=f"less than arm_m = {arm_m:g}")
        return anchor_inset_m

    @property
    def anchor_radius_m(self) -> float:
        """Distance of the tendon anchor from the shaft, m."""
        return self.arm_m - self.anchor_inset_m


class Segment(Table):
    """A rigid tail segment and the flexible gap before it, which bends at one hinge in its middle."""

    gap_m: Length
    length_m: Length
    thickness_m: Length
    half_height_m: Length
    guide_offset_m: Offset
    tendon_crosses: bool = False


class Tail(Table):
    """The articulated part: segments in order from the head, all hinges equal."""

    start_m: Coordinate
    hinge_stiffness_n_m: Positive
    hinge_damping_n_m_s: NonNegative
    density_kg_m3: Annotated[float, Field(ge=1.0, le=3e4)]
    guide_inset_m: Offset
    segment: Annotated[tuple[Segment, ...], Field(min_length=1)]

    @field_validator("segment")
    @classmethod
    def _hold_their_guides(cls, segment: tuple[Segment, ...], info: ValidationInfo) -> tuple[Segment, ...]:
        raise_together(guide_faults([one.length_m for one in segment], info.data.get("guide_inset_m")))
        return segment

    @property
    def hinges(self) -> tuple[str, ...]:
        """Names of the hinges, which are also those of the bodies behind them."""
        return tuple(f"tail_{i + 1}" for i in range(len(self.segment)))

    @property
    def links(self) -> tuple[str, ...]:
        """Names of the rigid links, from the head to the last segment."""
        return ("head", *self.hinges)


class CaudalFin(Table):
    """The fin, rigid with the last segment; a plate of span x chord at the centre of its planform."""

    gap_m: Offset
    length_m: Length
    centre_m: Coordinate
    chord_m: Length
    span_m: Length
    thickness_m: Length
    mass_kg: Mass


class Tendons(Table):
    """Both tendons, equal: springs and dampers along their path, at rest where the tail is straight."""

    stiffness_n_m: Positive
    damping_n_s_m: NonNegative


class Marker(Table):
    """A marker: the link that carries it and its place on the straight robot (robot frame)."""

    body: str
    position_m: Point


class ElongatedBody(Table):
    """What elongated body theory needs: depth d at the trailing edge and the reference area S of the drag."""

    depth_m: Length
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

    @field_validator("tail")
    @classmethod
    def _clear_of_the_crank(cls, tail: Tail, info: ValidationInfo) -> Tail:
        crank: Crank | None = info.data.get("crank")
        reach_m = None if crank is None else crank.position_m[0] + crank.arm_m
        raise_together(crank_faults(reach_m, tail.start_m))
        return tail

    @field_validator("markers")
    @classmethod
    def _on_the_robot(cls, markers: dict[str, Marker], info: ValidationInfo) -> dict[str, Marker]:
        tail = info.data.get("tail")
        body, x_m = {}, {}
        for name, marker in markers.items():
            body[name], x_m[name] = marker.body, marker.position_m[0]
        raise_together(marker_faults(body, x_m, tail.links if tail else ()))
        return markers

    @cached_property
    def links(self) -> tuple[str, ...]:
        """Names of the rigid links that can carry markers, from the head to the last segment."""
        return self.tail.links

    @cached_property
    def hinges(self) -> tuple[str, ...]:
        """Names of the tail hinges, which are also those of the bodies behind them."""
        return self.tail.hinges

    @cached_property
    def hinge_x_m(self) -> np.ndarray:
        """(h,) x of each hinge on the straight robot, m."""
        gaps = np.array([s.gap_m for s in self.tail.segment])
        lengths = np.array([s.length_m for s in self.tail.segment])
        return _read_only(self.tail.start_m + np.cumsum(gaps + lengths) - lengths - gaps / 2)

    @cached_property
    def segment_x_m(self) -> np.ndarray:
        """(h, 2) x of the front and rear end of each segment on the straight robot, m."""
        half_gaps = np.array([s.gap_m for s in self.tail.segment]) / 2
        lengths = np.array([s.length_m for s in self.tail.segment])
        front = self.hinge_x_m + half_gaps
        return _read_only(np.stack([front, front + lengths], axis=1))

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
        """From the nose marker to the tips of the caudal fin, m."""
        return self.fin_root_x_m + self.caudal_fin.length_m - self.markers["nose"].position_m[0]

    def marker_positions_m(self, names: tuple[str, ...]) -> np.ndarray:
        """(m, 3) places of the named markers on the straight robot, robot frame, m."""
        return np.array([self.markers[name].position_m for name in names])


def load_robot(path: Path | None = None) -> RobotSpec:
    """The robot described in a TOML file, or the published 0.57 m fish.

    Raises:
        session.InputError: all faults of the file, each with its line.
    """
    return _default_robot() if path is None else load_toml(Path(path), RobotSpec)


def _read_only(array: np.ndarray) -> np.ndarray:
    """The array itself: one robot serves the whole program, so nobody may change it."""
    array.setflags(write=False)
    return array


@lru_cache(maxsize=1)
def _default_robot() -> RobotSpec:
    with as_file(files("swimmer") / "robots" / "fish_057.toml") as path:
        return load_toml(path, RobotSpec)
