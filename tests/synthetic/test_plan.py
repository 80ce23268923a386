from typing import Any

import pytest

from swimmer import FluidCoefficients
from synthetic import Merge, SyntheticPlan, SyntheticTrial, TrackingNoise, default_plan
from tests.synthetic.plans import SLOW, small_plan

LATE = Merge(marker="tail_4", onto="tail_5", first=230, frames=20)
STRANGE = Merge(marker="tail_4", onto="tail_9", first=3, frames=20)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"seed": -1}, r"seed\s+Input should be greater than or equal to 0"),
        ({"trials": ()}, r"trials\s+Tuple should have at least 1 item"),
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


def test_all_faults_of_a_plan_are_told_at_once() -> None:
    with pytest.raises(ValueError) as caught:
        small_plan(slow={"seconds": 0.5, "faults": (LATE,)}, markers=("nose", "neck", "eye"))

    for part in ("'eye'", "0.5 s", "frame 249", "'tail_4'", "'tail_5'"):
        assert part in str(caught.value)


def test_negative_noise_is_refused() -> None:
    with pytest.raises(ValueError, match=r"sd_px\s+Input should be greater than or equal to 0"):
        TrackingNoise(sd_px=-0.1)


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


def test_the_seed_decides_phases_and_headings_of_the_default_plan() -> None:
    assert default_plan(1) == default_plan(1)
    assert default_plan(1).trials != default_plan(2).trials


def test_a_plan_survives_its_json() -> None:
    plan = default_plan(4)

    assert SyntheticPlan.model_validate_json(plan.model_dump_json()) == plan
