"""Start boxes drawn before the tracking: the robot with names, its crowded tail, its place in the picture."""

from __future__ import annotations

import colorsys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from scipy.optimize import isotonic_regression

from swimcal.results import writing_whole
from tracking.boxes import Box, StartBoxes

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


class PictureView(NamedTuple):
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
    _show(overview, rgb, PictureView(-0.5, -0.5, rgb.shape[1] - 0.5, rgb.shape[0] - 0.5))
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


def label_spots(centre_px: np.ndarray, view: PictureView) -> np.ndarray:
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


def _view(rgb: np.ndarray, boxes: Sequence[Box], aspect: float, margin: float) -> PictureView:
    """Return the part of the picture that holds the boxes, with a margin, as wide as `aspect` times its height."""
    corners = np.array([(b.x, b.y, b.x + b.width, b.y + b.height) for b in boxes]) - 0.5
    low, high = corners[:, :2].min(axis=0), corners[:, 2:].max(axis=0)
    extent = (high - low) + 2 * margin * max(high - low)
    width = max(extent[0], aspect * extent[1])
    half = np.array([width, width / aspect]) / 2
    limit = np.array(rgb.shape[1::-1])
    middle = np.clip((low + high) / 2, np.minimum(half, limit / 2), np.maximum(limit - half, limit / 2)) - 0.5
    return PictureView(*(middle - half), *(middle + half))


def _show(axes: Any, rgb: np.ndarray, view: PictureView) -> None:
    rows = slice(max(0, int(view.top)), max(0, int(view.bottom)) + 2)
    columns = slice(max(0, int(view.left)), max(0, int(view.right)) + 2)
    part = rgb[rows, columns]
    step = max(1, round(part.shape[1] / SHOWN_PX))
    left, top = columns.start - 0.5, rows.start - 0.5
    extent = (left, left + part.shape[1], top + part.shape[0], top)
    axes.imshow(part[::step, ::step], extent=extent, interpolation="antialiased", aspect="equal")
    axes.set(xlim=(view.left, view.right), ylim=(view.bottom, view.top), xticks=[], yticks=[], facecolor="#000000")
    axes.spines[:].set_color("#3a4650")


def _draw_boxes(axes: Any, boxes: StartBoxes, view: PictureView) -> None:
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


def _beside(centre_px: np.ndarray, view: PictureView, along: int, side: int) -> float:
    """Return the coordinate of a row or column of labels, between the body and the edge of the view."""
    across = centre_px[:, 1 - along]
    edge = (view[1 - along], view[3 - along])[side]
    inset = view.size[1 - along] * (0.05 if along == 0 else 0.10)
    body = (across.min(), across.max())[side]
    wanted = body + (0.45 * (edge - body))
    return float(max(wanted, edge + inset) if side == 0 else min(wanted, edge - inset))
