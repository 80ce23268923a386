"""Start boxes as a file: what is written is read back; every fault is named, all of them at once."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from swimcal.errors import InputError
from tracking.boxes import Box, StartBoxes, load_boxes, save_boxes
from tracking.video import VideoInfo

MARKERS = ("nose", "neck", "tail_1")
GOOD = {"nose": [100, 50, 21, 21], "neck": [140.5, 50, 20, 20], "tail_1": [200, 52, 18, 18]}
sides = st.floats(3, 80)
places = st.floats(0, 3000)


def written(folder: Path, boxes: object, frame: object = 0, **more: object) -> Path:
    path = folder / "f1.boxes.json"
    path.write_text(json.dumps({"frame": frame, "boxes": boxes, **more}))
    return path


def video(width_px: int = 640, height_px: int = 480, frames: int = 100) -> VideoInfo:
    return VideoInfo(Path("f1.mp4"), width_px, height_px, "h264", np.arange(frames) / 60)


def refused(path: Path, video: VideoInfo | None = None) -> str:
    with pytest.raises(InputError) as caught:
        load_boxes(path, MARKERS, video)
    return str(caught.value)


@given(st.lists(st.tuples(places, places, sides, sides), min_size=3, max_size=3), st.integers(0, 10**6))
def test_what_is_saved_is_loaded(tmp_path_factory: pytest.TempPathFactory, values: list, frame: int) -> None:
    spread = [Box(x + 5000 * k, *rest) for k, (x, *rest) in enumerate(values)]  # none on the spot of another
    boxes = StartBoxes(frame, dict(zip(MARKERS, spread, strict=True)))
    path = tmp_path_factory.getbasetemp() / "saved.boxes.json"

    save_boxes(path, boxes)
    loaded = load_boxes(path, MARKERS)

    assert loaded.frame == frame
    assert loaded.markers == MARKERS
    assert loaded.centres_px(MARKERS) == pytest.approx(boxes.centres_px(MARKERS), abs=0.02)


def test_the_centre_is_that_of_the_covered_pixels() -> None:
    picture = np.zeros((40, 60))
    x, y, width, height = 10, 5, 20, 11
    picture[y : y + height, x : x + width] = 1
    rows, columns = np.nonzero(picture)

    assert Box(x, y, width, height).centre_px == (columns.mean(), rows.mean())
    assert Box.around((12.3, 4.5), 9.0).centre_px == pytest.approx((12.3, 4.5))


@pytest.mark.parametrize(
    ("boxes", "message"),
    [
        ({"nose": GOOD["nose"], "neck": GOOD["neck"]}, "boxes.tail_1: missing"),
        (GOOD | {"tail1": [1, 1, 9, 9]}, "boxes.tail1: not a marker of the session"),
        (GOOD | {"tail1": [1, 1, 9, 9]}, "Did you mean 'tail_1'?"),
        (GOOD | {"neck": [1, 2, 3]}, "boxes.neck: not a box; found [1, 2, 3]; expected four numbers"),
        (GOOD | {"neck": [1, 2, True, 4]}, "boxes.neck: not a box"),
        (GOOD | {"neck": [1, float("nan"), 9, 9]}, "boxes.neck: not a box"),
        (GOOD | {"neck": {"x": 1}}, "boxes.neck: not a box"),
        (GOOD | {"neck": [1, 2, -9, 9]}, "boxes.neck: too small; found -9 x 9 px"),
        (GOOD | {"neck": [630, 2, 20, 20]}, "boxes.neck: outside the picture; found x 630 to 649"),
        (GOOD | {"neck": [101, 51, 20, 20]}, "boxes.nose: on the same spot as neck"),
        ([1, 2], "boxes: not an object; found [1, 2]"),
    ],
)
def test_a_fault_names_its_place_and_what_is_expected(tmp_path: Path, boxes: object, message: str) -> None:
    error = refused(written(tmp_path, boxes), video())

    assert message in error.replace("boxes.neck: on the same spot as nose", "boxes.nose: on the same spot as neck")
    assert "f1.boxes.json" in error


def test_all_faults_come_at_once(tmp_path: Path) -> None:
    error = refused(written(tmp_path, {"nose": [0, 0, 0, 0], "nosee": 3}, -4, trial="f1"), video())

    for part in ("unknown key", "not the number of a frame", "nosee", "too small", "boxes.neck: missing"):
        assert part in error
    assert "6 faults" in error


def test_a_frame_beyond_the_video_is_reported_with_the_faults_of_the_boxes(tmp_path: Path) -> None:
    error = refused(written(tmp_path, GOOD | {"neck": [1, 2, 3]}, 100), video(frames=100))

    assert "frame: no such frame in the video; found 100; expected 0 to 99" in error
    assert "boxes.neck: not a box" in error


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "cannot be read; found Expecting property name"),
        ("[1]", "not an object; found [1]"),
        ('{"frame": 0, "boxes": {"nose": [1, 1, 9, 9], "nose": [2, 2, 9, 9]}}', "found 'nose' is given twice"),
    ],
)
def test_what_is_no_json_object_is_reported(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "f1.boxes.json"
    path.write_text(text)

    assert message in refused(path)


def test_a_missing_file_says_how_to_make_it(tmp_path: Path) -> None:
    assert "calib track SESSION --click" in refused(tmp_path / "none.json")
