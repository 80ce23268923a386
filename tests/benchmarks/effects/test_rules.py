"""The rules that a diagnosis has to beat, in a space small enough to know what they should say."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.effects.rules import RULES, Evidence, _noise_of
from fitting.model.session_model import SessionModel
from fitting.signatures import Whitened
from session.create import FISHSIM_MARKERS
from tests.diagnosis.grounds import ground
from tests.diagnosis.rows import signature

K, COEFFICIENTS, BOX, SLACK, GEAR = 40, 5, 5, 6, 7  # of the row: its length, the first numbers, and single ones
BY_NOISE, INFORMED = "BIC alone", "informed BIC"


def evidence(left: np.ndarray) -> Evidence:
    """Two effects; a box beside its marker moves one number by ten standard deviations of the noise, and no more."""
    slopes, free = np.eye(K)[:, :COEFFICIENTS], np.full(COEFFICIENTS, 1e9)
    boxes = 10.0**2 * np.outer(np.eye(K)[BOX], np.eye(K)[BOX])
    like_the_box = np.eye(K)[BOX] + np.eye(K)[SLACK]
    return Evidence(
        left=left,
        space=Whitened.of(np.eye(K) + boxes, slopes, free),
        noise=Whitened.of(np.eye(K), slopes, free),
        signatures=(signature("slack", like_the_box), signature("gear", np.eye(K)[GEAR])),
    )


def noise(seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal(K)


def named(rule: str, left: np.ndarray) -> str:
    told = RULES[rule](evidence(left))
    return told.groups[0][0] if told.groups else told.verdict


def test_a_box_beside_its_marker_is_an_effect_to_who_knows_of_noise_alone() -> None:
    off = noise() + 8.0 * np.eye(K)[BOX]
    assert named(BY_NOISE, off) == "slack"
    assert named(INFORMED, off) == "no_gap"


@pytest.mark.parametrize("rule", [BY_NOISE, INFORMED, "largest residual", "raw correlation"])
def test_a_large_effect_is_named(rule: str) -> None:
    assert named(rule, noise() + 10.0 * np.eye(K)[GEAR]) == "gear"


@pytest.mark.parametrize("rule", [BY_NOISE, INFORMED])
def test_what_coefficients_can_do_is_no_gap_to_an_information_criterion(rule: str) -> None:
    assert named(rule, noise() + 50.0 * np.eye(K)[0]) == "no_gap"


@pytest.mark.parametrize("rule", [BY_NOISE, INFORMED])
def test_an_information_criterion_asks_for_more_than_its_penalty(rule: str) -> None:
    """One parameter costs ln 40: of squared standard deviations, or of 40 times the logarithm of their sum."""
    others = np.sign(noise())
    others[[*range(COEFFICIENTS), BOX, SLACK, GEAR]] = 0.0
    least = np.sqrt(others @ others * (K ** (1 / K) - 1)) if rule == BY_NOISE else np.sqrt(np.log(K))
    assert named(rule, others + (least - 0.1) * np.eye(K)[GEAR]) == "no_gap"
    assert named(rule, others + (least + 0.1) * np.eye(K)[GEAR]) == "gear"


@pytest.mark.long
def test_a_marker_that_counts_in_no_frame_is_no_reason_to_fall() -> None:
    """Its numbers are nothing in swims, twin and effects alike, and nothing is their noise."""
    gone, known = FISHSIM_MARKERS.index("tail_2"), ground()
    trials = []
    for each in known.model.trials:
        weight = each.trial.weight.copy()
        weight[:, gone] = 0.0
        trials.append(replace(each, trial=replace(each.trial, weight=weight)))
    told = replace(known, model=SessionModel(tuple(trials)))
    assert np.isfinite(_noise_of(told).freed(told.left)).all()
