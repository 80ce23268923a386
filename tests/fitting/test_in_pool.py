"""What every measurement begins with."""

import numpy as np
import pytest

from fitting.pool import in_pool
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.errors import NotEnoughData
from swimcal.robot import load_robot
from swimcal.session_file import CameraSpec
from swimcal.tracks import as_tracks

ROBOT = load_robot()


def test_nose_and_neck_exchanged_in_tracked_videos_are_called_that() -> None:
    place_px = 900.0 * ROBOT.marker_positions_m(FISHSIM_MARKERS)[:, :2] + 500.0
    beat = np.sin(np.arange(120) / 9)[:, None] * np.linspace(0.0, 60.0, len(FISHSIM_MARKERS))  # (n, m) px
    position_px = place_px + np.stack([np.zeros_like(beat), beat], axis=2)
    time_s, sure = np.arange(120) / 60, np.ones(beat.shape)
    camera = CameraSpec(60.0, ROBOT.scale_length_m)
    in_pool(as_tracks(FISHSIM_MARKERS, time_s, position_px, sure), camera, ROBOT, "trial f0_60")
    order = [1, 0, *range(2, len(FISHSIM_MARKERS))]
    exchanged = as_tracks(FISHSIM_MARKERS, time_s, position_px[:, order], sure)
    with pytest.raises(
        NotEnoughData, match="trial f0_60: nose and neck are exchanged; found the markers of the tail on"
    ):
        in_pool(exchanged, camera, ROBOT, "trial f0_60")
