"""Trials that are simulated together give what each gives by itself, and what moves no fish is simulated once."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from fitting.affected_trials import AffectedSession
from fitting.session_model import SessionModel
from fitting.signatures import residual_row, signature_of
from fitting.trial_model import START_PHASE_RAD, TrialModel
from swimcal.effects.affected_twin import AffectedTwin
from swimcal.effects.catalogue import catalogue
from swimcal.effects.measurement import TrackerDrift
from swimcal.mjcf import DRY
from swimcal.runs import MarkerKinematics, Runs
from swimcal.session_file import CameraSpec
from swimcal.twin import Twin
from swimsynth.plan import PLAUSIBLE_COEFFICIENTS
from tests.fitting.exact_swims import ROBOT, exact_dry_run, exact_swims, exact_twin

CAMERA = CameraSpec(fps=60.0, scale_length_m=ROBOT.scale_length_m)
AT = np.array(PLAUSIBLE_COEFFICIENTS, float)


@cache
def model() -> SessionModel:
    """Swims of unlike length, and a dry run beside a twin of its own."""
    swims = (*exact_swims(hz=(0.9,), seconds=4.0), *exact_swims(hz=(1.2,), seconds=5.0))
    wet, dry = exact_twin(1), Twin(ROBOT, swims[0].markers, DRY, 1)
    trials = [TrialModel(wet, swim, START_PHASE_RAD) for swim in swims]
    return SessionModel((trials[0], TrialModel(dry, exact_dry_run(), START_PHASE_RAD), trials[1]))


@pytest.mark.parametrize("name", ["fluid_memory", "joint_friction", "crank_arm_error", "time_base_error"])
def test_trials_together_are_as_each_by_itself(name: str) -> None:
    session = AffectedSession.of([catalogue()[name]], model(), CAMERA, AT)
    parameter = session.effects[0].parameters[0]
    values = np.array([[0.0], [parameter.sd], [2 * parameter.sd]])
    values = np.hstack([values, np.zeros((3, len(session.effects[0].parameters) - 1))])
    at = np.tile(AT, (3, 1))
    alone = [AffectedSession((trial,)).features(at, values) for trial in session.trials]
    together = session.features(at, values)
    assert np.isfinite(together).all()
    np.testing.assert_allclose(together, np.hstack(alone), rtol=0, atol=1e-9)
    assert np.abs(together[1] - together[0]).max() > 1e-5


def test_a_drift_put_into_the_tracks_is_what_the_effect_says() -> None:
    """In all numbers of the row, how fast markers slide aside among them."""
    pace, twin = 0.003, exact_twin(1)
    (swim,) = exact_swims(hz=(0.9,), seconds=4.0)
    own = swim.markers.index("tail_4")
    motion = twin.simulate(TrialModel(twin, swim, START_PHASE_RAD).runs(AT[None]), swim.time_s)
    axes = MarkerKinematics(ROBOT, swim.markers).axes(motion.head[0], motion.hinges_rad[0])
    drifting = motion.marker_m[0].copy()
    drifting[:, own] += pace * (swim.time_s - swim.time_s[0])[:, None] * axes[:, own, 1]
    effect = TrackerDrift(swim.markers)
    values = np.zeros((1, len(effect.parameters)))
    values[0, [each.name for each in effect.parameters].index("tail_4_across")] = pace
    model, found = (
        SessionModel((TrialModel(twin, swim.seen_as(position_m=place), START_PHASE_RAD, with_course=True),))
        for place in (motion.marker_m[0], drifting)
    )

    signature = signature_of(effect, model, CAMERA, AT, values)

    seen, told = residual_row(found, AT) - residual_row(model, AT), signature.rows[0]
    left = -seen[model.places_of_creeps][own]  # the twin heads along -x, so that its left is where its y falls
    assert 0.8 * pace < left < pace  # a link that bends to and fro does not always lie across the fish
    assert told[model.places_of_creeps] == pytest.approx(seen[model.places_of_creeps], abs=0.02 * pace)
    assert told == pytest.approx(seen, abs=0.05 * np.abs(seen).max())


@pytest.mark.parametrize(("name", "fish"), [("marker_offset", 1), ("lens_distortion", 1), ("joint_damping", 4)])
def test_fish_that_only_look_different_are_simulated_once(
    name: str, fish: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    simulated: list[int] = []
    inner = AffectedTwin._states

    def counted(self: AffectedTwin, runs: Runs, steps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        simulated.append(len(runs))
        return inner(self, runs, steps)

    swim = SessionModel(model().trials[:1])
    session = AffectedSession.of([catalogue()[name]], swim, CAMERA, AT)
    monkeypatch.setattr(AffectedTwin, "_states", counted)
    parameters = session.effects[0].parameters
    values = np.outer([0.0, 0.5, 1.0, 2.0], np.eye(len(parameters))[0] * parameters[0].sd)
    features = session.features(np.tile(AT, (4, 1)), values)
    assert simulated == [fish]
    assert len(np.unique(features, axis=0)) == 4
