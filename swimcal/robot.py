"""The robot as its maker describes it: geometry, masses, tendon routing, hinges, markers, water.

A `RobotSpec` is read from a TOML file and validated when it is made. Lengths are in metres, masses in kilograms, angles
in radians. The robot frame has x from nose to tail along the straight body, z up, y to complete a right-handed frame;
the robot swims towards -x. Conditions between several values are checked on a few valid tables only, so that their
faults are reported together with those of the rest of the file.
"""

from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property, lru_cache, partial
from importlib.resources import as_file, files
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field, ValidationError, ValidationInfo, field_validator
from pydantic_core import InitErrorDetails, PydanticCustomError

from swimcal.errors import Fault, InputError, did_you_mean, shown
from swimcal.session_file import HEAD_MARKERS, Positive
from swimcal.toml import TomlTable, key_error, load_toml

NonNegative = Annotated[float, Field(ge=0)]
# The engine can hold these ranges; a length in millimetres, or a mass in grams, is most likely outside of them.
Length = Annotated[float, Field(ge=1e-5, le=10.0)]
Offset = Annotated[float, Field(ge=0.0, le=10.0)]
Coordinate = Annotated[float, Field(ge=-10.0, le=10.0)]
Mass = Annotated[float, Field(ge=1e-6, le=100.0)]
AddedMass = Annotated[float, Field(ge=0.0, le=100.0)]  # 0: there is none
Point = tuple[Coordinate, Coordinate, Coordinate]  # x, y, z in the robot frame, m
HalfSize = tuple[Length, Length, Length]
# Much below, a fit takes days; much above, motions at 6 Hz have less than 20 steps a beat.
TIME_STEP_S = 0.0045
SHORTEST_STEP_S = 1e-4
TimeStep = Annotated[float, Field(ge=SHORTEST_STEP_S, le=0.01)]
_SAME_LENGTH = 1e-6  # relative difference of two lengths by rounding


def _raise_together(faults: Iterable[InitErrorDetails]) -> None:
    """Raise one pydantic error that holds every fault, each with its own place.

    Raises:
        pydantic.ValidationError: if there is any fault.
    """
    if details := list(faults):
        raise ValidationError.from_exception_data("robot", details)


def _fault(error: PydanticCustomError, *place: str | int) -> InitErrorDetails:
    """Return the error at a place below the value that is checked; `found` is in the error already."""
    return InitErrorDetails(type=error, loc=place, input="")


class Water(TomlTable):
    """The medium of the swim trials; the dry experiments take none."""

    density_kg_m3: Positive
    viscosity_pa_s: NonNegative


class Part(TomlTable):
    """A box of uniform density that gives the head its mass and inertia."""

    name: str
    centre_m: Point
    half_size_m: HalfSize
    mass_kg: Mass


class Head(TomlTable):
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


class Crank(TomlTable):
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


class Segment(TomlTable):
    """A rigid tail segment and the flexible gap before it, which bends at one hinge in its middle.

    A flexible strip spans either half of the gap; that before the tail's first hinge is a part of the head.
    """

    gap_m: Length
    length_m: Length
    thickness_m: Length
    half_height_m: Length
    guide_offset_m: Offset
    tendon_crosses: bool = False
    guide_plate_width_m: Offset = 0.0  # width from the segment's side; 0: it has no plates
    strip_mass_kg: AddedMass = 0.0  # mass of each strip of the gap


class Tail(TomlTable):
    """The articulated part: segments in order from the head, all hinges equal.

    A guide plate, of the segments' material, stands on either side of a segment and holds the tendon there.
    """

    start_m: Coordinate
    hinge_stiffness_n_m: Positive
    hinge_damping_n_m_s: NonNegative
    density_kg_m3: Annotated[float, Field(ge=1.0, le=3e4)]
    guide_inset_m: Offset
    guide_plate_length_m: Offset = 0.0  # along the tail, half of it before the tendon guide
    guide_plate_height_m: Offset = 0.0
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

    @field_validator("segment")
    @classmethod
    def _guide_plates_with_their_size(cls, segment: tuple[Segment, ...], info: ValidationInfo) -> tuple[Segment, ...]:
        widths = [(number, one.guide_plate_width_m) for number, one in enumerate(segment) if one.guide_plate_width_m]
        sizes = {key: info.data.get(key) for key in ("guide_plate_length_m", "guide_plate_height_m")}  # None: faulty
        error = partial(key_error, "a guide plate without its size")
        missing = " and ".join(f"tail.{key} above 0" for key, size in sizes.items() if size == 0)
        if missing:
            _raise_together(
                _fault(error(found=shown(width), expected=missing), number, "guide_plate_width_m")
                for number, width in widths
            )
        if not widths and any(sizes.values()):
            raise key_error(
                "the guide plates have a size but no width",
                found=", ".join(f"tail.{key} = {size:g}" for key, size in sizes.items() if size),
                expected="guide_plate_width_m in the segments that have such plates",
            )
        return segment

    @property
    def hinges(self) -> tuple[str, ...]:
        """Names of the hinges, which are also those of the bodies behind them."""
        return tuple(f"tail_{i + 1}" for i in range(len(self.segment)))


class CaudalFin(TomlTable):
    """The fin, rigid with the last segment; a plate of span x chord at the centre of its planform.

    One flexible strip, which does not bend, spans the gap before it.
    """

    gap_m: Offset
    length_m: Length
    centre_m: Coordinate
    chord_m: Length
    span_m: Length
    thickness_m: Length
    mass_kg: Mass
    strip_mass_kg: AddedMass = 0.0

    @field_validator("strip_mass_kg")
    @classmethod
    def _strip_in_a_gap(cls, strip_mass_kg: float, info: ValidationInfo) -> float:
        if strip_mass_kg > 0 and info.data.get("gap_m") == 0:
            raise key_error("a flexible strip where there is no gap", expected="0, as caudal_fin.gap_m is 0")
        return strip_mass_kg


class Tendons(TomlTable):
    """Both tendons, equal: springs and dampers along their path, at rest where the tail is straight."""

    stiffness_n_m: Positive
    damping_n_s_m: NonNegative


class Marker(TomlTable):
    """A marker: the link that carries it and its place on the straight robot (robot frame)."""

    body: str
    position_m: Point


class ElongatedBody(TomlTable):
    """Numbers of the body in elongated body theory: depth d at the trailing edge and reference area S of the drag."""

    depth_m: Length
    reference_area_m2: Positive


class RobotSpec(TomlTable):
    """A tendon-driven swimmer. See `swimcal/robots/fish_057.toml` for every key with its unit.

    Raises:
        swimcal.errors.InputError: from `load_robot`, with every fault of the file.
    """

    name: str
    time_step_s: TimeStep = TIME_STEP_S
    water: Water
    head: Head
    crank: Crank
    tail: Tail
    caudal_fin: CaudalFin
    tendons: Tendons
    markers: dict[str, Marker]
    elongated_body: ElongatedBody

    def __repr__(self) -> str:
        size = f"{self.length_m:.2f} m long, {len(self.tail.segment)} tail segments, {len(self.markers)} markers"
        return f"<RobotSpec {self.name}: {size}>"

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
        """x of each hinge on the straight robot, (h,), m."""
        gaps = np.array([s.gap_m for s in self.tail.segment])
        lengths = np.array([s.length_m for s in self.tail.segment])
        return _read_only(self.tail.start_m + np.cumsum(gaps + lengths) - lengths - gaps / 2)

    @cached_property
    def segment_x_m(self) -> np.ndarray:
        """x of the front and rear end of each segment on the straight robot, (h, 2), m."""
        half_gaps = np.array([s.gap_m for s in self.tail.segment]) / 2
        lengths = np.array([s.length_m for s in self.tail.segment])
        front = self.hinge_x_m + half_gaps
        return _read_only(np.stack([front, front + lengths], axis=1))

    @cached_property
    def fin_root_x_m(self) -> float:
        """x of the caudal fin's root on the straight robot, m."""
        return float(self.segment_x_m[-1, 1]) + self.caudal_fin.gap_m

    def segment_mass_kg(self, number: int) -> float:
        """Return the mass of a segment alone, without guide plates and strips, kg."""
        segment = self.tail.segment[number]
        return segment.length_m * segment.thickness_m * 2 * segment.half_height_m * self.tail.density_kg_m3

    def guide_plate_mass_kg(self, number: int) -> float:
        """Return the mass of each of the two guide plates of a segment, kg; 0 where it has none."""
        area_m2 = self.tail.guide_plate_length_m * self.tail.guide_plate_height_m
        return area_m2 * self.tail.segment[number].guide_plate_width_m * self.tail.density_kg_m3

    @cached_property
    def tail_mass_kg(self) -> np.ndarray:
        """Mass of each link behind the head, with guide plates, strips and, on the last, the fin, (h,), kg."""
        tail, fin = self.tail.segment, self.caudal_fin
        segments = [self.segment_mass_kg(i) + 2 * self.guide_plate_mass_kg(i) for i in range(len(tail))]
        before = np.array([segment.strip_mass_kg for segment in tail])
        behind = np.append(before[1:], fin.strip_mass_kg)
        return _read_only(np.array(segments) + before + behind + fin.mass_kg * (np.arange(len(tail)) == len(tail) - 1))

    def with_tail_mass_times(self, factor: float) -> "RobotSpec":
        """Return the robot with everything behind the first hinge `factor` times as heavy."""
        strips = [segment.strip_mass_kg * factor for segment in self.tail.segment]
        segment = tuple(
            one.model_copy(update={"strip_mass_kg": kg}) for one, kg in zip(self.tail.segment, strips, strict=True)
        )
        fin = {key: getattr(self.caudal_fin, key) * factor for key in ("mass_kg", "strip_mass_kg")}
        return self.changed(
            tail={"density_kg_m3": self.tail.density_kg_m3 * factor, "segment": segment}, caudal_fin=fin
        )

    @property
    def scale_length_m(self) -> float:
        """Distance from nose to neck, the length scale of every video, m."""
        return float(np.linalg.norm(np.subtract(self.markers["neck"].position_m, self.markers["nose"].position_m)[:2]))

    def with_scale_length(self, length_m: float) -> "RobotSpec":
        """Return the robot with its neck marker at another distance from the nose, in the same direction.

        Args:
            length_m: that distance seen from above, m; the robot itself is returned where it differs by rounding alone.
        """
        ratio = length_m / self.scale_length_m
        if abs(ratio - 1) < _SAME_LENGTH:
            return self
        (nose, neck), height_m = self.marker_positions_m(HEAD_MARKERS)[:, :2], self.markers["neck"].position_m[2]
        place = (*map(float, nose + ratio * (neck - nose)), height_m)
        moved = self.markers["neck"].model_copy(update={"position_m": place})
        return self.model_copy(update={"markers": {**self.markers, "neck": moved}})

    @property
    def names_time_step(self) -> bool:
        """Return whether the robot's file names the time step; then no fit chooses a finer one."""
        return "time_step_s" in self.model_fields_set

    def with_time_step(self, time_step_s: float) -> "RobotSpec":
        """Return the robot simulated with this time step, s; the robot itself where that is its own."""
        return self if time_step_s == self.time_step_s else self.model_copy(update={"time_step_s": time_step_s})

    @property
    def length_m(self) -> float:
        """Distance from the nose marker to the tips of the caudal fin, m."""
        return self.fin_root_x_m + self.caudal_fin.length_m - self.markers["nose"].position_m[0]

    def changed(self, **tables: Mapping[str, object]) -> "RobotSpec":
        """Return the robot with other values in some of its tables, by table and key; they are not validated."""
        parts = {name: getattr(self, name).model_copy(update=values) for name, values in tables.items()}
        return self.model_copy(update=parts)

    def marker_positions_m(self, names: tuple[str, ...]) -> np.ndarray:
        """Return the positions (m, 3) of the named markers on the straight robot, robot frame, m."""
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
    """Load the robot described in a TOML file, or the published 0.57 m fish.

    Raises:
        swimcal.errors.InputError: all faults of the file, each with its line.
    """
    if path is None:
        return _default_robot()
    try:
        return load_toml(Path(path), RobotSpec)
    except InputError as error:
        if not any(fault.where.endswith(", session") for fault in error.faults):
            raise
        step = "Give the file that its table robot names; without that table the robot is the published fish."
        fault = Fault(str(path), "", "describes a session, not a robot", expected="the file of a robot", next_step=step)
        raise InputError([fault]) from None


def _read_only(array: np.ndarray) -> np.ndarray:
    """Make an array read-only and return it: one robot serves the whole program, so nobody may change it."""
    array.setflags(write=False)
    return array


@lru_cache(maxsize=1)
def _default_robot() -> RobotSpec:
    with as_file(files("swimcal") / "robots" / "fish_057.toml") as path:
        return load_toml(path, RobotSpec)
