"""The calibration board: printed, found in pictures, and its scale.

A `BoardSpec` describes it: a chessboard, bare or with ArUco markers in its white squares (ChArUco). `draw_board` prints
it at its true size. `each_picture` and `video_pictures` read pictures of it, from files or a video, and `find_corners`
finds its inner corners in a picture. `scale_from_board` takes the scale from a board that lies level in the pool: an
alternative to the nose-neck distance.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated, Literal, NamedTuple

import cv2
import numpy as np
from pydantic import Field, ValidationInfo, field_validator
from scipy.optimize import brentq

from swimcal.errors import Fault, FaultCollector, InputError, NotEnoughData, did_you_mean
from swimcal.results import writing_whole
from swimcal.session_file import CameraCalibration
from swimcal.toml import TomlTable, key_error, load_toml
from tracking.camera import camera_matrix, to_rays, true_over_apparent

# The board.
SquareSize = Annotated[float, Field(ge=1e-3, le=2.0)]
MARKER_SHARE = 0.7
"""Side of a marker over that of its square, where nothing else is given."""

# Corners.
CLEAR_SHARE = 0.7
"""Half width of the window in which a corner is refined, over its distance to the nearest edge that is not its own:
that of a marker, or of the next square. Windows that reach such an edge move corners by whole pixels."""
WINDOW_PX = (3, 12)
"""Bounds of that half width: less holds too few pixels, more gains nothing and bends with the lens."""

SEARCHED_PX = 1600
"""Longest side of the picture that a chessboard is searched in: larger ones take ten seconds, and are full of false
boards. The corners are then refined in the whole picture."""

# The scale.
HIGHEST_M = 100.0
"""Largest height of a camera above a pool."""

# The drawn board.
SUFFIXES = (".pdf", ".svg", ".png")
PNG_DPI = 300
MM = 1000.0
MM_PER_INCH = 25.4
RULER_MM = 100.0


class BoardSpec(TomlTable):
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


def load_board(path: Path) -> BoardSpec:
    """Read a TOML file with one table ``[board]`` of the keys of `BoardSpec`.

    Raises:
        InputError: every fault of the file at once.
    """
    return load_toml(path, _BoardFile).board


class _BoardFile(TomlTable):
    board: BoardSpec


def _dictionary(name: str) -> cv2.aruco.Dictionary:
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))


class Picture(NamedTuple):
    """A picture (h, w) uint8 and how a message names it: the file, or its number from 1."""

    name: str
    gray: np.ndarray


def read_picture(path: Path) -> np.ndarray:
    """Read a picture file as (h, w) uint8, turned upright where the file gives the rotation.

    Raises:
        InputError: the file is not there, or not a picture.
    """
    what, found = "not a picture that can be read", "something else or a damaged file"
    try:
        content = np.frombuffer(path.read_bytes(), np.uint8)
        if len(content) and (gray := cv2.imdecode(content, cv2.IMREAD_GRAYSCALE)) is not None:
            return gray
    except OSError as error:
        what, found = "the picture cannot be read", str(error.strerror or error)
    raise InputError([Fault(str(path), "", what, found, "a picture (PNG, JPEG, TIFF …)")])


def each_picture(pictures: Iterable[Path | np.ndarray]) -> Iterator[Picture]:
    """Yield one picture at a time, so that hundreds need the memory of one.

    Raises:
        InputError: at the end, with every file that could not be read and every picture of another size.
    """
    faults = FaultCollector()
    first: Picture | None = None
    for number, source in enumerate(pictures, start=1):
        name = source.name if isinstance(source, Path) else f"picture {number}"
        with faults.nested():
            image = read_picture(source) if isinstance(source, Path) else source
            picture = Picture(name, image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_RGB2GRAY))
            first = first or picture
            if picture.gray.shape == first.gray.shape:
                yield picture
            else:
                faults.file = str(source) if isinstance(source, Path) else name
                (height, width), (first_height, first_width) = picture.gray.shape, first.gray.shape
                found, expected = f"{width} x {height}", f"{first_width} x {first_height}, like {first.name}"
                step = "A lens is calibrated for one camera, one mode and one zoom: leave the others out."
                faults.add("", "a picture of another size", found=found, expected=expected, next_step=step)
    faults.raise_if_any()


def video_pictures(path: Path, count: int = 40) -> Iterator[np.ndarray]:
    """Yield (h, w) uint8 frames of a video of the board, evenly spread over it, for `calibrate_lens`.

    Move the board slowly, and hold it still now and then: equal frames count as often as they are there, and make the
    stated uncertainty too small.

    Args:
        path: the video.
        count: number of frames, at most.

    Raises:
        InputError: the video cannot be read.
    """
    from tracking.video import Video

    with Video(path) as video:
        for number in np.unique(np.linspace(0, video.info.frames - 1, count).round().astype(int)).tolist():
            yield np.ascontiguousarray(video.frame(number).luma)


class Corners(NamedTuple):
    """Corners of one board in one picture."""

    place_m: np.ndarray  # (k, 3) on the board, board frame, z = 0
    image_px: np.ndarray  # (k, 2) in the picture, the centre of the top left pixel at (0, 0)


_NONE = Corners(np.zeros((0, 3)), np.zeros((0, 2)))


def find_corners(picture: np.ndarray, board: BoardSpec) -> Corners:
    """Find the visible corners of the board in a picture; none (k = 0) where there is no board.

    A chessboard is found whole or not at all; which of its ends comes first is arbitrary where both look the same.
    Chessboards: Duda and Frese, "Accurate Detection and Localization of Checkerboard Corners", BMVC 2018.

    Args:
        picture: (h, w) or (h, w, 3) uint8.
        board: the board.
    """
    gray = np.ascontiguousarray(picture) if picture.ndim == 2 else cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY)
    return _charuco_corners(gray, board) if board.kind == "charuco" else _chessboard_corners(gray, board)


def _charuco_corners(gray: np.ndarray, board: BoardSpec) -> Corners:
    found, ids, _, _ = cv2.aruco.CharucoDetector(board.charuco).detectBoard(gray)
    if found is None or len(found) == 0:
        return _NONE
    clear = (board.square_m - board.marker_side_m) / 2 / board.square_m
    return Corners(board.corner_places_m[np.ravel(ids)], _refine(gray, found.reshape(-1, 2), clear))


def _chessboard_corners(gray: np.ndarray, board: BoardSpec) -> Corners:
    size = (board.columns - 1, board.rows - 1)
    shrink = -(-max(gray.shape) // SEARCHED_PX)
    small = cv2.resize(gray, None, fx=1 / shrink, fy=1 / shrink, interpolation=cv2.INTER_AREA)
    seen, found = cv2.findChessboardCornersSB(small, size, flags=cv2.CALIB_CB_NORMALIZE_IMAGE)
    if not seen:
        return _NONE
    image_px = shrink * (found.reshape(-1, 2) + 0.5) - 0.5
    return Corners(board.corner_places_m, _refine(gray, image_px, clear=0.5))


def _refine(gray: np.ndarray, image_px: np.ndarray, clear: float) -> np.ndarray:
    """Move the corners (k, 2) to the saddle points of the picture.

    Detectors place them by homographies or along straight lines, and miss them where the lens bends.

    Args:
        gray: (h, w) picture.
        image_px: (k, 2) corners, px.
        clear: distance to the nearest edge that is not the corner's own, in squares.
    """
    distance = np.linalg.norm(image_px[:, None] - image_px[None], axis=2) + np.diag(np.full(len(image_px), np.inf))
    square_px = distance.min() if len(image_px) > 1 else 0.0
    window = int(np.clip(CLEAR_SHARE * clear * square_px, *WINDOW_PX))
    stop = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 50, 1e-3)
    start = np.array(image_px, dtype=np.float32).reshape(-1, 1, 2)
    return cv2.cornerSubPix(gray, start, (window, window), (-1, -1), stop).reshape(-1, 2).astype(float)


@dataclass(frozen=True)
class BoardScale:
    """Scale, height and tilt of the camera, as a level board in the picture shows them."""

    # Scale on the surface of the water, in undistorted square pixels (of focal length fx where the lens is calibrated),
    # as `to_pool` has it.
    metres_per_px: float
    # Its standard deviation follows from the scatter of the corners about a level board; without a lens it holds
    # distortion and tilt too, as far as the board shows them.
    sd_metres_per_px: float
    camera_height_m: float | None  # height of the lens above the water; None without a calibrated lens
    # Angle between the camera's axis and the board's normal; None without a calibrated lens. A tilt of 2 degrees
    # changes the scale by 2 % from the middle to the edge of a picture 60 degrees wide.
    tilt_deg: float | None
    rms_px: float  # distance of the corners from a level board


def scale_from_board(
    picture: Path | np.ndarray, board: BoardSpec, lens: CameraCalibration | None = None, board_height_m: float = 0.0
) -> BoardScale:
    """Return the scale at the water's surface, and the camera's height above it where the lens is calibrated.

    Args:
        picture: file or (h, w) or (h, w, 3) uint8.
        board: the board as printed and measured, lying level.
        lens: calibration of the camera; without it the picture is taken to be undistorted.
        board_height_m: height of the board's face above the water; negative under water (refraction is undone).

    Raises:
        InputError: the picture cannot be read.
        NotEnoughData: no board is found, or it lies off the surface and the lens is not calibrated.
    """
    seen = find_corners(read_picture(picture) if isinstance(picture, Path) else picture, board)
    return scale_from_corners(seen, lens, board_height_m)


def scale_from_corners(seen: Corners, lens: CameraCalibration | None = None, board_height_m: float = 0.0) -> BoardScale:
    """Return the scale for corners that are found already; see `scale_from_board`.

    Args:
        seen: the k corners of the board.
        lens: calibration of the camera; without it the picture is taken to be undistorted.
        board_height_m: height of the board's face above the water; negative under water.

    Raises:
        NotEnoughData: fewer than four corners, or a board off the surface and no lens.
    """
    if lens is None and board_height_m != 0.0:
        raise NotEnoughData(
            f"the board lies {board_height_m:g} m above the water, so its scale is not the water's; calibrate "
            "the lens, or lay the board at the surface"
        )
    if len(seen.image_px) < 4:
        raise NotEnoughData(
            f"{len(seen.image_px)} corners of the board were found; at least 4 are needed. Are its kind and "
            "its numbers of squares right, and is it whole in the picture?"
        )
    if lens is None:
        fit = _similarity(seen.image_px, seen.place_m[:, :2])
        return BoardScale(fit.scale, fit.sd_scale, None, None, fit.rms / fit.scale)
    return _with_lens(seen, lens, board_height_m)


def _with_lens(seen: Corners, lens: CameraCalibration, board_height_m: float) -> BoardScale:
    ray, place = to_rays(seen.image_px, lens), seen.place_m[:, :2]

    def fit_at(camera_height_m: float) -> _Similarity:
        factor = true_over_apparent(ray, np.array(board_height_m), camera_height_m)[:, None]
        return _similarity(camera_height_m * factor * ray, place)

    lowest = max(board_height_m, 0.0) + 1e-6
    if not fit_at(lowest).scale > 1 > fit_at(HIGHEST_M).scale:
        raise NotEnoughData(
            f"no height of the camera between {lowest:.2g} and {HIGHEST_M:g} m gives the board its size; check "
            "square_m, the height of the board, and that the lens was calibrated for this picture"
        )
    height = float(brentq(lambda h: fit_at(h).scale - 1.0, lowest, HIGHEST_M, xtol=1e-9))
    fit = fit_at(height)
    metres_per_px = height / lens.fx_px
    return BoardScale(
        metres_per_px=metres_per_px,
        sd_metres_per_px=metres_per_px * fit.sd_scale,
        camera_height_m=height,
        tilt_deg=_tilt_deg(seen, lens),
        rms_px=fit.rms / metres_per_px,
    )


def _tilt_deg(seen: Corners, lens: CameraCalibration) -> float:
    """Return the angle between the camera's axis and the normal of the board; refraction is neglected."""
    _, rotation, _ = cv2.solvePnP(
        seen.place_m, seen.image_px, camera_matrix(lens), np.array(lens.distortion), flags=cv2.SOLVEPNP_IPPE
    )
    return float(np.degrees(np.arccos(min(1.0, abs(cv2.Rodrigues(rotation)[0][2, 2])))))


class _Similarity(NamedTuple):
    """Best similarity transform: scale (target over source), its standard deviation, RMS distance in target units."""

    scale: float
    sd_scale: float
    rms: float


def _similarity(source: np.ndarray, target: np.ndarray) -> _Similarity:
    """Fit the move, turn and scale that take (k, 2) to (k, 2) best (Umeyama, IEEE PAMI 13, 1991, in the plane)."""
    a = (source - source.mean(axis=0)) @ [1, 1j]
    b = (target - target.mean(axis=0)) @ [1, 1j]
    size = (np.abs(a) ** 2).sum()
    turn = (np.conj(a) * b).sum() / size
    squares = (np.abs(b - turn * a) ** 2).sum()
    variance = squares / max(2 * len(a) - 4, 1)  # per axis
    return _Similarity(float(np.abs(turn)), float(np.sqrt(variance / size)), float(np.sqrt(squares / len(a))))


# The board, drawn.


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
    # Without the date, so that the same board gives the same file.
    undated = {".pdf": {"CreationDate": None}, ".svg": {"Date": None}}.get(path.suffix.lower())
    with writing_whole(path) as part, rc_context({"svg.hashsalt": "board"}):
        figure.savefig(part, dpi=PNG_DPI, format=path.suffix[1:].lower(), metadata=undated)


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
