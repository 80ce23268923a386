"""The release is found without being told."""

from __future__ import annotations

import numpy as np
import pytest

from fitting.free_decay.release import find_release
from session import NotEnoughData
from tests.fitting.free_decay.decays import Truth, frame_times, swings


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
