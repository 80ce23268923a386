import pytest
from pydantic import ValidationError

from benchmarks.video import BENCHMARK_CLIPS, ClipPlan, Optics
from benchmarks.video.occlusion import Occlusion


def test_every_fault_of_a_plan_is_named_at_once() -> None:
    pole = Occlusion(marker="fin", first=5, frames=10)
    with pytest.raises(ValidationError) as error:
        ClipPlan(frames=10, markers=("nose", "nsoe"), occlusions=(pole,), skipped=(0,), optics=Optics(exposure_s=0.5))

    for part in (
        "markers: found 'nsoe', expected markers of fish_057",
        "occlusions: found marker 'fin', expected one of nose, nsoe",
        "occlusions: found frame 14, expected frames 0 to 9",
        "skipped: found (0,), expected numbers from 1 to 9",
        "optics.exposure_s: found 0.5 s, expected at most 0.0166667 s",
    ):
        assert part in str(error.value)


def test_the_benchmark_covers_what_was_asked_for() -> None:
    assert BENCHMARK_CLIPS["motion_3x"].swim.pace == 3
    assert BENCHMARK_CLIPS["occlusion_15"].occlusions[0].frames == 15
    four_k = BENCHMARK_CLIPS["speed_4k"]
    assert (four_k.optics.width_px, four_k.optics.height_px, four_k.frames, len(four_k.markers)) == (
        3840,
        2160,
        600,
        11,
    )
    assert len({plan.seed for plan in BENCHMARK_CLIPS.values()}) == len(BENCHMARK_CLIPS)
