from typing import Any

import pytest

from swimmer import FluidCoefficients
from synthetic import SyntheticTrial, default_plan
from synthetic.trials import Merge
from tests.synthetic.plans import MOTOR, SLOW, dry_plan, small_plan

LATE = Merge(marker="tail_4", onto="tail_5", first=230, frames=20)
STRANGE = Merge(marker="tail_4", onto="tail_9", first=3, frames=20)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"seed": -1}, r"seed\s+Input should be greater than or equal to 0"),
        ({"trials": ()}, r"trials: found none, expected at least one of trials, dry_runs or free_decays"),
        ({"speed": 3}, r"speed\s+Extra inputs are not permitted"),
        ({"slow": {"frequency_hz": 0.0}}, r"frequency_hz\s+Input should be greater than 0"),
        ({"slow": {"phase_rad": float("nan")}}, r"phase_rad\s+Input should be a finite number"),
        ({"slow": {"role": "test"}}, r"role\s+Input should be 'fit' or 'holdout'"),
        ({"slow": {"name": "a/b"}}, r"name\s+not a usable name"),
        ({"slow": {"name": "fast"}}, r"trials: found fast, fast, expected a name of its own for each"),
        ({"slow": {"seconds": 0.5}}, r"trial slow: found 0.5 s, expected more than 1 s of warm-up"),
        (
            {"slow": {"faults": (LATE,)}},
            r"trial slow, merged_markers: found frame 249, expected frames 0 to 240",
        ),
        ({"slow": {"faults": (STRANGE,)}}, r"found marker 'tail_9', expected one of nose, neck, dorsal_fin"),
        ({"markers": ("nose", "tail_1", "tail_1")}, r"one is named twice.*neck missing, expected both"),
        ({"markers": ("nose", "neck", "eye")}, r"found 'eye', expected markers of fish_057: nose, neck"),
        (
            {"coefficients": FluidCoefficients(0.5, -2.0, 1.0, 1.0, 1.0)},
            r"coefficients.slender_drag: found -2.0, expected a number from 0",
        ),
    ],
)
def test_a_plan_with_faults_is_refused_and_says_which(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        small_plan(**changes)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"dry": {"seconds": 14.0}},
            r"found 14 s, expected at least 14.2 s: the video shows the motor's codes",
        ),
        (
            {"dry": {"motor": MOTOR.model_copy(update={"drive_s": 2.0})}},
            r"found a drive of 2 s, expected more",
        ),
        ({"dry": {"name": "decay"}}, r"trials: found decay, decay, expected a name of its own for each"),
        ({"dry": {"faults": (STRANGE,)}}, r"trial dry, merged_markers: found marker 'tail_9'"),
        ({"decay": {"faults": (LATE,)}}, r"trial decay, merged_markers: found frame 249, expected frames 0 to 180"),
        (
            {"decay": {"bent_rad": (0.2, 0.2)}},
            r"bent_rad: found 2 angles, expected one for each of 5 hinges",
        ),
        ({"decay": {"release_s": 3.0}}, r"trial decay: found a release at 3 s, expected it within 3 s"),
    ],
)
def test_dry_experiments_that_cannot_be_made_are_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        dry_plan(**changes)


def test_all_faults_of_a_plan_are_told_at_once() -> None:
    with pytest.raises(ValueError) as caught:
        small_plan(slow={"seconds": 0.5, "faults": (LATE,)}, markers=("nose", "neck", "eye"))

    for part in ("'eye'", "0.5 s", "frame 249", "'tail_4'", "'tail_5'"):
        assert part in str(caught.value)


@pytest.mark.parametrize(("seconds", "frames"), [(4.0, 241), (0.1, 7), (1.01, 61)])
def test_a_trial_has_a_frame_at_its_start_and_at_every_tick_up_to_its_end(seconds: float, frames: int) -> None:
    trial = SyntheticTrial(**SLOW | {"seconds": seconds})

    assert len(trial.time_s(small_plan().camera)) == frames


def test_the_default_plan_has_five_speeds_both_roles_and_one_fault() -> None:
    plan = default_plan(3)

    assert len({trial.frequency_hz for trial in plan.trials}) == 5
    assert [trial.role for trial in plan.trials].count("fit") == 2
    assert sum(len(trial.faults) for trial in plan.trials) == 1
    assert all(0.95 < trial.frequency_hz / trial.commanded_hz < 1 for trial in plan.trials)
