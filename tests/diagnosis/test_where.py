"""Shares add up exactly, and a gap that was made at one stage is found there."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np
import pytest

from diagnosis.linear_model import LinearModel
from diagnosis.places import HEAD, ForceResponses, GeneralisedForces, LocalDiscrepancy, local_discrepancies
from diagnosis.where import STAGES, VarianceDecomposition, decompose
from fitting.signatures import Signature, signature_of
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.effects.catalogue import catalogue
from swimcal.effects.measurement import MarkerOffset
from tests.diagnosis.linear_models import CAMERA, linear

pytestmark = pytest.mark.filterwarnings("error")


NAMED = ("entrained_water",)


def located(
    pushed: ForceResponses,
    gap: np.ndarray,
    signatures: Sequence[Signature] = (),
    named: Collection[str] = (),
    placed: Sequence[LocalDiscrepancy] = (),
) -> VarianceDecomposition:
    other: LinearModel = replace(linear())
    other.__dict__["residual"] = linear().residual + gap
    return decompose(other, pushed, signatures, named, placed)


def of_length(length: float, row: np.ndarray) -> np.ndarray:
    """A row (k,) made so long, whitened."""
    return np.asarray(length * row / np.linalg.norm(linear().space.projected(row)))


def signature_named(name: str) -> Signature:
    effect = catalogue()[name].suited(linear().twin.robot, linear().twin.markers)
    return signature_of(effect, linear().model, CAMERA, linear().at)


def test_without_a_gap_it_is_noise_and_shares_and_parts_add_up(pushed: ForceResponses) -> None:
    found, at = located(pushed, np.zeros_like(linear().residual)), linear()
    assert found.shares.by_stage["floor"] > 0.8
    for split in (
        found.shares.by_stage,
        found.shares.by_trial,
        found.shares.by_marker,
        found.shares.by_axis,
        found.shares.by_band,
    ):
        assert sum(split.values()) == pytest.approx(1.0, abs=1e-6)
    left = at.residual - at.slopes @ at.space.coefficients(at.residual)
    assert found.parts.sum(axis=0) == pytest.approx(left, abs=1e-9)


@pytest.mark.parametrize(("joint", "stage"), [("head_across", "body"), ("tail_3", "tail")])
def test_a_missing_force_is_found_at_its_joint(pushed: ForceResponses, joint: str, stage: str) -> None:
    number, harmonic = pushed.joints.index(joint), 1
    column = pushed.columns[:, :, number, harmonic].sum(axis=1)  # in both trials
    found = located(pushed, of_length(30, column))
    told = {name: share for name, share in found.shares.by_stage.items() if name != "floor"}
    assert max(told, key=lambda name: told[name]) == stage
    size = np.abs(found.forces.mean).mean(axis=(0, 2)) / pushed.unit
    group = range(len(HEAD)) if stage == "body" else range(len(HEAD), len(pushed.joints))
    assert max(group, key=lambda i: size[i]) == number


def test_a_marker_seen_elsewhere_is_the_cameras(pushed: ForceResponses) -> None:
    effect = MarkerOffset(FISHSIM_MARKERS)
    values = np.zeros((1, len(effect.parameters)))
    values[0, [p.name for p in effect.parameters].index("tail_3_across")] = 0.03
    row = signature_of(effect, linear().model, CAMERA, linear().at, values).rows[0]
    told = dict(located(pushed, row).shares.by_stage)
    del told["floor"]
    assert max(told, key=lambda name: told[name]) == "camera"


@pytest.mark.long
def test_an_effect_that_is_named_lies_at_its_stage(pushed: ForceResponses) -> None:
    """Entrained water pushes the head too: what it does beyond the tail would else count as the body's."""
    signature = signature_named("entrained_water")
    told = {named: located(pushed, signature.rows[-1], [signature], named).shares.by_stage for named in ((), NAMED)}
    assert told[NAMED]["tail"] > max(0.5, told[()]["tail"] + 0.1)
    assert sum(told[NAMED].values()) == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("place", ["hinge tail_2", "whole tail"])
def test_what_is_at_a_place_lies_at_its_stage(pushed: ForceResponses, place: str) -> None:
    """A torque in one hinge, or in all, moves all markers, so a little of it looks like the camera's."""
    (one,) = (each for each in local_discrepancies(linear(), pushed) if each.same and each.place == place)
    gap = of_length(12, one.columns[:, 1])
    told = {bool(placed): located(pushed, gap, placed=placed).shares.by_stage for placed in ((), (one,))}
    assert told[True]["tail"] > max(0.3, told[False]["tail"] + 0.03)
    assert max(told[True], key=lambda stage: told[True][stage] * (stage != "floor")) == "tail"
    assert sum(told[True].values()) == pytest.approx(1.0, abs=1e-6)


def test_every_place_has_a_stage(pushed: ForceResponses) -> None:
    found = {each.place: each.stage for each in local_discrepancies(linear(), pushed)}
    assert set(found.values()) == set(STAGES) - {"floor", "drive"}
    told = [found[place] for place in ("hinge tail_2", "whole tail", "head, steadily", "marker nose")]
    assert told == ["tail", "tail", "body", "camera"]


def test_no_push_is_the_plain_twin() -> None:
    effect = GeneralisedForces(linear().twin.robot)
    assert effect.force(linear().twin.robot, linear().twin.scene, np.zeros((2, len(effect.parameters)))) is None
