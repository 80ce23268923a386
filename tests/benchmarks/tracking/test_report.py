"""The trackers are compared on a short clip: the benchmark's tables hold what each does."""

from pathlib import Path

import pytest

from benchmarks.tracking import accuracy
from benchmarks.tracking.accuracy import clips_of, measure_accuracy, score_clip
from benchmarks.tracking.report import measure_tracking
from benchmarks.video.camera import Optics
from benchmarks.video.plan import ClipPlan, Swim
from benchmarks.video.render import Encoding
from swimcal.errors import InputError

SHORT = ClipPlan(
    frames=12, swim=Swim(drift_m_s=(0.03, 0.0)), optics=Optics(width_px=640, height_px=360, px_per_m=600.0)
)
LOSSLESS = Encoding("ffv1")


def quiet(_said: str, _share: float | None) -> None:
    """Tells nobody."""


@pytest.mark.long
def test_every_tracker_is_measured_and_compared_to_the_others(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    clips = {"short": SHORT}
    monkeypatch.setattr(accuracy, "BENCHMARK_CLIPS", clips)
    monkeypatch.setattr("benchmarks.tracking.report.BENCHMARK_CLIPS", clips)
    monkeypatch.setattr(accuracy, "ENCODINGS", (LOSSLESS,))
    monkeypatch.setattr(accuracy, "COMPARED", LOSSLESS)
    scores = measure_tracking(tmp_path, "accuracy", ("short",), quiet)
    found = {clip.method: score for clip, score in measure_accuracy(clips_of(), tmp_path, quiet).items()}
    assert found["hybrid"].rms_px < 0.05
    assert found["hybrid"].rms_px < found["csrt"].rms_px
    assert found["hybrid"].lost == 0.0
    (table,) = scores.tables
    assert table.rows[0][:3] == ("short", f"{found['hybrid'].rms_px:.3f}", "0.00%")
    assert table.columns == ("clip", "ffv1", "lost", "lost, no CSRT", "CSRT: rms, bias, lost")


def test_a_tracker_that_refuses_its_boxes_loses_everything(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise InputError([])

    clip = accuracy.Clip("short", LOSSLESS)
    monkeypatch.setattr(accuracy, "BENCHMARK_CLIPS", {"short": SHORT})
    accuracy.render_clips([clip], tmp_path, quiet)
    monkeypatch.setattr(accuracy, "follow_video", refuse)
    assert score_clip(clip, tmp_path).lost == 1.0


def test_a_clip_that_there_is_not_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such clip"):
        measure_tracking(tmp_path, "accuracy", ("fast",), quiet)
