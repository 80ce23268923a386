"""A board to print, at its true size."""

from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

from session import InputError
from session.errors import Fault
from session.results import writing_whole
from tracking.lens.board import BoardSpec

SUFFIXES = (".pdf", ".svg", ".png")
PNG_DPI = 300
MM = 1000.0
MM_PER_INCH = 25.4
RULER_MM = 100.0


class Rectangle(NamedTuple):
    """A dark rectangle on the board, board frame, m."""

    x: float
    y: float
    width: float
    height: float


def draw_board(path: Path, board: BoardSpec) -> None:
    """Draw the board at its true size with a white edge and a ruler to check the print by.

    Print without scaling, glue it to something flat, and measure the squares: that is `square_m`.

    Raises:
        InputError: another suffix than .pdf, .svg or .png (300 dots an inch).
        ResultsNotWritable: the file cannot be written.
    """
    if path.suffix.lower() not in SUFFIXES:
        found = path.suffix or "no suffix"
        raise InputError([Fault(str(path), "", "no such kind of drawing", found, "", SUFFIXES)])
    from matplotlib import rc_context
    from matplotlib.collections import PatchCollection
    from matplotlib.figure import Figure
    from matplotlib.patches import Rectangle as Patch

    edge, foot = board.square_m * MM, 15.0
    width, height = board.size_m[0] * MM, board.size_m[1] * MM
    whole = (width + 2 * edge, height + 2 * edge + foot)
    figure = Figure(figsize=(whole[0] / MM_PER_INCH, whole[1] / MM_PER_INCH), facecolor="white")
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set_axis_off()
    axes.set(xlim=(-edge, width + edge), ylim=(height + edge + foot, -edge))
    dark = [Patch((r.x * MM, r.y * MM), r.width * MM, r.height * MM) for r in dark_rectangles(board)]
    axes.add_collection(PatchCollection(dark, facecolor="black", edgecolor="none", linewidth=0, antialiased=False))
    ruler = min(RULER_MM, 10 * np.floor(width / 10))
    axes.plot([0, ruler], [height + edge + 2, height + edge + 2], color="black", linewidth=1)
    size = f"{board.kind}, {board.columns} x {board.rows} squares of {board.square_m * MM:g} mm"
    markers = f", {board.dictionary}, markers {board.marker_side_m * MM:g} mm" if board.kind == "charuco" else ""
    text = f"The line is {ruler:g} mm long. {size}{markers}"
    axes.text(0, height + edge + 4, text, va="top", fontsize=min(7.0, 7.0 * width / 150))
    with writing_whole(path) as part, rc_context({"svg.hashsalt": "board"}):
        figure.savefig(part, dpi=PNG_DPI, format=path.suffix[1:].lower(), metadata=_omit_date(path))


def dark_rectangles(board: BoardSpec) -> list[Rectangle]:
    """List everything dark on the board: its dark squares, and the dark modules of its markers."""
    side = board.square_m
    squares = [
        Rectangle(column * side, row * side, side, side)
        for row in range(board.rows)
        for column in range(board.columns)
        if (row + column) % 2 == 0
    ]
    return squares + (_marker_modules(board) if board.kind == "charuco" else [])


def _marker_modules(board: BoardSpec) -> list[Rectangle]:
    dictionary = board.charuco.getDictionary()
    modules = dictionary.markerSize + 2
    size = board.marker_side_m / modules
    rectangles = []
    for number, places in zip(np.ravel(board.charuco.getIds()), board.charuco.getObjPoints(), strict=True):
        corner = np.asarray(places)[0]
        picture = cv2.aruco.generateImageMarker(dictionary, int(number), modules, borderBits=1)
        for row, column in np.argwhere(picture == 0):
            rectangles.append(Rectangle(float(corner[0]) + column * size, float(corner[1]) + row * size, size, size))
    return rectangles


def _omit_date(path: Path) -> dict[str, None] | None:
    """Return metadata that leave the date out, so that the same board gives the same file."""
    return {".pdf": {"CreationDate": None}, ".svg": {"Date": None}}.get(path.suffix.lower())
