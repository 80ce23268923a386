"""What is not read takes no part: in the reader, in the covariance, in draws; and a phase is turned, not added."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from fitting.covariance import apart
from fitting.features import OF_A_MARKER, FeatureReader, advance_phase, harmonics_of, marker_part
from fitting.forecast import draws_about, root_of
from fitting.noise import FeatureNoise
from fitting.trial_model import difference, slope_of_phase
from swimcal.errors import NotEnoughData
from tests.fitting.exact_swims import exact_swims
from tests.fitting.posterior.waves import cruising, reader

MARKER = 5


def blind(frames: slice) -> FeatureReader:
    """A reader whose sixth marker is not seen in some frames."""
    usable = np.ones(reader().usable.shape, bool)
    usable[frames, MARKER] = False
    whole = replace(reader(), usable=usable)
    return replace(whole, usable=usable & whole._determined)


def test_a_marker_that_is_hardly_seen_leaves_all_others_as_they_are() -> None:
    read = blind(slice(8, None))
    features, whole = read(cruising()), reader()(cruising())

    assert not read.read[MARKER]
    assert read.read.sum() == len(read.read) - 1
    assert not marker_part(features)[MARKER].any()
    first = marker_part(whole)
    others = np.delete(np.arange(len(first)), MARKER)
    assert marker_part(features)[others][..., 1:] == pytest.approx(first[others][..., 1:], abs=1e-9)
    assert features[0] == pytest.approx(whole[0], abs=1e-9)
    assert read.observed.sum() == len(features) - 2 * OF_A_MARKER


def test_its_noise_is_none_and_the_others_is_theirs() -> None:
    read = blind(slice(8, None))
    noise = FeatureNoise(np.full(len(read.read), 1e-3), (), read.time_s)
    own = noise.covariance(read)

    assert not own[~read.observed].any()
    assert np.linalg.eigvalsh(own[np.ix_(read.observed, read.observed)]).min() > 0


def test_a_row_that_is_apart_is_as_if_it_were_not_there() -> None:
    random = np.random.default_rng(1)
    root = random.standard_normal((6, 6))
    total, observed = root @ root.T + np.eye(6), np.array([True, True, False, True, False, True])
    row = np.where(observed, random.standard_normal(6), 0.0)

    masked = multivariate_normal(np.zeros(6), apart(total, observed)).logpdf(row)
    alone = multivariate_normal(np.zeros(4), total[np.ix_(observed, observed)]).logpdf(row[observed])
    constant = multivariate_normal(np.zeros(2), 1e-6 * np.eye(2)).logpdf(np.zeros(2))
    assert masked == pytest.approx(alone + constant)


def test_an_uncertain_phase_makes_no_amplitude_larger() -> None:
    mean = reader()(cruising())
    tangent = slope_of_phase(mean)
    noise = 0.5 * np.random.default_rng(2).standard_normal((400, 1))
    drawn = draws_about(mean, noise * tangent)

    amplitude = np.abs(harmonics_of(drawn)[..., 1, 0])
    assert amplitude == pytest.approx(np.broadcast_to(np.abs(harmonics_of(mean)[..., 1, 0]), amplitude.shape))
    assert drawn[0] == pytest.approx(advance_phase(mean, noise[0, 0]))


def test_draws_have_the_covariance_they_are_drawn_from() -> None:
    covariance = np.array([[2.0, 0.5], [0.5, 1.0]])
    root = root_of(covariance)

    assert root.T @ root == pytest.approx(covariance)


def test_a_derivative_next_to_a_twin_that_diverges_is_one_sided() -> None:
    middle = np.array([1.0, 2.0])
    up, down = (
        np.array([[2.0, 3.0], [np.nan, 1.0], [np.nan, np.nan]]),
        np.array([[0.0, 1.0], [0.0, 0.0], [np.nan, 1.0]]),
    )

    assert difference(up, down, middle) == pytest.approx(np.array([[2.0, 2.0], [2.0, 4.0], [0.0, 0.0]]))


@pytest.mark.parametrize("frames", [0, 1, 2, 5])
def test_a_window_of_hardly_a_frame_is_no_window(frames: int) -> None:
    """Two beats of a fast tail may be over before a twin has settled."""
    (swim,) = exact_swims(hz=(1.1,), seconds=4.0)
    kept = np.zeros(len(swim.time_s), bool)
    kept[40 : 40 + frames] = True

    with pytest.raises(NotEnoughData, match=f"of {frames} frames"):
        FeatureReader.of(replace(swim, kept=kept))
