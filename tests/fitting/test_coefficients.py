"""The five coefficients: found from wrong starts, the same whatever does the work, honest about what is doubtful."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fitting import CoefficientFit
from fitting.coefficient_fit import Restart, flags_of
from fitting.coefficients import QUICK, fit_coefficients
from fitting.objective import Swims
from swimmer import FluidCoefficients
from synthetic import PLAUSIBLE_COEFFICIENTS, Truth

SMALL = replace(QUICK, final_iterations=14)
TOLERANCE = {"blunt_drag": 0.03, "slender_drag": 0.03, "angular_drag": 0.1, "kutta_lift": 0.03}
"""Magnus lift is missing: it moves the markers by less than the difference between two time steps."""


@pytest.fixture(scope="module")
def small(swims: Swims) -> CoefficientFit:
    return fit_coefficients(swims, SMALL, seed=0)


@pytest.mark.long
def test_from_wrong_starts_coefficients_and_phases_are_recovered(
    small: CoefficientFit, swims: Swims, truth: Truth
) -> None:
    starts = np.array([restart.start for restart in small.restarts])
    assert (np.abs(np.sqrt(starts) - np.sqrt(PLAUSIBLE_COEFFICIENTS)).max(axis=1) > 0.7).all()

    for name, tolerance in TOLERANCE.items():
        assert getattr(small.coefficients, name) == pytest.approx(getattr(PLAUSIBLE_COEFFICIENTS, name), rel=tolerance)
    true = np.array([truth.trials[trial.name].phase_rad for trial in swims.trials])

    assert np.abs(np.angle(np.exp(1j * (small.phase_rad - true)))).max() < 0.05
    assert small.mean_distance_m < 0.5e-3


@pytest.mark.long
def test_every_descent_goes_down_and_the_best_comes_first(small: CoefficientFit, swims: Swims) -> None:
    for restart in small.restarts:
        assert (np.diff(restart.history_m) <= 1e-9).all()
        assert restart.history_m[-1] == restart.objective_m
    ranks = [(not restart.swims_forward, restart.objective_m) for restart in small.restarts]
    assert ranks == sorted(ranks)
    np.testing.assert_allclose(small.coefficients, small.restarts[0].coefficients)

    column = np.array([*small.coefficients, *small.phase_rad])[:, None]
    assert swims.mean_distance(column)[0] == pytest.approx(small.mean_distance_m, rel=1e-9)
    assert (np.array(small.coefficients) >= 0).all()
    assert (np.array(small.coefficients) <= 10).all()


def restart(coefficients: tuple[float, ...], objective_m: float = 0.01, **changes: bool) -> Restart:
    values = np.array(coefficients)
    made = Restart(values, values, np.zeros(1), objective_m, np.array([objective_m]), converged=True)
    return replace(made, **changes)  # type: ignore[arg-type]


GOOD = (0.4, 2.0, 6.0, 4.0, 1.0)


def kinds(*restarts: Restart) -> list[str]:
    return [flag.kind for flag in flags_of(list(restarts))]


@pytest.mark.parametrize(("place", "value", "bound"), [(0, 0.0, "0"), (2, 9.995, "10"), (4, 10.0, "10")])
def test_a_coefficient_at_its_bound_is_flagged_by_name(place: int, value: float, bound: str) -> None:
    values = list(GOOD)
    values[place] = value
    (flag,) = flags_of([restart(tuple(values))])

    assert flag.kind == "at_bound"
    assert flag.message.startswith(FluidCoefficients._fields[place])
    assert f"at its bound {bound}:" in flag.message


def test_what_is_wrong_with_the_best_alone_is_flagged() -> None:
    assert kinds(restart(GOOD), restart(GOOD, 0.02)) == []
    assert kinds(restart(GOOD, converged=False), restart(GOOD, 0.02)) == ["not_converged"]
    assert kinds(restart(GOOD), restart(GOOD, 0.02, converged=False)) == []
    assert kinds(restart(GOOD, swims_forward=False)) == ["swims_backward"]


def test_equally_good_restarts_are_flagged_with_what_differs() -> None:
    other = (0.4, 2.2, 7.5, 4.0, 1.0)
    (flag,) = flags_of([restart(GOOD), restart(other, 0.01005), restart((9.0, 9.0, 9.0, 9.0, 9.0), 0.02)])

    assert flag.kind == "restarts_disagree"
    assert "2 restarts" in flag.message
    assert "angular_drag (by 1.5)" in flag.message
    assert "slender_drag" not in flag.message


def test_a_closer_twin_that_swims_backward_is_rejected_aloud() -> None:
    backward = restart((0.0, 3.5, 9.0, 1.1, 0.1), 0.008, swims_forward=False)
    (flag,) = flags_of([restart(GOOD), backward])

    assert flag.kind == "rejected_restart"
    assert "20 % closer" in flag.message
