"""What is supposed rightly is borne out, and what is not there beside it is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis import Settings, Supposition, discrepancy_for, suppose
from session import FISHSIM_MARKERS, NotEnoughData
from swimmer import Twin
from swimmer.effects import catalogue
from tests.diagnosis.grounds import ARM, CAMERA, ROBOT, shorter, trials


def supposed(*names: str) -> Supposition:
    swims = [*trials(), replace(trials()[0], name="held").with_role("holdout")]
    effects = [catalogue()[name] for name in names]
    discrepancy = discrepancy_for(FISHSIM_MARKERS, ROBOT)
    return suppose(swims, Twin(shorter(), FISHSIM_MARKERS, workers=1), CAMERA, effects, discrepancy, Settings("quick"))


@pytest.mark.long
def test_the_arm_is_borne_out_and_a_bend_beside_it_is_not() -> None:
    found = supposed("crank_arm_error", "bend_offset")

    assert found.log_bayes_factor > 5
    assert found.of_each["crank_arm_error"] > 5
    assert found.of_each["bend_offset"] < 1
    assert found.refit.by_effect["crank_arm_error"] == pytest.approx(ARM, abs=0.006)
    plain, with_effects = ([each.placed_error_m for each in swims] for swims in found.fitted)
    assert np.mean(with_effects) < np.mean(plain)
    assert found.gap is not None
    assert found.gap.shrinkage.with_effects < found.gap.shrinkage.plain


def test_without_a_fitted_swim_nothing_is_said() -> None:
    with pytest.raises(NotEnoughData, match='no swim of role "fit"'):
        suppose([], Twin(ROBOT, FISHSIM_MARKERS, workers=1), CAMERA, [], np.eye(1))
