"""Pictures of a board: files, or frames of a video."""

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np

from session import FaultCollector, InputError
from session.errors import Fault


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
