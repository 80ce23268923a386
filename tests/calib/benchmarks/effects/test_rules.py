"""The rules that a diagnosis has to beat, in a space small enough to know what they should say."""

import numpy as np
import pytest

from calib.benchmarks.effects.evidence import Evidence
from calib.benchmarks.effects.rules import RULES
from fitting.signatures import Whitened
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


def named(rule: str, left: np.ndarray) -> str:
    told = RULES[rule](evidence(left), np.random.default_rng(0))
    return told.groups[0][0] if told.groups else told.verdict


def test_a_box_beside_its_marker_is_an_effect_to_who_knows_of_noise_alone() -> None:
    off = 8.0 * np.eye(K)[BOX]
    assert named(BY_NOISE, off) == "slack"
    assert named(INFORMED, off) == "no_gap"


@pytest.mark.parametrize("rule", [BY_NOISE, INFORMED, "largest residual", "raw correlation"])
def test_a_large_effect_is_named(rule: str) -> None:
    assert named(rule, 10.0 * np.eye(K)[GEAR]) == "gear"


@pytest.mark.parametrize("rule", [BY_NOISE, INFORMED])
def test_what_coefficients_can_do_is_no_gap_to_an_information_criterion(rule: str) -> None:
    assert named(rule, 50.0 * np.eye(K)[0]) == "no_gap"


@pytest.mark.parametrize("rule", [BY_NOISE, INFORMED])
def test_an_information_criterion_asks_for_more_than_its_penalty(rule: str) -> None:
    """One parameter costs ln 40 = 3.7 squared standard deviations."""
    assert named(rule, 1.9 * np.eye(K)[GEAR]) == "no_gap"
    assert named(rule, 2.0 * np.eye(K)[GEAR]) == "gear"
