"""What a refit found is written with its interval, and says where it ends at a bound."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.diagnosis_file import _parameters
from diagnosis.refit import Refit
from diagnosis.result import parameters_of
from swimmer.effects import catalogue


@pytest.mark.parametrize(("value", "at_bound"), [(-0.499, True), (-0.3, False), (0.0, False), (4.99, True)])
def test_a_parameter_is_at_its_bound_where_it_is_and_not_where_its_interval_reaches_it(
    value: float, at_bound: bool
) -> None:
    damping = catalogue()["joint_damping"]  # -0.5 to 5
    found = Refit((damping,), np.ones(5), np.array([value]), np.zeros(3), np.eye(6), np.ones(6))
    (told,) = parameters_of(_parameters(found), "joint_damping").values()
    assert (told.value, told.at_bound) == (value, at_bound)
    assert -0.5 <= told.ci95[0] <= told.ci95[1] <= 5.0


def test_the_plain_twin_is_no_bound() -> None:
    slack = catalogue()["tendon_slack"]  # of one sign: from 0 on
    found = Refit((slack,), np.ones(5), np.array([0.0]), np.zeros(3), np.eye(6), np.ones(6))
    (told,) = parameters_of(_parameters(found), "tendon_slack").values()
    assert not told.at_bound
