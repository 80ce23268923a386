"""The calibration board: a chessboard, bare or with ArUco markers in its white squares (ChArUco)."""

from functools import cached_property
from pathlib import Path
from typing import Annotated, Literal

import cv2
import numpy as np
from pydantic import Field, ValidationInfo, field_validator

from session.errors import did_you_mean
from session.toml_source import Table, key_error, load_toml

SquareSize = Annotated[float, Field(ge=1e-3, le=2.0)]
MARKER_SHARE = 0.7
"""Side of a marker over that of its square, where nothing else is given."""


class BoardSpec(Table):
    """A board of dark and light squares, the corner square at its top left dark.

    ChArUco is the better choice: each corner has a number, so a board that is half out of the picture still counts,
    and it reaches the edges of the picture, where a lens bends most (Garrido-Jurado and others, Pattern Recognition
    47, 2014, section 3). Board frame: origin at the outer top left corner, x along a row, y down the columns, m.

    Attributes:
        kind: ``"charuco"`` or ``"chessboard"``.
        columns, rows: number of squares, the outer ones included.
        square_m: side of a square, measured on the printed board.
        marker_m: side of a marker (ChArUco); None: 0.7 of the square.
        dictionary: of the markers, by OpenCV's name.
    """

    kind: Literal["charuco", "chessboard"] = "charuco"
    columns: int = Field(ge=3, le=60)
    rows: int = Field(ge=3, le=60)
    square_m: SquareSize
    marker_m: SquareSize | None = None
    dictionary: str = "DICT_5X5_250"

    @field_validator("marker_m")
    @classmethod
    def _inside_its_square(cls, marker_m: float | None, info: ValidationInfo) -> float | None:
        square_m = info.data.get("square_m")
        if marker_m is not None and square_m is not None and marker_m >= square_m:
            raise key_error("the marker does not fit its square", expected=f"less than square_m = {square_m:g}")
        return marker_m

    @field_validator("dictionary")
    @classmethod
    def _known(cls, name: str, info: ValidationInfo) -> str:
        known = sorted(key for key in dir(cv2.aruco) if key.startswith("DICT_"))
        if name not in known:
            next_step = did_you_mean(name, known)
            raise key_error("no such dictionary", expected="one of OpenCV's", choices=known, next_step=next_step)
        needed = info.data.get("columns", 0) * info.data.get("rows", 0) // 2
        if info.data.get("kind") == "charuco" and (held := len(_dictionary(name).bytesList)) < needed:
            raise key_error(
                "the dictionary has too few markers", found=f"{name}: {held}", expected=f"at least {needed}"
            )
        return name

    @property
    def marker_side_m(self) -> float:
        """Side of a marker, m."""
        return MARKER_SHARE * self.square_m if self.marker_m is None else self.marker_m

    @property
    def size_m(self) -> tuple[float, float]:
        """Width and height over all squares, m."""
        return self.columns * self.square_m, self.rows * self.square_m

    @cached_property
    def charuco(self) -> cv2.aruco.CharucoBoard:
        """OpenCV's board (its layout since 4.6)."""
        size = (self.columns, self.rows)
        return cv2.aruco.CharucoBoard(size, self.square_m, self.marker_side_m, _dictionary(self.dictionary))

    @cached_property
    def corner_places_m(self) -> np.ndarray:
        """Inner corners row by row, (k, 3), k = (columns - 1) (rows - 1), board frame, z = 0."""
        row, column = np.mgrid[1 : self.rows, 1 : self.columns]
        return np.stack([column, row, 0 * row], axis=-1).reshape(-1, 3) * self.square_m


class _BoardFile(Table):
    board: BoardSpec


def load_board(path: Path) -> BoardSpec:
    """Read a TOML file with one table ``[board]`` of the keys of `BoardSpec`.

    Raises:
        InputError: every fault of the file at once.
    """
    return load_toml(path, _BoardFile).board


def _dictionary(name: str) -> cv2.aruco.Dictionary:
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))
