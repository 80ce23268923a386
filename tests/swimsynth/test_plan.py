from typing import Any

import numpy as np
import pytest

from fitting.phase import sets_off_forward
from swimcal.robot import load_robot
from swimcal.twin import Twin
from swimsynth.plan import PLAUSIBLE_COEFFICIENTS, SPEEDS_HZ, Merge, SyntheticTrial, default_plan
from tests.swimsynth.plans import MOTOR, SLOW, dry_plan, small_plan

LATE = Merge(marker="tail_4", onto="tail_5", first=230, frames=20)
STRANGE = Merge(marker="tail_4", onto="tail_9", first=3, frames=20)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"trials": ()}, r"trials: found none, expected at least one"),
        ({"speed": 3}, r"speed\s+Extra inputs are not permitted"),
        ({"slow": {"name": "fast"}}, r"trials: found fast, fast, expected at least one, each with a name of its own"),
        ({"slow": {"seconds": 0.5}}, r"trial slow: found 0.5 s, expected more than 1.0 s"),
        ({"slow": {"faults": (LATE,)}}, r"trial slow: found a track fault outside its 241 frames"),
        ({"slow": {"faults": (STRANGE,)}}, r"of no marker of the plan"),
        ({"markers": ("nose", "tail_1")}, r"found nose, tail_1, expected nose, neck and more of fish_057"),
        ({"markers": ("nose", "neck", "eye")}, r"found nose, neck, eye, expected nose, neck"),
    ],
)
def test_a_plan_with_faults_is_refused_and_says_which(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        small_plan(**changes)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"dry": {"seconds": 14.0}}, r"trial dry: found 14 s, expected more than 14.2 s"),
        ({"dry": {"motor": MOTOR.model_copy(update={"drive_s": 2.0})}}, r"found a drive of 2 s, expected"),
        ({"decay": {"bent_rad": (0.2, 0.2)}}, r"trial decay: expected an angle for each hinge"),
        ({"decay": {"release_s": 3.0}}, r"a release within its 3 s"),
    ],
)
def test_dry_experiments_that_cannot_be_made_are_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        dry_plan(**changes)


@pytest.mark.parametrize(("seconds", "frames"), [(4.0, 241), (0.1, 7), (1.01, 61)])
def test_a_trial_has_a_frame_at_its_start_and_at_every_tick_up_to_its_end(seconds: float, frames: int) -> None:
    trial = SyntheticTrial(**SLOW | {"seconds": seconds})

    assert len(trial.time_s(small_plan().camera)) == frames


def test_another_robot_gets_water_in_which_it_swims_forward_from_rest() -> None:
    """With a shorter crank arm it would go backward in the water of the built-in fish, and the fit refuse the truth."""
    robot = load_robot()
    weak = robot.model_copy(update={"crank": robot.crank.model_copy(update={"arm_m": 0.03})})
    twin, slowest = Twin(weak), min(SPEEDS_HZ)
    assert not sets_off_forward(twin, np.array([PLAUSIBLE_COEFFICIENTS]), slowest)[0]

    water = default_plan(0, weak).coefficients
    assert sets_off_forward(twin, np.array([water]), slowest)[0]
    assert water._replace(kutta_lift=PLAUSIBLE_COEFFICIENTS.kutta_lift) == PLAUSIBLE_COEFFICIENTS
    assert default_plan(0, robot).coefficients == PLAUSIBLE_COEFFICIENTS == default_plan(0).coefficients
