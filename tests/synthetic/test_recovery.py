"""The first identification on sessions whose truth is known: what it recovers, and what it says it cannot."""

from pathlib import Path

import numpy as np
import pytest

from fitting import CoefficientFit
from fitting.coefficients import FULL, fit_coefficients
from fitting.objective import Swims
from swimmer import FluidCoefficients, Twin, load_robot
from synthetic import SyntheticPlan, default_plan, make_session, read_truth
from synthetic.noise import NOISELESS
from tests.synthetic.plans import measured

DETERMINED = ("blunt_drag", "slender_drag", "angular_drag", "kutta_lift")
"""Magnus lift moves the markers by less than the difference between two time steps."""


def fitted(folder: Path, plan: SyntheticPlan) -> tuple[CoefficientFit, np.ndarray]:
    """The fit of the session of a plan, and how far its crank phases are from the truth, rad."""
    trials = tuple(t for t in measured(make_session(folder, plan)).values() if t.role == "fit")
    fit = fit_coefficients(Swims(Twin(load_robot(), trials[0].markers), trials), FULL, seed=0)
    true = np.array([read_truth(folder).trials[trial.name].phase_rad for trial in trials])
    return fit, np.angle(np.exp(1j * (fit.phase_rad - true)))


def relative(found: FluidCoefficients, true: FluidCoefficients) -> dict[str, float]:
    return {name: getattr(found, name) / getattr(true, name) - 1 for name in DETERMINED}


@pytest.mark.long
@pytest.mark.parametrize("seed", [0, 1])
def test_without_noise_the_fit_recovers_what_the_markers_determine(seed: int, tmp_path: Path) -> None:
    plan = default_plan(seed).model_copy(update={"noise": NOISELESS})
    fit, phase_error = fitted(tmp_path / "s", plan)

    assert fit.mean_distance_m < 0.5e-3
    assert np.abs(phase_error).max() < 0.03
    for name, error in relative(fit.coefficients, plan.coefficients).items():
        assert abs(error) < 0.1, name


@pytest.mark.long
def test_with_noise_the_fit_stays_near_the_truth_and_flags_what_it_cannot_tell(tmp_path: Path) -> None:
    """Hand-placed boxes (2 px) and lasting errors cost accuracy that the noise-free fit has."""
    plan = default_plan(0)
    fit, phase_error = fitted(tmp_path / "s", plan)

    assert fit.mean_distance_m < 7e-3
    assert np.abs(phase_error).max() < 0.06
    for name, error in relative(fit.coefficients, plan.coefficients).items():
        assert abs(error) < 0.35, name
    assert {"restarts_disagree", "at_bound"} & {flag.kind for flag in fit.flags}
