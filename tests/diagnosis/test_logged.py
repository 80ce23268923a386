"""What a motor's log says beside a video: a crank that turned otherwise, or a camera whose clock is wrong.

On swims of the twin itself, whose commands are altered; on nothing that was ever logged beside a real swim.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from diagnosis.discrepancy import discrepancy_for
from diagnosis.evidence import Belief
from diagnosis.explaining import explained
from diagnosis.ground import Ground
from diagnosis.probabilities import Probabilities
from diagnosis.verdict import verdict_of
from fitting.signatures import Signature, signature_of
from session import FISHSIM_MARKERS
from swimmer.effects import catalogue
from synthetic import PLAUSIBLE_COEFFICIENTS
from tests.diagnosis.grounds import CAMERA, trials
from tests.fitting.exact_swims import ROBOT, exact_twin

OFF = 1.05  # times as fast as filmed the motors were told to turn
CLOCK, RATIO = "time_base_error", "drive_ratio_error"
TRIED = (CLOCK, RATIO, "joint_damping", "lens_distortion")


@cache
def plain() -> Ground:
    """Without commands: what gaits say is the same whatever the motors were told."""
    twin, told = exact_twin(1), [replace(trial, commanded_hz=None) for trial in trials()]
    return Ground.fitted(told, twin, CAMERA, discrepancy_for(FISHSIM_MARKERS, ROBOT), starts=(PLAUSIBLE_COEFFICIENTS,))


def seen(logged: float | None) -> tuple[Ground, Probabilities]:
    """With commands, and logs of so many times the filmed speed on the first trial alone; None without a log."""
    model = plain().model
    told = [replace(each.trial, commanded_hz=OFF * each.trial.frequency.hz, logged_hz=None) for each in model.trials]
    if logged is not None:
        told[0] = replace(told[0], logged_hz=logged * told[0].frequency.hz)
    beside = tuple(replace(each, trial=trial) for each, trial in zip(model.trials, told, strict=True))
    ground = replace(plain(), model=type(model)(beside))
    found = explained(ground, signatures(ground), Belief())
    return found.ground, found.probabilities


def signatures(ground: Ground) -> list[Signature]:
    return [signature_of(catalogue()[name], ground.model, CAMERA, ground.at) for name in TRIED]


def test_without_a_log_these_swims_call_for_a_gear() -> None:
    """They swim as a fish does that beats as often as was filmed; that a clock is wrong is far from excluded."""
    ground, found = seen(None)
    assert ground.model.frequencies == 2
    assert found.marginal[1] > found.marginal[0] > 0.001
    assert found.any_seen([0, 1]) > 0.99


@pytest.mark.parametrize(("logged", "name"), [(OFF, CLOCK), (1.0, RATIO)])
def test_a_log_tells_clock_from_gear(logged: float, name: str) -> None:
    """By the log the crank turned as commanded, and the clock is wrong; or it turned as filmed."""
    ground, found = seen(logged)
    assert ground.model.frequencies == 3
    assert verdict_of(found).groups == ((name,),)


@pytest.mark.long
def test_a_motor_that_warms_up_shows_in_film_and_log_alike() -> None:
    ground, _ = seen(1.0)
    sag = signature_of(catalogue()["motor_speed_sag"], ground.model, CAMERA, ground.at)
    warming = sag.beside[np.argmax(sag.values[:, 1])]
    assert abs(warming[0]) > 1e-3
    assert warming[2] == pytest.approx(warming[0])


def test_a_wrong_clock_shows_in_no_log_and_a_wrong_gear_in_both() -> None:
    ground, _ = seen(1.0)
    clock, ratio = (signature.beside[np.argmax(signature.values[:, 0])] for signature in signatures(ground)[:2])
    assert clock[0] == pytest.approx(ratio[0], rel=0.2)
    assert clock[2] == pytest.approx(0.0, abs=1e-9)
    assert ratio[2] == pytest.approx(ratio[0])
