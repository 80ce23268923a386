"""Noise that lasts is told from a swim, its share in features is that of repeated draws, and the rest is white."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fitting.features import SPEED, places_of_slides
from fitting.noise import FeatureNoise, NoisePart, covariance_of_creeps, noise_of
from fitting.posterior.whiteness import noise_flags, whiteness
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.robot import load_robot
from swimsynth.disturbances import TrackingNoise, lasting_errors
from tests.cases import later
from tests.fitting.posterior.waves import ALONG_M, FPS, SPEED_M_S, TIME_S, TURN_RAD, cruising, reader

ALIKE = 0.7 ** np.abs(np.subtract.outer(np.arange(len(ALONG_M)), np.arange(len(ALONG_M))))


def _noisy(lasts_s: float, seed: int) -> np.ndarray:
    """(n, m, 2) with noise of 0.5 mm that lasts and of 0.2 mm that does not."""
    random = np.random.default_rng(seed)
    noise = TrackingNoise(sd_px=0.5, correlation_s=lasts_s)
    lasting = lasting_errors((len(TIME_S), len(ALONG_M), 2), 1 / FPS, noise, random)
    return cruising() + 1e-3 * (lasting + 0.2 * random.standard_normal(lasting.shape))


@pytest.mark.parametrize(
    ("gaps", "lasts_s"), [(True, 0.1), *later((False, 0.04), (False, 0.1), (False, 0.2), (True, 0.04), (True, 0.2))]
)
def test_noise_is_found_beside_the_swim(lasts_s: float, gaps: bool) -> None:
    usable = np.ones((len(TIME_S), len(ALONG_M)), bool)
    if gaps:
        usable[20:50, 2], usable[90:140, 5], usable[200:, 4], usable[::9, 0] = False, False, False, False
    found = [noise_of(reader(usable), np.where(usable[..., None], _noisy(lasts_s, s), np.nan)) for s in range(3)]
    assert np.mean([noise.sd_m for noise in found]) == pytest.approx(1e-3 * np.hypot(0.5, 0.2), rel=0.1)
    lasting = np.exp(np.mean([np.log(noise.lasts_s) for noise in found]))
    assert lasts_s / 1.4 < lasting < 1.4 * lasts_s


def test_every_third_frame_tells_the_same_noise(monkeypatch: pytest.MonkeyPatch) -> None:
    """As when a film has more frames than the noise is estimated from."""
    usable = np.ones((len(TIME_S), len(ALONG_M)), bool)
    monkeypatch.setattr("fitting.noise._MOST_FRAMES", len(TIME_S) // 3)
    found = [noise_of(reader(usable), _noisy(0.2, s)) for s in range(3)]
    assert len(found[0].time_s) == len(TIME_S)
    assert np.mean([noise.sd_m for noise in found]) == pytest.approx(1e-3 * np.hypot(0.5, 0.2), rel=0.1)
    assert 0.2 / 1.5 < np.exp(np.mean([np.log(noise.lasts_s) for noise in found])) < 1.5 * 0.2
    assert np.mean([noise.white for noise in found]) == pytest.approx(0.2**2 / (0.2**2 + 0.5**2), abs=0.1)


def test_the_covariance_of_the_course_is_that_of_repeated_draws() -> None:
    """Of a fish that hardly swims: where it heads matters little for where it goes."""
    read, sd_m, part = (
        replace(reader(), span_m=float(ALONG_M[1])),
        np.full(len(ALONG_M), 4e-4),
        NoisePart(0.8, 0.1, False, ALIKE),
    )
    still = cruising() - np.stack([SPEED_M_S * TIME_S, np.zeros(len(TIME_S))], axis=-1)[:, None]
    told = FeatureNoise(sd_m, [part], TIME_S).covariance(read)
    seen = np.cov(read(still + sd_m[:, None] * _shared(part, 0.2, 1, 2000)).T)
    course = [*range(len(told))[places_of_slides(len(told))], -2, -1]
    assert np.diag(seen)[course] == pytest.approx(np.diag(told)[course], rel=0.15)
    assert seen[course[0], course[1]] == pytest.approx(told[course[0], course[1]], abs=0.1 * told[course[0], course[0]])
    alone = FeatureNoise(sd_m, [part], TIME_S).covariance(reader())
    np.testing.assert_allclose(told[: len(alone), : len(alone)], alone, atol=1e-18)


def test_the_covariance_of_creeps_is_that_of_repeated_draws() -> None:
    """As estimated from each of some tracks, in the mean; neighbours that sway together hide no slide."""
    read, part = reader(), NoisePart(0.8, 0.1, False, np.eye(len(ALONG_M)))
    sway = NoisePart(1.0, 0.4, True, np.full((len(ALONG_M),) * 2, 0.999) + 0.001 * np.eye(len(ALONG_M)))
    drawn = cruising() + 5e-4 * _shared(part, 0.2, 2, 600) + 5e-3 * _shared(sway, 0.0, 3, 600)
    seen = np.cov(read.creeps(drawn, ALONG_M).T)
    told = np.mean([covariance_of_creeps(read, tracks, ALONG_M) for tracks in drawn[:12]], axis=0)
    judged = np.flatnonzero(np.diag(told))
    assert len(judged) == len(ALONG_M) - 3  # all but nose, neck and the last
    assert np.diag(told)[judged] == pytest.approx(np.diag(seen)[judged], rel=0.4)
    assert told[judged[2], judged[3]] < 0


def _shared(part: NoisePart, white: float, seed: int, count: int = 1) -> np.ndarray:
    """(s, n, m, 2) noise of unit variance: a part that lasts, and a white share of each marker's own."""
    random = np.random.default_rng(seed)
    drawn = random.standard_normal((count, *cruising().shape))
    in_time = np.linalg.cholesky(part.over(TIME_S) + 1e-9 * np.eye(len(TIME_S)))
    lasting = np.einsum("nk,ml,sklc->snmc", in_time, np.linalg.cholesky(part.across), drawn, optimize=True)
    return np.asarray(lasting + np.sqrt(white) * random.standard_normal(drawn.shape))


def test_the_covariance_of_features_is_that_of_repeated_draws() -> None:
    usable = np.ones((len(TIME_S), len(ALONG_M)), bool)
    usable[40:80, 3] = False
    read, sd_m, part = reader(usable), 1e-3 * np.linspace(0.3, 0.9, len(ALONG_M)), NoisePart(0.8, 0.1, False, ALIKE)
    noise = FeatureNoise(sd_m, [part], TIME_S)
    seen = np.cov(read(cruising() + sd_m[:, None] * _shared(part, 0.2, 0, 2000)).T)

    def misfit(told: np.ndarray) -> float:
        """Mean square of the features in standard deviations of `told`, in the directions that differences see."""
        places = np.arange(1, len(told)).reshape(-1, 2, 7)
        beats = np.append(places[:, :, 1:].ravel(), SPEED)
        values, vectors = np.linalg.eigh(told[np.ix_(beats, beats)])
        return float(np.mean(np.diag(vectors.T @ seen[np.ix_(beats, beats)] @ vectors) / values))

    told, apart = noise.covariance(read), replace(noise, parts=()).covariance(read)
    assert misfit(told) == pytest.approx(1.0, abs=0.05)
    assert seen[SPEED, SPEED] == pytest.approx(told[SPEED, SPEED], rel=0.1)  # sampling error 3 %
    assert seen[SPEED, SPEED] > 2 * apart[SPEED, SPEED]
    neighbours = [(1 + 14 * m + 8, 1 + 14 * (m + 1) + 8) for m in range(len(ALONG_M) - 1)]  # first cosine across
    for pair in neighbours:
        assert seen[pair] == pytest.approx(
            told[pair], abs=0.1 * np.sqrt(told[pair[0], pair[0]] * told[pair[1], pair[1]])
        )
        assert apart[pair] == 0
        assert told[pair] > 0.4 * np.sqrt(told[pair[0], pair[0]] * told[pair[1], pair[1]])


@pytest.mark.long
@pytest.mark.parametrize(("scale_s", "smooth", "shrunk"), [(0.1, False, 0.05), *later((0.15, True, 0.12))])
def test_what_markers_have_in_common_is_found(scale_s: float, smooth: bool, shrunk: float) -> None:
    """Of a smooth sway 4 s hold few independent samples: it is shrunk the more."""
    part = NoisePart(0.8, scale_s, smooth, ALIKE)
    usable = np.ones((len(TIME_S), len(ALONG_M)), bool)
    usable[20:50, 2] = False
    found = []
    for seed in range(4):
        position_m = cruising() + 1e-3 * _shared(part, 0.2, seed)[0]
        noise = noise_of(reader(usable), np.where(usable[..., None], position_m, np.nan))
        found.append(max(noise.parts, key=lambda each: each.share))
    assert all(each.smooth is smooth for each in found)
    assert np.mean([each.share for each in found]) == pytest.approx(0.8, abs=0.12)
    across = np.mean([each.across for each in found], axis=0)
    assert np.diag(across, 1) == pytest.approx(0.7 - shrunk, abs=0.15)
    assert np.mean(np.diag(across, 1)) == pytest.approx(0.7 - shrunk, abs=0.1)
    assert np.mean(np.diag(across, 4)) == pytest.approx(0.7**4, abs=0.15)


@pytest.mark.long
@pytest.mark.parametrize("shared", [0.0, 0.8])
def test_intervals_hold_as_often_as_with_the_true_noise(shared: float) -> None:
    """Of five numbers that move features anyhow, fitted by least squares: 90 %, whatever neighbours have in common."""
    read, inside = reader(), []
    count = len(ALONG_M)
    across = np.full((count, count), shared) + (1 - shared) * np.eye(count)
    places = np.delete(np.arange(1 + 14 * count), np.arange(1, 1 + 14 * count, 7))  # means go with boxes
    for seed in range(40):
        random = np.random.default_rng([seed, round(100 * shared)])
        true = FeatureNoise(np.full(count, 1e-3), [NoisePart(0.85, 0.15, False, across)], TIME_S)
        position_m = cruising() + true.drawn(TIME_S, random)
        left = (read(position_m) - read(cruising()))[places]
        slopes = random.standard_normal((len(places), 5)) * np.sqrt(np.diag(true.covariance(read))[places])[:, None]
        held = []
        for noise in (true, noise_of(read, position_m)):
            solved = np.linalg.solve(noise.covariance(read)[np.ix_(places, places)], slopes)
            spread = np.linalg.inv(slopes.T @ solved)
            held.append(np.abs(spread @ (solved.T @ left)) < 1.645 * np.sqrt(np.diag(spread)))
        inside.append(np.mean(held, axis=1))
    with_true, with_found = np.mean(inside, axis=0)
    assert with_found > 0.86
    assert with_found == pytest.approx(with_true, abs=0.03)


def test_draws_are_like_the_noise_they_are_drawn_from() -> None:
    sd_m = 1e-3 * np.linspace(0.3, 0.9, len(ALONG_M))
    parts = [NoisePart(0.5, 0.1, False, ALIKE), NoisePart(0.3, 0.2, True, np.eye(len(ALONG_M)))]
    noise, random = FeatureNoise(sd_m, parts, TIME_S), np.random.default_rng(1)
    drawn = np.array([noise.drawn(TIME_S, random) for _ in range(60)]) / sd_m[:, None]  # (d, n, m, 2)
    assert drawn.std(axis=(0, 1, 3)) == pytest.approx(1.0, rel=0.1)
    across = np.einsum("dnic,dnjc->ij", drawn, drawn) / drawn[..., 0, :].size
    assert across == pytest.approx(0.5 * ALIKE + 0.5 * np.eye(len(ALONG_M)), abs=0.07)
    lag = round(0.1 * FPS)
    later = (drawn[:, lag:] * drawn[:, :-lag]).mean()
    assert later == pytest.approx(
        0.5 * np.exp(-lag / FPS / 0.1) + 0.3 * np.exp(-0.5 * (lag / FPS / 0.2) ** 2), abs=0.05
    )


MARKERS = FISHSIM_MARKERS[:6]
APART = np.abs(np.subtract.outer(np.arange(6), np.arange(6)))
NEIGHBOURS = 0.7**APART  # correlation of markers that are so many places apart


def believed(scale_s: float, across: np.ndarray | None = None, smooth: bool = False) -> FeatureNoise:
    """Noise that lasts so long, with a white share of 0.1; independent markers unless told."""
    across = np.eye(len(MARKERS)) if across is None else across
    return FeatureNoise(np.ones(len(MARKERS)), [NoisePart(0.9, scale_s, smooth, across)], TIME_S)


def tracks(truth: FeatureNoise, noise: FeatureNoise, seed: int = 2) -> Any:
    """A trial of nothing but noise, with a gap, taken for noise that may be another."""
    random = np.random.default_rng(seed)
    usable = np.ones((len(TIME_S), len(MARKERS)), bool)
    usable[50:80, 2] = False
    position_m = truth.drawn(TIME_S, random)
    return SimpleNamespace(
        reader=SimpleNamespace(time_s=TIME_S, turn_rad=TURN_RAD, usable=usable),
        noise=noise,
        trial=SimpleNamespace(
            name="noise",
            markers=MARKERS,
            position_m=np.where(usable[..., None], position_m, np.nan),
            kept=np.ones(len(TIME_S), bool),
        ),
        along_m=load_robot().marker_positions_m(MARKERS)[:, 0],
    )


def test_noise_that_is_as_it_is_taken_to_be_leaves_white_noise() -> None:
    found = whiteness(tracks(believed(0.1), believed(0.1)))

    assert found.is_white
    assert not noise_flags([found])
    assert found.raw[0] > 0.5
    assert found.effective < found.frames / 4


def test_noise_that_lasts_longer_than_it_is_taken_to_is_flagged() -> None:
    found = whiteness(tracks(believed(0.3), believed(0.02)))
    (flag,) = noise_flags([found])

    assert not found.in_time
    assert flag.kind == "noise_not_white"
    assert (
        f"{100 * found.outside:.0f} % of the lags lie outside the band of white noise, at most 25 % may" in flag.message
    )


@pytest.mark.parametrize(("scale_s", "smooth"), [(0.1, False), (0.12, True)])
def test_what_neighbours_share_is_flagged_unless_the_model_has_it(scale_s: float, smooth: bool) -> None:
    truth = believed(scale_s, NEIGHBOURS, smooth)
    right = whiteness(tracks(truth, truth))
    wrong = whiteness(tracks(truth, believed(scale_s, smooth=smooth)))

    assert right.is_white
    assert right.neighbour_correlation_raw == pytest.approx(0.65, abs=0.15)
    assert not wrong.across
    assert wrong.in_time
    said = noise_flags([wrong])[0].message
    assert any(
        f"neighbouring markers correlate by {left:.2f} (root mean square" in said and f"at most {limit:.2f}" in said
        for left, limit in zip(wrong.neighbour_correlation, wrong.neighbours_limit, strict=True)
    )
