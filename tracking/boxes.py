"""Start boxes: where each marker is in one frame of a video, as a JSON file checked against the robot's layout.

    {"frame": 0, "boxes": {"nose": [x, y, width, height], …}}

Pixels: x to the right, y down, the centre of the top left pixel is (0, 0). A box covers the pixels x … x + width - 1,
so its centre is x + (width - 1) / 2.

`check_layout` reports an order or a spacing that no pose of the robot can have. People place boxes loosely, and the
real robot's tail root is at three times the layout's distance from the dorsal fin: only what is far beyond that is
refused. In the first frames of the public trials the boxes depart by at most 2.5 standard deviations of
`body_chain.ChainSpread`; with two neighbours exchanged, by 9 and more. The dorsal fin and the first marker of the tail
are the exception: exchanged, they depart by 2 to 7, and may pass.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from swimcal.errors import Fault, FaultCollector, InputError, did_you_mean, shown
from swimcal.results import write_whole
from tracking.body_chain import FoundStep, found_steps
from tracking.video import VideoInfo

# Boxes in the file.
SMALLEST_SIDE_PX = 3.0
"""A box with a shorter side holds no marker."""
BEYOND = 0.25
"""A box may reach beyond the picture by this share of its side; it is clipped."""
ONE_SPOT = 0.25
"""Two centres closer than this share of the smaller box are on one spot."""
FORM = '{"frame": 0, "boxes": {"nose": [x, y, width, height], …}}'
AGAIN = "Click the markers again with `calib track SESSION --click`."

# Boxes against the layout.
IMPOSSIBLE = 6.0
"""Standard deviations beyond which a step along the body cannot be."""
LIKELY = 3.0
"""Standard deviations to which an exchange must bring every step to be suggested."""


class Box(NamedTuple):
    """A box in a picture, px: corner of the least x and y, then its size."""

    x: float
    y: float
    width: float
    height: float

    @property
    def centre_px(self) -> tuple[float, float]:
        """Centre of the box, (x, y), px."""
        return self.x + (self.width - 1) / 2, self.y + (self.height - 1) / 2

    @classmethod
    def around(cls, centre_px: Sequence[float], side_px: float) -> Box:
        """Return the square box with the given centre and side."""
        half = (side_px - 1) / 2
        return cls(float(centre_px[0]) - half, float(centre_px[1]) - half, float(side_px), float(side_px))


class ImpossibleBoxes(InputError):
    """The faults of boxes that are sound each but no pose of the robot: names are exchanged, or clicks are wrong."""


@dataclass(frozen=True)
class StartBoxes:
    """A box for every marker by its name, in one frame of a video, of which the first is 0."""

    frame: int
    boxes: dict[str, Box]

    @property
    def markers(self) -> tuple[str, ...]:
        """The markers' names."""
        return tuple(self.boxes)

    def centres_px(self, markers: Sequence[str]) -> np.ndarray:
        """Return the (m, 2) box centres of the named markers, px."""
        return np.array([self.boxes[name].centre_px for name in markers]).reshape(-1, 2)

    def sides_px(self, markers: Sequence[str]) -> np.ndarray:
        """Return the (m,) mean sides of the boxes of the named markers, px."""
        return np.array([(self.boxes[name].width + self.boxes[name].height) / 2 for name in markers])

    def to_json(self) -> dict[str, Any]:
        """Return the boxes in the form of the file, rounded to a hundredth of a pixel."""
        boxes = {name: [round(value, 2) for value in box] for name, box in self.boxes.items()}
        return {"frame": self.frame, "boxes": boxes}


def save_boxes(path: Path, boxes: StartBoxes) -> None:
    """Write the boxes as JSON, one marker a line.

    Raises:
        ResultsNotWritable: the file cannot be written; what stood there is unchanged.
    """
    plain = boxes.to_json()
    lines = ",\n".join(f"  {json.dumps(name)}: {json.dumps(box)}" for name, box in plain["boxes"].items())
    write_whole(path, f'{{"frame": {plain["frame"]}, "boxes": {{\n{lines}\n}}}}\n')


def load_boxes(
    path: Path, markers: Sequence[str], video: VideoInfo | None = None, layout_m: np.ndarray | None = None
) -> StartBoxes:
    """Read start boxes and check them.

    Args:
        path: the JSON file.
        markers: names of the m markers; each needs one box.
        video: its pictures have to contain the boxes, and it has to have their frame.
        layout_m: (m, 2) marker positions on the straight robot, robot frame, m; the boxes have to fit a pose of it.

    Raises:
        InputError: every fault of the file at once; an `ImpossibleBoxes` where only the pose is at fault.
    """
    faults = FaultCollector(str(path))
    data = _read(path)
    frame = _frame(data, faults)
    found = _boxes(data, markers, faults)
    if video is not None:
        found = _clip(found, (video.width_px, video.height_px), faults)
        if frame >= video.frames:
            faults.add("frame", "no such frame in the video", found=str(frame), expected=f"0 to {video.frames - 1}")
    _check_apart(found, faults)
    boxes = StartBoxes(frame, {name: found[name] for name in markers if name in found})
    if layout_m is not None and not any(fault.where.startswith("boxes") for fault in faults.faults):
        pose = FaultCollector(str(path))
        check_layout(markers, boxes.centres_px(markers), layout_m, pose)
        if pose and not faults:
            raise ImpossibleBoxes(pose.faults)
        faults.extend(pose.faults)
    faults.raise_if_any()
    return boxes


def _read(path: Path) -> dict[str, Any]:
    def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        names = [name for name, _ in pairs]
        if twice := next((name for name in names if names.count(name) > 1), ""):
            raise ValueError(f"{twice!r} is given twice")
        return dict(pairs)

    try:
        data = json.loads(path.read_bytes(), object_pairs_hook=once)
    except (OSError, ValueError, RecursionError) as error:
        expected = f"a JSON file {FORM}"
        raise InputError([Fault(str(path), "", "the boxes cannot be read", str(error), expected, (), AGAIN)]) from error
    if not isinstance(data, dict):
        raise InputError([Fault(str(path), "", "not an object", shown(data), FORM, (), AGAIN)])
    return data


def _frame(data: dict[str, Any], faults: FaultCollector) -> int:
    """Return the frame's number, and add a fault for each unknown key next to it."""
    known = ("frame", "boxes")
    for key in data.keys() - set(known):
        faults.add(key, "unknown key", choices=known, next_step=did_you_mean(key, known))
    frame = data.get("frame")
    if isinstance(frame, bool) or not isinstance(frame, int) or frame < 0:
        found = shown(frame) if "frame" in data else ""
        what = "not the number of a frame" if "frame" in data else "missing"
        faults.add("frame", what, found=found, expected="a whole number of at least 0; the first frame is 0")
        return 0
    return frame


def _boxes(data: dict[str, Any], markers: Sequence[str], faults: FaultCollector) -> dict[str, Box]:
    """Return the sound boxes of known markers, and add a fault for everything else."""
    given = data.get("boxes")
    if not isinstance(given, dict):
        found = shown(given) if "boxes" in data else ""
        faults.add("boxes", "not an object" if found else "missing", found=found, expected=FORM, next_step=AGAIN)
        return {}
    for name in given:
        if name not in markers:
            hint = did_you_mean(name, markers)
            faults.add(f"boxes.{name}", "not a marker of the session", choices=markers, next_step=hint)
    for name in markers:
        if name not in given:
            faults.add(f"boxes.{name}", "missing", expected="a box for every marker of the session", next_step=AGAIN)
    sound = {name: _box(name, value, faults) for name, value in given.items() if name in markers}
    return {name: box for name, box in sound.items() if box is not None}


def _box(name: str, value: Any, faults: FaultCollector) -> Box | None:
    where = f"boxes.{name}"
    numbers = isinstance(value, list) and all(_is_number(item) for item in value)
    if not numbers or len(value) != len(Box._fields):
        faults.add(where, "not a box", found=shown(value), expected="four numbers [x, y, width, height] in pixels")
        return None
    box = Box(*map(float, value))
    if min(box.width, box.height) < SMALLEST_SIDE_PX:
        found = f"{box.width:g} x {box.height:g} px"
        faults.add(where, "too small", found=found, expected=f"sides of at least {SMALLEST_SIDE_PX:g} px")
        return None
    return box


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _clip(boxes: dict[str, Box], size: tuple[int, int], faults: FaultCollector) -> dict[str, Box]:
    """Cut off the small parts of boxes that lie beyond the picture, and add a fault where the parts are large."""
    clipped = {}
    for name, (x, y, width, height) in boxes.items():
        left, top = max(x, 0.0), max(y, 0.0)
        box = Box(left, top, min(x + width, size[0]) - left, min(y + height, size[1]) - top)
        clipped[name] = box
        if box.width < (1 - BEYOND) * width or box.height < (1 - BEYOND) * height:
            found = f"x {x:g} to {x + width - 1:g}, y {y:g} to {y + height - 1:g}"
            expected = f"x from 0 to {size[0] - 1}, y from 0 to {size[1] - 1}"
            faults.add(f"boxes.{name}", "outside the picture", found=found, expected=expected)
    return clipped


def _check_apart(boxes: dict[str, Box], faults: FaultCollector) -> None:
    for (first, one), (second, other) in combinations(boxes.items(), 2):
        apart = math.dist(one.centre_px, other.centre_px)
        if apart < (nearest := ONE_SPOT * min(*one[2:], *other[2:])):
            found, least = f"centres {apart:.1f} px apart", f"at least {nearest:.1f} px"
            expected = f"{least}; each marker has a place of its own"
            faults.add(f"boxes.{second}", f"on the same spot as {first}", found=found, expected=expected)


def check_layout(names: Sequence[str], centre_px: np.ndarray, layout_m: np.ndarray, faults: FaultCollector) -> None:
    """Add a fault for every step along the body that the robot cannot take; scale, heading and bend are free.

    Args:
        names: names of the m markers.
        centre_px: (m, 2) centres of the boxes, px, no two on one spot.
        layout_m: (m, 2) marker positions on the straight robot, m.
        faults: takes the faults.
    """
    try:
        taken = found_steps(centre_px, layout_m)
    except ValueError:  # too few markers in a row to tell
        return
    impossible = [each for each in taken if each.off > IMPOSSIBLE]
    hint = _exchange(names, centre_px, layout_m) if impossible else ""
    for each in impossible:
        before, marker = names[each.step.before], names[each.step.marker]
        step = hint or "Look at the markers' names, or click them again: `calib track SESSION --click`."
        what, found, expected = f"no place for {marker} behind {before}", _found(each, names), _expected(each, layout_m)
        faults.add(f"boxes.{marker}", what, found=found, expected=expected, next_step=step)


def _found(taken: FoundStep, names: Sequence[str]) -> str:
    """Describe the step in mm at the scale of the head, and its direction."""
    behind, front = (names[k] for k in taken.step.along)
    degrees = f"{abs(taken.bend_deg):.0f} degrees to the way from {behind} to {front}"
    return f"{1000 * taken.length_m:.0f} mm from it, at {degrees}"


def _expected(taken: FoundStep, layout_m: np.ndarray) -> str:
    spread = taken.step.spread
    wanted_m = layout_m[taken.step.marker] - layout_m[taken.step.before]
    if np.isfinite(spread.place_m):
        x, y = 1000 * wanted_m
        return f"{x:.0f} mm behind and {y:.0f} mm beside it, to within {1000 * IMPOSSIBLE * spread.place_m:.0f} mm"
    usual_mm = 1000 * float(np.linalg.norm(wanted_m)) * spread.stretch
    low, high = usual_mm * np.exp([-IMPOSSIBLE * spread.length, IMPOSSIBLE * spread.length])
    return f"{low:.0f} to {high:.0f} mm, at {IMPOSSIBLE * spread.bend_deg:.0f} degrees or less"


def _exchange(names: Sequence[str], centre_px: np.ndarray, layout_m: np.ndarray) -> str:
    """Describe the exchange of two names after which all would fit best; an empty text if none makes it fit."""
    worst = {}
    for one, other in combinations(range(len(names)), 2):
        order = np.arange(len(names))
        order[[one, other]] = other, one
        worst[one, other] = max(each.off for each in found_steps(centre_px[order], layout_m))
    (one, other), off = min(worst.items(), key=lambda item: item[1])
    return f"Exchange {names[one]} and {names[other]}: then they would fit." if off <= LIKELY else ""
