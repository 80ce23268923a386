"""What must fit together in a robot's description, beyond the range of each value.

Each check needs a few valid tables only, so its faults come out together with those of the rest of the file.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

from pydantic import ValidationError
from pydantic_core import InitErrorDetails, PydanticCustomError

from session.errors import did_you_mean, shown
from session.toml_source import key_error

HEAD_MARKERS = ("nose", "neck")
"""The markers that make the head frame; every robot has them."""


def raise_together(faults: Iterable[InitErrorDetails]) -> None:
    """Raises one error of pydantic's that holds every fault, each with its own place.

    Raises:
        pydantic.ValidationError: if there is any.
    """
    if details := list(faults):
        raise ValidationError.from_exception_data("robot", details)


def part_faults(names: Sequence[str]) -> Iterator[InitErrorDetails]:
    """Parts of the head that bear the name of an earlier one: each becomes a geom of its own name."""
    for number, name in enumerate(names):
        if name in names[:number]:
            error = key_error("two parts of one name", found=shown(name), expected="names that differ")
            yield _fault(error, number, "name")


def guide_faults(lengths_m: Iterable[float], guide_inset_m: float | None) -> Iterator[InitErrorDetails]:
    """Segments too short to hold a tendon guide."""
    for number, length_m in enumerate(lengths_m):
        if guide_inset_m is not None and length_m < guide_inset_m:
            error = key_error(
                "the tendon guide is before the segment",
                found=shown(length_m),
                expected=f"at least tail.guide_inset_m = {guide_inset_m:g}",
            )
            yield _fault(error, number, "length_m")


def crank_faults(reach_m: float | None, tail_start_m: float) -> Iterator[InitErrorDetails]:
    """A tail that begins within the crank's reach."""
    if reach_m is not None and reach_m >= tail_start_m:
        error = key_error(
            "the crank would hit the tail",
            found=shown(tail_start_m),
            expected=f"more than crank.position_m[0] + crank.arm_m = {reach_m:g}",
        )
        yield _fault(error, "start_m")


def marker_faults(
    body: Mapping[str, str], x_m: Mapping[str, float], links: Sequence[str]
) -> Iterator[InitErrorDetails]:
    """Markers on links the robot lacks (`links` empty: not known), and a head frame that cannot be made.

    Args:
        body, x_m: the link of each marker, and where along the robot it sits.
        links: of the robot.
    """
    for name, link in body.items():
        if links and link not in links:
            error = key_error(
                "the marker is on a link the robot lacks",
                found=shown(link),
                expected="a link of the robot",
                choices=links,
                next_step=did_you_mean(link, links),
            )
            yield _fault(error, name, "body")
    yield from _head_frame_faults(body, x_m)


def _head_frame_faults(body: Mapping[str, str], x_m: Mapping[str, float]) -> Iterator[InitErrorDetails]:
    for name in HEAD_MARKERS:
        if name not in body:
            error = key_error(
                f"marker {name!r} is missing",
                found=shown(list(body)),
                expected="nose and neck among the markers: they make the head frame",
            )
            yield _fault(error, name)
        elif body[name] != "head":
            error = key_error(
                "a marker of the head frame is not on the head",
                found=shown(body[name]),
                expected="'head'",
            )
            yield _fault(error, name, "body")
    nose, neck = (x_m.get(name) for name in HEAD_MARKERS)
    if nose is not None and neck is not None and nose >= neck:
        error = key_error(
            "the nose is not before the neck",
            found=f"x = {nose:g}",
            expected=f"less than that of the neck, {neck:g}",
            next_step="x runs from nose to tail.",
        )
        yield _fault(error, "nose", "position_m")


def _fault(error: PydanticCustomError, *place: str | int) -> InitErrorDetails:
    """The error at a place below the value that is checked; `found` is in the error already."""
    return InitErrorDetails(type=error, loc=place, input="")
