"""Start boxes found in a picture, drawn as a preview, or clicked by a person.

`find_boxes` finds them without a click, or reports why they are not certain. `write_preview` draws them before the
tracking: the robot with names, its crowded tail, its place. `ClickBoxes` is a page on which a person clicks the
markers: one file that asks for nothing from the network.
"""

from __future__ import annotations

import base64
import colorsys
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
from jinja2 import Environment, StrictUndefined
from markupsafe import Markup
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from scipy.optimize import isotonic_regression
from scipy.special import softmax

from swimcal.errors import Fault, InputError
from swimcal.results import writing_whole
from tracking.body_chain import Blob, Bodies, Polarity, body_steps, complete_bodies, find_blobs
from tracking.boxes import Box, StartBoxes

# The search.
CERTAIN = 0.95
"""Least probability of the body that was found."""
NO_BODY_COST = 1.75
"""Cost for each marker if there is no whole body. The public tracks' own places cost 0.3 to 1.2 a marker; a glint that
stands in for a hidden marker made it 1.7 and more in drawn scenes."""
BOX_DIAMETERS = 1.4
"""Side of a box in diameters of its marker."""
SMALLEST_BOX_PX = 9.0
LONGER = 1.12
"""A marker longer than wide by this factor more than those before and behind it runs into what is next to it."""

# The preview.
SIZE_IN = (14.0, 7.875)
DPI = 110
PAPER = "#10151a"
INK = "#e4ebf1"
CROWDED = 3.5
"""Markers whose nearest neighbour is within so many times the least distance make up the crowded part."""
OFF_LINE = 0.12
"""A marker farther off the line through all of them, in lengths of the robot, is named on its own side."""
SHOWN_PX = 1600
"""The whole frame is shown with at most about so many columns."""

# The page to click.
JPEG_QUALITY = 92
USUAL_SIDE_PX = 25.0


def find_boxes(
    luma: np.ndarray, layout_m: np.ndarray, markers: Sequence[str], *, frame: int = 0, file: str = "the video"
) -> StartBoxes:
    """Find the markers of a straight or bent robot, seen from above, of unknown place, heading and scale.

    Args:
        luma: (h, w) bytes.
        layout_m: (m, 2) marker positions on the straight robot, robot frame, m.
        markers: their m names.
        frame: number of the picture in its video.
        file: name of the video in messages.

    Raises:
        InputError: the body is not found, or not with certainty; reports what was seen and how to click it.
    """
    layout_m = np.asarray(layout_m, dtype=float)
    try:
        body_steps(layout_m)
    except ValueError as error:
        raise _refusal(file, frame, "the markers cannot be found", str(error), "") from error
    seen = []
    for polarity in ("bright", "dark"):
        blobs = find_blobs(luma, polarity)
        seen.append(_PolarityBlobs(polarity, blobs, complete_bodies(blobs, layout_m)))
    best = min(seen, key=lambda each: each.bodies.cost[:1].min(initial=np.inf))
    confidence, runner_up = _probabilities(seen, len(markers))
    if confidence < CERTAIN:
        raise _not_certain(file, frame, seen, markers, (confidence, runner_up))
    chosen = [best.blobs[k] for k in best.bodies.blobs[0]]
    if merged := _find_merged(chosen, layout_m):
        found = f"{', '.join(markers[k] for k in merged)} longer than wide, other than the markers before and behind"
        raise _refusal(file, frame, "a marker runs into something next to it", found, "a disc, set off all around")
    boxes = {name: _box(blob, chosen, luma.shape) for name, blob in zip(markers, chosen, strict=True)}
    return StartBoxes(frame, boxes)


@dataclass(frozen=True)
class _PolarityBlobs:
    polarity: Polarity
    blobs: tuple[Blob, ...]
    bodies: Bodies


def _probabilities(seen: Sequence[_PolarityBlobs], count: int) -> tuple[float, float]:
    """Return the probabilities of the best and the next best body, among all bodies and none."""
    costs = np.sort(np.concatenate([each.bodies.cost for each in seen]))
    if len(costs) == 0:
        return 0.0, 0.0
    share = softmax(np.append(-costs, -NO_BODY_COST * count))
    return float(share[0]), float(share[1]) if len(costs) > 1 else 0.0


def _find_merged(chosen: Sequence[Blob], layout_m: np.ndarray) -> list[int]:
    """List the markers whose blob is much longer than its neighbours'.

    Motion blur grows gradually along the body, so such a blob is merged with something else.
    """
    nose, neck, steps = body_steps(layout_m)
    pairs = [(nose, neck), *((step.before, step.marker) for step in steps)]
    longest = np.zeros(len(chosen))  # elongation of each marker's longest neighbour
    for one, other in pairs:
        longest[one] = max(longest[one], chosen[other].elongation)
        longest[other] = max(longest[other], chosen[one].elongation)
    return [k for k, blob in enumerate(chosen) if blob.elongation > LONGER * longest[k]]


def _box(blob: Blob, chosen: Sequence[Blob], shape: tuple[int, ...]) -> Box:
    """Return a square around a marker that ends at the middle of its neighbours and at the edge of the picture."""
    apart = [np.hypot(blob.x - other.x, blob.y - other.y) for other in chosen if other is not blob]
    side = float(np.clip(BOX_DIAMETERS * blob.diameter_px, SMALLEST_BOX_PX, max(min(apart), SMALLEST_BOX_PX)))
    room = 2 * min(blob.x, blob.y, shape[1] - 1 - blob.x, shape[0] - 1 - blob.y) + 1
    return Box.around((blob.x, blob.y), min(side, room))


def _not_certain(
    file: str, frame: int, seen: Sequence[_PolarityBlobs], markers: Sequence[str], sure: tuple[float, float]
) -> InputError:
    counts = " and ".join(f"{len(each.blobs)} {each.polarity} blobs" for each in seen)
    if not any(len(each.bodies.cost) for each in seen):
        return _refusal(file, frame, "the robot was not found", counts, _describe_wanted(markers))
    what = "the robot was not found with certainty"
    if sure[1] > 0.02:
        found = f"{counts}; two ways to see the robot in them, with probabilities {sure[0]:.2f} and {sure[1]:.2f}"
    else:
        found = f"{counts}; the best way to see the robot in them has a probability of {sure[0]:.2f}"
    return _refusal(file, frame, what, found, f"{_describe_wanted(markers)}, and a probability of at least {CERTAIN:g}")


def _describe_wanted(markers: Sequence[str]) -> str:
    return f"{len(markers)} round markers of one brightness, spaced as on the robot ({', '.join(markers)})"


def _refusal(file: str, frame: int, what: str, found: str, expected: str) -> InputError:
    step = (
        "Click the markers: `calib track SESSION --click` opens a page in the browser, and saves the boxes. "
        "Or choose another frame, in which no marker is hidden."
    )
    return InputError([Fault(file, f"frame {frame}", what, found, expected, next_step=step)])


# The preview.


class View(NamedTuple):
    """A part of the picture, px: left, top, right, bottom, in corners of pixels."""

    left: float
    top: float
    right: float
    bottom: float

    @property
    def size(self) -> tuple[float, float]:
        """Width and height, px."""
        return self.right - self.left, self.bottom - self.top


def write_preview(path: Path, rgb: np.ndarray, boxes: StartBoxes) -> None:
    """Write a PNG of the boxes on their frame, (h, w, 3) bytes.

    Args:
        path: the PNG to write.
        rgb: (h, w, 3) the frame, bytes.
        boxes: the boxes to draw.

    Raises:
        ResultsNotWritable: the file cannot be written.
    """
    figure = Figure(figsize=SIZE_IN, dpi=DPI, facecolor=PAPER)
    figure.text(0.02, 0.955, f"Start boxes in frame {boxes.frame}", color=INK, size=14, weight="bold")
    centre_px = boxes.centres_px(boxes.markers)
    body = _view(rgb, list(boxes.boxes.values()), 1.25, margin=0.22)
    crowd = [boxes.boxes[boxes.markers[k]] for k in _find_crowded(centre_px)]
    tail = _view(rgb, crowd, 1.14, margin=0.30)
    overview = figure.add_axes((0.66, 0.555, 0.325, 0.37), anchor="N")
    _show(overview, rgb, View(-0.5, -0.5, rgb.shape[1] - 0.5, rgb.shape[0] - 0.5))
    for view, place in ((body, (0.015, 0.03, 0.63, 0.895)), (tail, (0.66, 0.03, 0.325, 0.505))):
        axes = figure.add_axes(place)
        _show(axes, rgb, view)
        _draw_boxes(axes, boxes, view)
        overview.add_patch(Rectangle(view[:2], *view.size, fill=False, edgecolor=INK, linewidth=1.0))
    with writing_whole(path) as part:
        figure.savefig(part, format="png", facecolor=PAPER)


def marker_colour(number: int) -> tuple[float, float, float]:
    """Return a bright colour for each marker, as on the click page (hues a golden angle apart)."""
    return colorsys.hls_to_rgb((number * 0.381966 + 190 / 360) % 1.0, 0.72, 0.95)


def label_spots(centre_px: np.ndarray, view: View) -> np.ndarray:
    """Place the labels (m, 2) in two rows or columns next to the body, so that they overlap neither it nor each other.

    Markers well off the line through the others are named on their own side, the rest take turns; on each side the
    labels keep the markers' order, as near to them as their width allows (isotonic regression: the least squares
    solution under the order).

    Args:
        centre_px: (m, 2) centres of the markers, px.
        view: the part of the picture that is shown.
    """
    size = np.array(view.size)
    along = int(np.ptp(centre_px[:, 1]) > np.ptp(centre_px[:, 0]))  # 0: the body lies across the view, 1: upright
    width, start = size[along], (view.left, view.top)[along]
    gap = width * (0.155 if along == 0 else 0.06)
    order = np.argsort(centre_px[:, along], kind="stable")
    sides = _sides(centre_px[order], along)
    spots = np.empty_like(centre_px)
    for side in (0, 1):
        mine = order[sides == side]
        room = np.arange(len(mine)) * gap
        low, high = start + 0.09 * width, start + 0.91 * width - room[-1:].sum()
        wanted = isotonic_regression(centre_px[mine, along] - room).x if len(mine) else room
        spots[mine, along] = np.clip(wanted, low, max(low, high)) + room
        spots[mine, 1 - along] = _beside(centre_px, view, along, side)
    return spots


def _find_crowded(centre_px: np.ndarray) -> np.ndarray:
    apart = np.linalg.norm(centre_px[:, None] - centre_px, axis=2) + np.diag(np.full(len(centre_px), np.inf))
    nearest = apart.min(axis=1, initial=np.inf)
    return np.flatnonzero(nearest <= CROWDED * nearest.min())


def _view(rgb: np.ndarray, boxes: Sequence[Box], aspect: float, margin: float) -> View:
    """Return the part of the picture that holds the boxes, with a margin, as wide as `aspect` times its height."""
    corners = np.array([(b.x, b.y, b.x + b.width, b.y + b.height) for b in boxes]) - 0.5
    low, high = corners[:, :2].min(axis=0), corners[:, 2:].max(axis=0)
    extent = (high - low) + 2 * margin * max(high - low)
    width = max(extent[0], aspect * extent[1])
    half = np.array([width, width / aspect]) / 2
    limit = np.array(rgb.shape[1::-1])
    middle = np.clip((low + high) / 2, np.minimum(half, limit / 2), np.maximum(limit - half, limit / 2)) - 0.5
    return View(*(middle - half), *(middle + half))


def _show(axes: Any, rgb: np.ndarray, view: View) -> None:
    rows = slice(max(0, int(view.top)), max(0, int(view.bottom)) + 2)
    columns = slice(max(0, int(view.left)), max(0, int(view.right)) + 2)
    part = rgb[rows, columns]
    step = max(1, round(part.shape[1] / SHOWN_PX))
    left, top = columns.start - 0.5, rows.start - 0.5
    extent = (left, left + part.shape[1], top + part.shape[0], top)
    axes.imshow(part[::step, ::step], extent=extent, interpolation="antialiased", aspect="equal")
    axes.set(xlim=(view.left, view.right), ylim=(view.bottom, view.top), xticks=[], yticks=[], facecolor="#000000")
    axes.spines[:].set_color("#3a4650")


def _draw_boxes(axes: Any, boxes: StartBoxes, view: View) -> None:
    inside = [
        (number, name, np.array(box.centre_px))
        for number, (name, box) in enumerate(boxes.boxes.items())
        if view.left < box.centre_px[0] < view.right and view.top < box.centre_px[1] < view.bottom
    ]
    for number, name, _ in inside:
        box = boxes.boxes[name]
        corner = box.x - 0.5, box.y - 0.5
        for colour, width in (("#000000", 3.2), (marker_colour(number), 1.5)):
            axes.add_patch(Rectangle(corner, box.width, box.height, fill=False, edgecolor=colour, linewidth=width))
    spots = label_spots(np.array([centre for _, _, centre in inside]), view)
    for (number, name, centre), spot in zip(inside, spots, strict=True):
        start = _rim(boxes.boxes[name], spot - centre)
        axes.plot(*np.transpose([start, spot]), color=marker_colour(number), linewidth=1.0)
        style = {"boxstyle": "round,pad=0.3", "facecolor": PAPER, "edgecolor": "none", "alpha": 0.92}
        axes.text(*spot, name, color=marker_colour(number), size=10, ha="center", va="center", bbox=style)


def _rim(box: Box, towards: np.ndarray) -> np.ndarray:
    """Return the point (2,) where a line from a box's centre leaves the box."""
    half = np.array([box.width, box.height]) / 2
    return np.array(box.centre_px) + towards / max(np.max(np.abs(towards) / half), 1.0)


def _sides(centre_px: np.ndarray, along: int) -> np.ndarray:
    """Return the side of each marker's label, (m,) 0 or 1: above or below, left or right."""
    place, across = centre_px[:, along], centre_px[:, 1 - along]
    if len(place) < 3:
        return np.arange(len(place)) % 2
    off = across - np.polyval(np.polyfit(place, across, 1), place)
    far = np.abs(off) > OFF_LINE * np.ptp(place)
    sides = np.where(off > 0, 1, 0)
    sides[~far] = np.arange(np.count_nonzero(~far)) % 2
    return sides


def _beside(centre_px: np.ndarray, view: View, along: int, side: int) -> float:
    """Return the coordinate of a row or column of labels, between the body and the edge of the view."""
    across = centre_px[:, 1 - along]
    edge = (view[1 - along], view[3 - along])[side]
    inset = view.size[1 - along] * (0.05 if along == 0 else 0.10)
    body = (across.min(), across.max())[side]
    wanted = body + (0.45 * (edge - body))
    return float(max(wanted, edge + inset) if side == 0 else min(wanted, edge - inset))


@dataclass(frozen=True, eq=False)
class ClickBoxes:
    """A frame with its markers to be clicked; `load_boxes` reads what the page saves.

    Attributes:
        rgb: (h, w, 3) the frame, bytes; `frame` is its number in the video.
        markers: the markers to click, in the order in which they are asked for.
        suggested: boxes to begin with; the person only has to check and save them.
        blobs: places that a click snaps to (`find_blobs`); elsewhere it snaps to what stands out under it.
        layout_m: (m, 2) places on the straight robot, m, for the little map of the markers.
        place: where the saved file belongs in the session folder; None: ``trials/<trial>.boxes.json``.
    """

    rgb: np.ndarray
    markers: Sequence[str]
    trial: str = "trial"
    frame: int = 0
    suggested: StartBoxes | None = None
    blobs: Sequence[Blob] = ()
    layout_m: np.ndarray | None = None
    place: str | None = None

    def html(self) -> str:
        """Render the whole page."""
        folder = files("tracking") / "templates"
        style, script, page = (
            (folder / name).read_text("utf-8") for name in ("click.css", "click.js", "click.html.j2")
        )
        environment = Environment(autoescape=True, undefined=StrictUndefined, keep_trailing_newline=True)
        return environment.from_string(page).render(
            trial=self.trial,
            frame=self.frame,
            place=self.place or f"trials/{self.trial}.boxes.json",
            style=Markup(style),  # our own file
            script=Markup(script),
            data=self._data(),
        )

    def _data(self) -> dict[str, Any]:
        height, width = self.rgb.shape[:2]
        suggested = self.suggested.to_json()["boxes"] if self.suggested else {}
        return {
            "image": _as_jpeg(self.rgb),
            "width": width,
            "height": height,
            "markers": list(self.markers),
            "trial": self.trial,
            "frame": self.frame,
            "suggested": {name: suggested[name] for name in self.markers if name in suggested},
            "blobs": [[round(value, 2) for value in blob[:3]] for blob in self.blobs],
            "side_px": self._side_px(),
            "layout": None if self.layout_m is None else np.asarray(self.layout_m, dtype=float).tolist(),
        }

    def _side_px(self) -> int:
        """Return the side of new boxes: that of the suggested ones, or one that fits the diameter of the blobs."""
        if self.suggested:
            return round(float(np.median([box.width for box in self.suggested.boxes.values()])))
        if self.blobs:
            diameters = [blob.diameter_px for blob in self.blobs[: len(self.markers)]]
            return round(BOX_DIAMETERS * float(np.median(diameters)))
        return round(USUAL_SIDE_PX)


def _as_jpeg(rgb: np.ndarray) -> str:
    """Encode the picture (h, w, 3) as a data URL."""
    ok, data = cv2.imencode(".jpg", np.ascontiguousarray(rgb[:, :, ::-1]), [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    if not ok:
        raise ValueError(f"a picture of shape {rgb.shape} cannot be stored as JPEG")
    return "data:image/jpeg;base64," + base64.b64encode(data.tobytes()).decode()
