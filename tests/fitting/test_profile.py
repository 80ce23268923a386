"""A profile bounds the true one from above as well as the search knows it: no restart of the fit lies below it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fitting import CoefficientFit
from fitting.coefficients import refine_coefficients
from fitting.objective import Swims
from fitting.profile import CoefficientProfiles, profile_objective
from fitting.search_space import parameters
from swimmer import FluidCoefficients
from synthetic import PLAUSIBLE_COEFFICIENTS
from tests.fitting.exact_swims import PHASES, exact_swims, exact_twin


@pytest.fixture(scope="module")
def swims() -> Swims:
    return Swims(exact_twin(), exact_swims(hz=(1.0,), seconds=2.0))


@pytest.fixture(scope="module")
def fit(swims: Swims) -> CoefficientFit:
    """A poor best, and restarts that know better: far away in some coefficient and nearer to the tracks there."""
    roots = np.sqrt([(0.4, 7.0, 1.0, 4.0, 3.0), (0.4, 2.2, 6.0, 3.0, 9.0), tuple(PLAUSIBLE_COEFFICIENTS)])
    points = [np.append(each, PHASES[0]) for each in roots]
    found = refine_coefficients(swims, points, iterations=1, central=False)
    restarts = tuple(replace(restart, swims_forward=True) for restart in found.restarts[::-1])
    return replace(
        found,
        coefficients=FluidCoefficients(*map(float, restarts[0].coefficients)),
        phase_rad=restarts[0].phase_rad,
        mean_distance_m=float(swims.mean_distance(parameters(restarts[0].point)[:, None])[0]),
        restarts=restarts,
    )


def test_no_profile_lies_above_a_restart_at_its_own_value(
    swims: Swims, fit: CoefficientFit, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("fitting.profile.POINTS", 3)
    profiles = profile_objective(swims, fit)
    assert profiles.restart_m.min() < 0.8 * profiles.best_m
    points = [restart.point for restart in fit.restarts if restart.swims_forward]
    distances = swims.mean_distance(parameters(np.column_stack(points)))
    for i in range(5):
        value, height = profiles.curve(i, fit.coefficients[i])
        assert (np.diff(value) > 0).all()
        for point, distance in zip(points, distances, strict=True):
            assert np.interp(point[i], np.sqrt(value), height) <= distance * (1 + 1e-9)


def test_a_curve_takes_in_the_restarts_below_it() -> None:
    """Straight from 0.04 m at 0 to the fit's 0.03 m at 1 and to 0.06 m at 4: 0.035 m at 0.25, 0.045 m at 2.25."""
    value = np.tile([0.0, 4.0], (5, 1))
    restart = np.tile([2.25, 2.25, 0.25, 1.0], (5, 1)).T
    profiles = CoefficientProfiles(
        value, value, np.tile([0.04, 0.06], (5, 1)), 0.03, restart, np.array([0.044, 0.02, 0.036, 0.031])
    )
    found, height = profiles.curve(2, 1.0)

    np.testing.assert_allclose(found, [0.0, 1.0, 2.25, 4.0])
    np.testing.assert_allclose(height, [0.04, 0.03, 0.02, 0.06])
