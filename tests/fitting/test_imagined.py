"""A trial that is only imagined is right: no check of tracks may refuse it."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from fitting.affected_trials import imagined
from swimcal.twin import Twin
from tests.cases import later
from tests.fitting.exact_swims import ROBOT

WIDE = np.array([8.0, 0.9, 3.5, 5.0, 8.4])  # its tail swings wide, which few markers cannot tell from a fault


@pytest.mark.parametrize("marker", ["tail_5", *later("tail_4", "caudal_fin")])
@pytest.mark.parametrize("hz", [1.45, *later(1.3)])
def test_a_wide_swing_of_few_markers_counts_in_every_frame(marker: str, hz: float) -> None:
    markers = ("nose", "neck", marker)
    like = SimpleNamespace(markers=markers, time_s=np.arange(0.0, 3.0, 0.02), metres_per_px=1 / 2120, warmup_s=1.0)
    trial = imagined(Twin(ROBOT, markers, workers=1), like, WIDE, hz, 0.1, 6.0)  # type: ignore[arg-type]

    assert (trial.weight > 0).all()
