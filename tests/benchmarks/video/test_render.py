import json
from pathlib import Path

import numpy as np
import pytest

from benchmarks.video.camera import Optics
from benchmarks.video.plan import ClipPlan, Swim
from benchmarks.video.render import Encoding, render_encodings
from benchmarks.video.truth import boxes_file, load_truth, truth_file
from benchmarks.video.writer import Codec
from tests.benchmarks.video.test_writer import decoded

SMALL = ClipPlan(
    frames=5,
    skipped=(2,),
    markers=("nose", "neck", "tail_2"),
    swim=Swim(frequency_hz=1.0),
    optics=Optics(width_px=320, height_px=240, px_per_m=420.0),
)


@pytest.mark.parametrize(("codec", "crf"), [("h264", 18), ("hevc", 28), ("ffv1", 0)])
def test_a_clip_comes_with_its_truth_and_start_boxes(codec: Codec, crf: int, tmp_path: Path) -> None:
    video = tmp_path / "small.mp4"
    done: list[int] = []
    truth = render_encodings(SMALL, {video: Encoding(codec, crf)}, done.append)

    time_s, pictures = decoded(video, "gray")
    np.testing.assert_allclose(time_s, truth.time_s, atol=1e-5)
    stored = load_truth(truth_file(video))
    assert (stored.markers, done) == (truth.markers, [1, 2, 3, 4, 5])
    for name in ("time_s", "position_px", "shown_px", "visible_share", "diameter_px"):
        np.testing.assert_array_equal(getattr(stored, name), getattr(truth, name))
    boxes = json.loads(boxes_file(video).read_text())
    assert boxes["frame"] == 0
    for (x, y, width, height), centre in zip(boxes["boxes"].values(), truth.shown_px[0], strict=True):
        assert (x + (width - 1) / 2, y + (height - 1) / 2) == pytest.approx(centre, abs=0.51)
    for x, y in truth.shown_px[-1]:
        assert pictures[-1][round(y), round(x)] > 200
