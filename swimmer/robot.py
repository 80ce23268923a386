"""The robot as its maker describes it: geometry, masses, tendon routing, hinges, markers, water.

A `RobotSpec` is read from a TOML file and validated when it is made. Lengths are in metres, masses in kilograms,
angles in radians. The robot frame has x from nose to tail along the straight body, z up, y to complete a
right-handed frame; the robot swims towards -x. What must fit together beyond the range of each value is checked on a
few valid tables only, so that its faults come out together with those of the rest of the file.
"""

from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property, lru_cache, partial
from importlib.resources import as_file, files
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field, ValidationError, ValidationInfo, field_validator
from pydantic_core import InitErrorDetails, PydanticCustomError

from session.errors import did_you_mean, shown
from session.session_file import HEAD_MARKERS
from session.toml_source import Table, key_error, load_toml

Positive = Annotated[float, Field(gt=0)]
NonNegative = Annotated[float, Field(ge=0)]
# What the engine can hold; and a length in millimetres, or a mass in grams, is most likely outside.
Length = Annotated[float, Field(ge=1e-5, le=10.0)]
Offset = Annotated[float, Field(ge=0.0, le=10.0)]
Coordinate = Annotated[float, Field(ge=-10.0, le=10.0)]
Mass = Annotated[float, Field(ge=1e-6, le=100.0)]
Point = tuple[Coordinate, Coordinate, Coordinate]  # x, y, z in the robot frame, m
HalfSize = tuple[Length, Length, Length]


def _raise_together(faults: Iterable[InitErrorDetails]) -> None:
    """Raises one error of pydantic's that holds every fault, each with its own place.

    Raises:
        pydantic.ValidationError: if there is any.
    """
    if details := list(faults):
        raise ValidationError.from_exception_data("robot", details)


def _fault(error: PydanticCustomError, *place: str | int) -> InitErrorDetails:
    """The error at a place below the value that is checked; `found` is in the error already."""
    return InitErrorDetails(type=error, loc=place, input="")


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
        names = [one.name for one in part]
        error = partial(key_error, "two parts of one name", expected="names that differ")  # each becomes a geom
        again = [(number, name) for number, name in enumerate(names) if name in names[:number]]
        _raise_together(_fault(error(found=shown(name)), number, "name") for number, name in again)
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
        inset_m = info.data.get("guide_inset_m", 0.0)
        error = partial(key_error, "the tendon guide is before the segment")
        expected = f"at least tail.guide_inset_m = {inset_m:g}"
        short = [(number, one.length_m) for number, one in enumerate(segment) if one.length_m < inset_m]
        _raise_together(_fault(error(found=shown(m), expected=expected), number, "length_m") for number, m in short)
        return segment

    @property
    def hinges(self) -> tuple[str, ...]:
        """Names of the hinges, which are also those of the bodies behind them."""
        return tuple(f"tail_{i + 1}" for i in range(len(self.segment)))


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
        if crank is not None and (reach_m := crank.position_m[0] + crank.arm_m) >= tail.start_m:
            expected = f"more than crank.position_m[0] + crank.arm_m = {reach_m:g}"
            error = key_error("the crank would hit the tail", found=shown(tail.start_m), expected=expected)
            _raise_together([_fault(error, "start_m")])
        return tail

    @field_validator("markers")
    @classmethod
    def _on_the_robot(cls, markers: dict[str, Marker], info: ValidationInfo) -> dict[str, Marker]:
        tail: Tail | None = info.data.get("tail")
        links = ("head", *tail.hinges) if tail else ()  # none: not known
        faults = []
        for name, marker in markers.items():
            if links and marker.body not in links:
                error = key_error(
                    "the marker is on a link the robot lacks",
                    found=shown(marker.body),
                    expected="a link of the robot",
                    choices=links,
                    next_step=did_you_mean(marker.body, links),
                )
                faults.append(_fault(error, name, "body"))
        _raise_together([*faults, *_head_frame_faults(markers)])
        return markers

    @cached_property
    def links(self) -> tuple[str, ...]:
        """Names of the rigid links that can carry markers, from the head to the last segment."""
        return ("head", *self.hinges)

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

    def changed(self, **tables: Mapping[str, object]) -> "RobotSpec":
        """The same with other values in some of its tables, by table and key; they are not validated."""
        parts = {name: getattr(self, name).model_copy(update=values) for name, values in tables.items()}
        return self.model_copy(update=parts)

    def marker_positions_m(self, names: tuple[str, ...]) -> np.ndarray:
        """(m, 3) places of the named markers on the straight robot, robot frame, m."""
        return np.array([self.markers[name].position_m for name in names])


def _head_frame_faults(markers: dict[str, Marker]) -> Iterator[InitErrorDetails]:
    for name in HEAD_MARKERS:
        if name not in markers:
            expected = "nose and neck among the markers: they make the head frame"
            yield _fault(key_error(f"marker {name!r} is missing", found=shown(list(markers)), expected=expected), name)
        elif (body := markers[name].body) != "head":
            what = "a marker of the head frame is not on the head"
            yield _fault(key_error(what, found=shown(body), expected="'head'"), name, "body")
    nose, neck = (markers[name].position_m[0] if name in markers else None for name in HEAD_MARKERS)
    if nose is not None and neck is not None and nose >= neck:
        error = key_error(
            "the nose is not before the neck",
            found=f"x = {nose:g}",
            expected=f"less than that of the neck, {neck:g}",
            next_step="x runs from nose to tail.",
        )
        yield _fault(error, "nose", "position_m")


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
