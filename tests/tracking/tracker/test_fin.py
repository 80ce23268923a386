"""Fins that beat fast, on looks that the tracker was not made with: bright, dark and coloured dots of several sizes."""

from dataclasses import replace
from pathlib import Path

import pytest

from swimcal.create_session import FISHSIM_MARKERS
from swimcal.robot import load_robot
from tests.cases import later
from tests.tracking.tracker.fin import FinClip, FinScore
from tracking.follow_video import TrackerName, follow_video
from tracking.judgement import trusted
from tracking.video import Video

DARK = FinClip(size=(800, 600), scale=880.0, fastest=36.0)
LOOKS = {
    "dark on orange": DARK,
    "white on black": replace(DARK, diameter=13.0, dot=(240, 240, 240), body=(20, 20, 22), water=(110, 140, 150)),
    "red on white": replace(DARK, diameter=21.0, dot=(190, 30, 40), body=(225, 225, 215), water=(90, 120, 110)),
}


def tracked(clip: FinClip, folder: Path, method: TrackerName = "hybrid") -> FinScore:
    with Video(clip.video(folder / "fin.mp4")) as video:
        return FinScore.of(clip, trusted(follow_video(video, clip.boxes(), FISHSIM_MARKERS, method), load_robot()))


@pytest.mark.parametrize("look", ["dark on orange", *later("red on white", "white on black")])
@pytest.mark.parametrize("chain", [False, *later(True)])
@pytest.mark.parametrize(("hz", "fastest"), [(3.0, 36.0), *later((3.0, 45.0), (2.0, 38.0), (1.0, 20.0), (0.4, 6.0))])
def test_a_fin_that_beats_fast_is_followed_as_well_as_the_body(
    look: str, hz: float, fastest: float, chain: bool, tmp_path: Path
) -> None:
    """A tail that swings sideways draws its markers apart by a third; the fin's dot is smeared by its own width.

    The red dots are so large that two of them overlap by a sixth.
    """
    frames = 30 if hz == 3.0 and fastest == 36.0 else 150
    score = tracked(replace(LOOKS[look], hz=hz, fastest=fastest, chain=chain, frames=frames), tmp_path, "spots")
    assert score.lost <= 0.003
    assert score.rms_px < 0.15
    assert score.rms_blurred_px < 0.25
    assert score.unflagged == 0


@pytest.mark.long
@pytest.mark.parametrize(("exposure", "fastest"), [(0.05, 36.0), *later((0.9, 22.0))])
def test_the_shutter_is_learned_from_the_streaks(exposure: float, fastest: float, tmp_path: Path) -> None:
    score = tracked(replace(DARK, exposure=exposure, fastest=fastest, frames=16), tmp_path)
    assert score.lost == 0
    assert max(score.rms_px, score.rms_blurred_px) < 0.15
