"""A trial that is only imagined is right: no check of tracks may refuse it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fitting.affected_trials import imagined
from swimcal.mjcf import FluidCoefficients
from swimcal.twin import Twin
from tests.cases import later
from tests.fitting.exact_swims import ROBOT, measured_swim

WIDE = FluidCoefficients(8.0, 0.9, 3.5, 5.0, 8.4)  # its tail swings wide, which few markers cannot tell from a fault


@pytest.mark.parametrize("marker", ["tail_5", *later("tail_4", "caudal_fin")])
@pytest.mark.parametrize("hz", [1.45, *later(1.0, 1.3)])
def test_a_wide_swing_of_few_markers_counts_in_every_frame(marker: str, hz: float) -> None:
    markers = ("nose", "neck", marker)
    swim = measured_swim("like", 1.0, np.zeros((180, 9, 2)) + np.arange(9)[None, :, None])
    like = replace(swim, tracks=swim.tracks.isel(keypoint=[0, 1, 3]).assign_coords(keypoint=list(markers)))
    trial = imagined(Twin(ROBOT, markers, workers=1), like, np.array(WIDE), hz, 0.1, 6.0)

    assert (trial.weight > 0).all()
