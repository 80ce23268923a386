"""What is said of a posterior: each piece on a posterior whose answer is known."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from fitting.coefficient_fit import Marginal
from fitting.posterior.posterior import Posterior, _flags, identifiability
from fitting.posterior.sampling import VARIABLES
from fitting.posterior.summary import SUMMARY, read_summary
from swimcal.flags import Flag
from swimcal.results import Provenance
from tests.reports.posteriors import made_summary

NAMES = ("blunt_drag", "slender_drag", "angular_drag", "kutta_lift", "magnus_lift")
MIDDLE = np.array([1.0, 2.0, 3.0, 4.0, 5.0])


def drawn(
    covariance: np.ndarray, determined: tuple[bool, ...] = (True,) * 5, at_bound: tuple[str, ...] = ()
) -> Posterior:
    """Draws from that normal distribution, inside the prior."""
    draws = np.random.default_rng(0).multivariate_normal(MIDDLE, covariance, 4000)
    marginals = {
        name: Marginal(9.0, 0.6, 7.9, 9.95 if name in at_bound else 9.5, 400.0, 1.0, yes and name not in at_bound)
        for name, yes in zip(NAMES, determined, strict=True)
    }
    made = SimpleNamespace(
        coefficients=np.clip(draws, 0.0, 10.0),
        marginals=marginals,
    )
    return cast(Posterior, made)


def correlated() -> np.ndarray:
    """Slender drag and Kutta lift are traded against each other: their sum is seen, their difference is not."""
    covariance = np.diag([0.01, 0.25, 0.01, 0.25, 0.04])
    covariance[1, 3] = covariance[3, 1] = -0.24
    return covariance


def test_combinations_that_the_data_see_come_before_those_they_do_not() -> None:
    found = identifiability(drawn(correlated()))
    worst = found.directions[-1]

    np.testing.assert_allclose(found.correlation[1, 3], -0.96, atol=0.01)
    np.testing.assert_allclose(np.abs(worst[[1, 3]]), np.sqrt(0.5), atol=0.03)
    np.testing.assert_allclose(found.direction_narrowed[-1], np.sqrt(0.49 * 12) / 10, rtol=0.05)
    assert "slender drag −" in found.combination(4) or "kutta lift −" in found.combination(4)
    assert np.all(np.diff(found.direction_narrowed) >= 0)


@pytest.mark.parametrize(
    ("determined", "at_bound", "sentence"),
    [
        ((True,) * 5, (), "All five coefficients are determined by these trials."),
        ((False,) * 5, (), "None of the five coefficients is determined by these trials."),
        (
            (True, True, True, True, False),
            ("slender_drag", "kutta_lift"),
            "Magnus lift is not determined by these trials; blunt drag and angular drag are. "
            "Slender drag and kutta lift press against a bound of the prior.",
        ),
        (
            (True,) * 5,
            NAMES[1:],
            "Blunt drag is determined by these trials. "
            "Slender drag, angular drag, kutta lift and magnus lift press against a bound of the prior.",
        ),
    ],
)
def test_the_sentence_says_which_coefficients_are_determined(
    determined: tuple[bool, ...], at_bound: tuple[str, ...], sentence: str
) -> None:
    found = identifiability(drawn(correlated(), determined, at_bound))
    assert found.sentence == sentence
    assert found.determined.tolist() == [d and n not in at_bound for d, n in zip(determined, NAMES, strict=True)]


def misfitting(wave: float, misfit_p: float, marker_m: float = 0.001, **marginals: object) -> list[Flag]:
    made = SimpleNamespace(
        surrogate=SimpleNamespace(settled=True),
        mode=SimpleNamespace(sizes={"marker_placement": marker_m}),
        discrepancy=np.tile([wave, 0.04], (4, 1)),
        misfit_p=misfit_p,
        outside=(),
        marginals=marginals,
    )
    return _flags(cast(Posterior, made))


@pytest.mark.parametrize(("wave", "misfit_p", "warns"), [(0.005, 0.3, 0), (0.005, 0.001, 1), (0.05, 0.001, 1)])
def test_a_misfit_beyond_noise_and_nuisances_is_flagged_once(wave: float, misfit_p: float, warns: int) -> None:
    assert [flag.kind for flag in misfitting(wave, misfit_p)] == ["model_discrepancy"] * warns


def test_markers_far_from_their_described_places_are_flagged() -> None:
    (flag,) = misfitting(1e-3, 0.5, marker_m=0.0099)
    assert flag.kind == "markers_off"
    assert "some 10 mm from where the robot's description has them" in flag.message


@pytest.mark.parametrize(
    ("name", "interval", "words"),
    [
        ("blunt_drag", (0.01, 0.4), "is at its physical limit 0: the trials allow that there is no such drag"),
        ("angular_drag", (0.01, 0.4), "is at its physical limit 0"),
        ("magnus_lift", (0.01, 0.4), "is at its bound 0: the prior, not the trials, limits"),
        ("slender_drag", (7.0, 9.95), "is at its bound 10: the prior, not the trials, limits"),
        ("slender_drag", (0.05, 9.95), "is at its bound 0 and 10: the prior, not the trials, limits"),
    ],
)
def test_a_coefficient_that_presses_against_the_prior_is_flagged_with_its_bounds(
    name: str, interval: tuple[float, float], words: str
) -> None:
    """But a drag at 0 is not cut off by the prior."""
    marginal = Marginal(float(np.mean(interval)), 1.0, *interval, 400.0, 1.0, False)
    (message,) = [flag.message for flag in misfitting(0.005, 0.5, **{name: marginal}) if flag.kind == "at_bound"]
    assert message.startswith(f"{name} {words}")
    assert f"90 % interval {interval[0]:.2g} to {interval[1]:.2g}" in message


@pytest.mark.parametrize(("speed", "inside", "warns"), [(0.1, 0.9, 0), (0.13, 0.9, 1), (0.1, 0.7, 1)])
def test_a_fitted_trial_outside_its_own_bands_is_flagged(speed: float, inside: float, warns: int) -> None:
    trial = next(each for each in made_summary().trials if each.role == "fit")
    band = np.linspace(0.09, 0.11, 5)
    found = replace(trial, speed=speed, inner=band, outer=band, forecast=replace(trial.forecast, inside=inside))
    assert [flag.kind for flag in found.flags] == ["outside_bands"] * warns
    assert not replace(found, role="holdout").flags


def test_a_summary_is_read_back_as_it_was_written(tmp_path: Path) -> None:
    xarray = pytest.importorskip("xarray")
    before = made_summary()
    draws = tmp_path / "posterior.nc"
    chains = {name: (("chain", "draw"), before.chains[..., i]) for i, name in enumerate(VARIABLES)}
    xarray.Dataset(chains).to_netcdf(draws, group="posterior", engine="h5netcdf")
    SUMMARY.write(tmp_path, Provenance("4.0.0", "c" * 64, {}, 0, "quick"), before)
    after = read_summary(tmp_path)

    np.testing.assert_array_equal(after.chains, before.chains)
    np.testing.assert_array_equal(after.wanted, before.wanted)
    np.testing.assert_allclose(after.sweep.sd, before.sweep.sd)
    np.testing.assert_allclose(after.trials[0].swing_outer, before.trials[0].swing_outer)
    assert after.marginals == before.marginals
    assert after.flags == before.flags
    assert after.identifiability.sentence == before.identifiability.sentence
    assert after.whiteness[0].is_white
    np.testing.assert_allclose(after.whiteness[0].neighbours, before.whiteness[0].neighbours)
