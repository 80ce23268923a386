"""A dry run and a free decay are evidence beside the swims: of the robot, and of nothing that water does."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.diagnose import Diagnosis, Settings, diagnose
from diagnosis.diagnosis_file import diagnosis_result
from diagnosis.discrepancy import discrepancy_for
from diagnosis.linear_model import LinearModel, SessionData
from fitting.signatures import Signature, signature_of
from fitting.trial import ExperimentsInAir
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.effects.catalogue import catalogue
from swimcal.twin import Twin
from tests.diagnosis.decays import decay
from tests.diagnosis.linear_models import AT, CAMERA, ROBOT, dry_run, shorter, trials

pytestmark = pytest.mark.long  # a minute

NAMES = ("crank_arm_error", "entrained_water")


@pytest.fixture(scope="module")
def found() -> Diagnosis:
    swims, twin = [*trials(), trials()[0].with_role("holdout")], Twin(shorter(), FISHSIM_MARKERS, workers=1)
    effects = {name: catalogue()[name] for name in (*NAMES, "scale_error")}
    discrepancy = discrepancy_for(FISHSIM_MARKERS, ROBOT)
    data = SessionData(swims, twin, CAMERA, discrepancy, AT, ExperimentsInAir([dry_run()], [decay()]))
    return diagnose(data, effects, Settings("quick"))


@pytest.fixture(scope="module")
def signatures(found: Diagnosis) -> dict[str, Signature]:
    at = found.weighed.linear
    return {name: signature_of(catalogue()[name], at.model, at.camera, at.at) for name in NAMES}


def dry_part(linear: LinearModel, rows: np.ndarray) -> np.ndarray:
    """The features of the last trial."""
    count = len(linear.trials)
    features = rows[..., : len(linear.model.measured)]
    return np.asarray(np.split(features, count, axis=-1)[-1])


def test_neither_coefficients_nor_water_move_it(found: Diagnosis, signatures: dict[str, Signature]) -> None:
    np.testing.assert_allclose(dry_part(found.weighed.linear, found.weighed.linear.slopes.T), 0.0, atol=1e-9)
    size = {name: np.abs(dry_part(found.weighed.linear, told.rows)).max() for name, told in signatures.items()}
    assert size["entrained_water"] < 1e-9
    assert size["crank_arm_error"] > 1e-3


def test_the_arm_is_named_from_both_and_what_a_decay_says_is_told(found: Diagnosis) -> None:
    told = diagnosis_result(found)
    assert found.said.verdict.groups == (("crank_arm_error",),)
    assert told.missing_forces.trials == ("f0.70", "f1.10")
    assert {"dry0.90", "decay"} < set(told.where.by_trial)
    (decay,) = (vars(decay) for decay in told.free_decays)
    assert decay["trial"] == "decay"
    for number in ("stiffness_over_mass", "damping_over_mass"):
        assert abs(decay[number]) < 4 * decay[f"{number}_se"] < 0.1
