"""The release is found without being reported, and a clamp that yields is reported from tracking errors."""

from __future__ import annotations

import numpy as np
import pytest

from fitting.free_decay import find_release, measure_decay_trial
from swimcal.errors import NotEnoughData
from tests.fitting.free_decay.decays import CAMERA, MARKERS, ROBOT, Truth, filmed, frame_times, swings


def lateral_of(truth: Truth) -> np.ndarray:
    return swings([truth])[0][:, 3:, 1]


@pytest.mark.parametrize("release_s", [0.26, 0.507, 0.9])
@pytest.mark.parametrize("damping", [0.02, 0.004])
def test_the_first_frame_comes_within_two_of_the_release(release_s: float, damping: float) -> None:
    truth = Truth(damping_n_m_s=damping, release_s=release_s, seconds=3.0)
    lateral = lateral_of(truth)

    release = find_release(frame_times(truth), lateral, np.ones_like(lateral))

    assert 0.0 < frame_times(truth)[release.first] - release_s < 2.01 / truth.fps
    assert release.flags == ()
    lateral[:10] *= np.linspace(0.0, 1.0, 10)[:, None]  # bent slowly before
    assert find_release(frame_times(truth), lateral, np.ones_like(lateral)).first == release.first


def test_a_recording_that_starts_in_mid_swing_says_so() -> None:
    truth = Truth(damping_n_m_s=0.004, release_s=0.0, seconds=2.0)
    lateral = lateral_of(truth)[3:]

    release = find_release(frame_times(truth)[3:], lateral, np.ones_like(lateral))

    assert release.first == 0
    assert [flag.kind for flag in release.flags] == ["no_release"]


def test_a_tail_that_is_moved_again_is_cut_off_and_flagged() -> None:
    truth = Truth(seconds=2.2)
    lateral = lateral_of(truth)
    at = round(1.3 * truth.fps)
    lateral[at:] += np.linspace(0.0, 0.6, len(lateral) - at)[:, None] * np.abs(lateral[0])

    release = find_release(frame_times(truth), lateral, np.ones_like(lateral))

    assert release.last < at + 12
    assert "moved_again" in [flag.kind for flag in release.flags]


def test_a_tail_at_rest_has_no_release() -> None:
    with pytest.raises(NotEnoughData, match="nothing was released"):
        find_release(np.arange(60) / 60, np.zeros((60, 6)), np.ones((60, 6)), "decay_1")


DAMPED, LIGHT = Truth(), Truth(0.45, 0.006, seconds=2.2)


def yielding(place_m: np.ndarray, degrees_per_m: float) -> np.ndarray:
    """(n, m, 2) places of a robot that turns about its neck as its fin swings."""
    angle = np.radians(degrees_per_m) * (place_m[:, -1, 1] - place_m[-1, -1, 1])
    cos, sin, neck = np.cos(angle), np.sin(angle), place_m[:, [MARKERS.index("neck")]]
    turn = np.stack([np.stack([cos, sin], -1), np.stack([-sin, cos], -1)], axis=-2)  # (n, 2, 2), of rows
    return neck + (place_m - neck) @ turn


def flagged(place_m: np.ndarray, truth: Truth, seed: int) -> list[str]:
    flags = measure_decay_trial("decay", filmed(place_m, truth, seed), CAMERA, ROBOT).flags
    return [flag.message for flag in flags if flag.kind == "head_moves"]


@pytest.mark.parametrize("truth", [DAMPED, LIGHT])
def test_a_clamp_that_yields_is_reported_from_tracking_errors(truth: Truth) -> None:
    place = swings([truth])[0]

    for seed in range(6):
        assert flagged(place, truth, seed) == []
        (message,) = flagged(yielding(place, 20.0), truth, seed)
        assert "% of the fin's swing are the head's: the clamp yields" in message
