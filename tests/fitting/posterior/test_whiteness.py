"""What a noise model leaves is white where it is right, and flagged where it is not: in time and across markers."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from fitting.posterior import inference as module
from fitting.posterior.inference import sample_posterior
from fitting.posterior.noise import GaitNoise
from fitting.posterior.noise_part import NoisePart
from fitting.posterior.whiteness import noise_flags, whiteness
from session import FISHSIM_MARKERS
from swimmer import Twin, load_robot
from tests.fitting.posterior.waves import TIME_S, TURN_RAD

MARKERS = FISHSIM_MARKERS[:6]
APART = np.abs(np.subtract.outer(np.arange(6), np.arange(6)))
ALIKE = 0.7**APART  # correlation of markers that are so many places apart


def believed(scale_s: float, across: np.ndarray | None = None, smooth: bool = False) -> GaitNoise:
    """Noise that lasts so long, with a white share of 0.1; independent markers unless told."""
    across = np.eye(len(MARKERS)) if across is None else across
    return GaitNoise.of_parts(np.ones(len(MARKERS)), [NoisePart(0.9, scale_s, smooth, across)], TIME_S)


def tracks(truth: GaitNoise, noise: GaitNoise, seed: int = 2) -> Any:
    """A trial of nothing but noise, with a gap, taken for noise that may be another."""
    random = np.random.default_rng(seed)
    usable = np.ones((len(TIME_S), len(MARKERS)), bool)
    usable[50:80, 2] = False
    position_m = truth.drawn(TIME_S, random)
    return SimpleNamespace(
        gait=SimpleNamespace(time_s=TIME_S, turn_rad=TURN_RAD, usable=usable),
        noise=noise,
        trial=SimpleNamespace(
            name="noise",
            markers=MARKERS,
            position_m=np.where(usable[..., None], position_m, np.nan),
            kept=np.ones(len(TIME_S), bool),
        ),
        twin=SimpleNamespace(robot=load_robot()),
    )


def test_noise_that_is_as_it_is_taken_to_be_leaves_white_noise() -> None:
    found = whiteness(tracks(believed(0.1), believed(0.1)))

    assert found.is_white
    assert not noise_flags([found])
    np.testing.assert_allclose(found.raw[:6], found.modelled[:6], atol=0.06)
    assert found.effective < found.frames / 4


def test_noise_that_lasts_longer_than_it_is_taken_to_is_flagged() -> None:
    found = whiteness(tracks(believed(0.3), believed(0.02)))
    (flag,) = noise_flags([found])

    assert not found.in_time
    assert flag.kind == "noise_not_white"
    assert (
        f"{100 * found.outside:.0f} % of the lags lie outside the band of white noise, at most 20 % may" in flag.message
    )


@pytest.mark.parametrize(("scale_s", "smooth"), [(0.1, False), (0.12, True)])
def test_what_neighbours_share_is_flagged_unless_the_model_has_it(scale_s: float, smooth: bool) -> None:
    truth = believed(scale_s, ALIKE, smooth)
    right = whiteness(tracks(truth, truth))
    wrong = whiteness(tracks(truth, believed(scale_s, smooth=smooth)))

    assert right.is_white
    assert right.beside_before == pytest.approx(0.65, abs=0.15)
    assert not wrong.across
    assert wrong.in_time
    said = noise_flags([wrong])[0].message
    assert any(
        f"neighbouring markers correlate by {left:.2f} (root mean square" in said and f"at most {limit:.2f}" in said
        for left, limit in zip(wrong.beside, wrong.beside_limit, strict=True)
    )


def test_of_white_noise_the_limits_hold_in_all_but_a_few_trials() -> None:
    found = [whiteness(tracks(believed(0.1), believed(0.1), seed)) for seed in range(12)]
    beyond = np.array([one.beside / one.beside_limit for one in found])

    assert (beyond > 1).sum() <= 1
    assert 0.5 < np.sqrt((beyond**2).mean()) < 0.9  # of the 99 % limit of five pairs: 0.57 where it is right


def test_the_posterior_carries_the_flag(monkeypatch: pytest.MonkeyPatch) -> None:
    truth = believed(0.1, ALIKE)
    model = SimpleNamespace(trials=(tracks(truth, truth), tracks(truth, believed(0.1))))
    monkeypatch.setattr(module, "SessionModel", SimpleNamespace(of=lambda *_: model))
    monkeypatch.setattr(module, "explore", lambda *_: None)
    monkeypatch.setattr(module, "sample", lambda *_: SimpleNamespace(flags=()))
    monkeypatch.setattr(module, "_misfit_p", lambda *_: 0.5)
    monkeypatch.setattr(module, "_flags", lambda _: [])
    monkeypatch.setattr(module, "robot_flags", lambda _: [])
    found = sample_posterior([], cast(Twin, None))

    assert [one.is_white for one in found.whiteness] == [True, False]
    assert found.flags == tuple(noise_flags(found.whiteness[1:]))
