import math

from calib.capture.trials import TrialPlan


def test_a_trial_is_framed_by_the_codes_and_driven_as_long_as_asked() -> None:
    plan = TrialPlan("x", 0.8, 20.0)
    parts = list(dict.fromkeys(step.part for step in plan.steps()))
    assert parts == ["rest", "start_code", "drive", "end_code"]
    assert [(s.turns_per_s, s.seconds) for s in plan.steps() if s.part == "drive"] == [(0.8, 20.0)]
    assert math.isclose(plan.total_s, 20 + 2 * 4 + 0.5 + 0.5 + 1.0 + 0.5)
    assert list(plan.steps())[-1].turns_per_s == 0
