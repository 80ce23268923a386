"""What is said of a posterior: each piece on a posterior whose answer is known."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from fitting.marginal import Marginal
from fitting.posterior.findings import FINDINGS, read_findings
from fitting.posterior.identifiability import identifiability
from fitting.posterior.inference import _flags
from fitting.posterior.laplace import laplace
from fitting.posterior.places_off import TAKEN
from fitting.posterior.posterior import Posterior
from fitting.posterior.posterior_file import VARIABLES
from session import Flag
from session.results import Provenance
from tests.reports.posteriors import made_findings

NAMES = ("blunt_drag", "slender_drag", "angular_drag", "kutta_lift", "magnus_lift")
MIDDLE = np.array([1.0, 2.0, 3.0, 4.0, 5.0])


class Normal:
    """A likelihood that is normal in the coefficients about `MIDDLE`."""

    def __init__(self, covariance: np.ndarray) -> None:
        self.precision = np.linalg.inv(covariance)

    def __call__(self, coefficients: np.ndarray, discrepancy: np.ndarray) -> np.ndarray:  # noqa: ARG002
        off = coefficients - MIDDLE
        return np.asarray(-0.5 * np.einsum("si,ij,sj->s", off, self.precision, off))


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
        discrepancy=np.full((len(draws), 2), 0.01),
        marginals=marginals,
        found=SimpleNamespace(likelihood=Normal(covariance)),
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
            (True, False, True, True, False),
            (),
            "Slender drag and magnus lift are not determined by these trials; "
            "blunt drag, angular drag and kutta lift are.",
        ),
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


def misfitting(wave: float, speed: float, misfit_p: float, marker_m: float = TAKEN.marker_m) -> list[Flag]:
    made = SimpleNamespace(
        found=SimpleNamespace(settled=True, off=TAKEN._replace(marker_m=marker_m)),
        discrepancy=np.tile([wave, speed], (4, 1)),
        misfit_p=misfit_p,
        marginals={},
    )
    return _flags(cast(Posterior, made))


@pytest.mark.parametrize(
    ("wave", "speed", "misfit_p", "warns"),
    [(0.005, 0.005, 0.3, 0), (0.005, 0.005, 0.001, 1), (0.05, 0.005, 0.001, 1), (0.001, 0.03, 0.3, 1)],
)
def test_a_misfit_beyond_noise_and_nuisances_is_flagged_once(
    wave: float, speed: float, misfit_p: float, warns: int
) -> None:
    assert [flag.kind for flag in misfitting(wave, speed, misfit_p)] == ["model_discrepancy"] * warns


def test_a_speed_that_is_off_by_all_that_is_allowed_is_said() -> None:
    (pressing,), (free,) = misfitting(0.2, 0.09, 0.3), misfitting(0.2, 0.05, 0.3)
    assert "10 % is the most that its speed may be off by" in pressing.message
    assert "is the most" not in free.message


def test_markers_far_from_their_described_places_are_flagged() -> None:
    (flag,) = misfitting(1e-3, 1e-3, 0.5, marker_m=0.0099)
    assert flag.kind == "markers_off"
    assert "some 10 mm from where the robot's description has them" in flag.message


def test_laplace_of_a_normal_posterior_is_that_posterior() -> None:
    found = laplace(drawn(correlated()))
    half = 1.645 * np.sqrt(np.diag(correlated()))

    np.testing.assert_allclose(found.middle, MIDDLE, atol=0.02)
    np.testing.assert_allclose(found.q95 - found.q05, 2 * half, rtol=0.02)


def test_findings_are_read_back_as_they_were_written(tmp_path: Path) -> None:
    xarray = pytest.importorskip("xarray")
    before = made_findings()
    draws = tmp_path / "posterior.nc"
    chains = {name: (("chain", "draw"), before.chains[..., i]) for i, name in enumerate(VARIABLES)}
    xarray.Dataset(chains).to_netcdf(draws, group="posterior", engine="h5netcdf")
    FINDINGS.write(tmp_path, Provenance("4.0.0", "c" * 64, {}, 0, "quick"), before)
    after = read_findings(tmp_path)

    np.testing.assert_array_equal(after.chains, before.chains)
    np.testing.assert_allclose(after.laplace.q95, before.laplace.q95)
    np.testing.assert_array_equal(after.further.wanted, before.further.wanted)
    np.testing.assert_allclose(after.trials[0].swing_outer, before.trials[0].swing_outer)
    assert after.marginals == before.marginals
    assert after.flags == before.flags
    assert after.left_out[1:] == before.left_out[1:]
    for told, kept in zip(before.left_out.tried, after.left_out.tried, strict=True):
        np.testing.assert_equal(kept._asdict(), told._asdict())
    assert after.identifiability.sentence == before.identifiability.sentence
    assert after.whiteness[0].is_white
    np.testing.assert_allclose(after.whiteness[0].beside_left, before.whiteness[0].beside_left)
