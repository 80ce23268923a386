"""A diagnosis on the terminal: what is doubtful is caveat, and each experiment once."""

from dataclasses import replace

import pytest

from calib.results.gap import diagnosis_lines
from calib.results.gap import test_lines as lines_of_test
from diagnosis.result import DiagnosisResult, EffectTestResult, Experiment
from tests.reports.diagnoses import made_diagnosed

CLOCK = "time_base_error"


def checks(data: DiagnosisResult) -> list[str]:
    """Beside that of two swims none can be left out, and that the named effects leave more than noise."""
    always = ("Two trials", "something else is missing")
    return [
        line for line in diagnosis_lines(data) if line.startswith("! ") and not any(each in line for each in always)
    ]


def beating(at: float, verdict: str = "named", named: tuple[str, ...] = (CLOCK,)) -> DiagnosisResult:
    """Tails beat at so much of their command."""
    frequencies = {"medium": {"commanded_hz": 1.0, "measured_hz": at}, "fast": {"commanded_hz": None, "measured_hz": 1}}
    reported = {"groups": [[name] for name in named], "effects": named, "effect_parameters": {}}
    return made_diagnosed(verdict, frequencies=frequencies, **reported)


def test_an_effect_at_its_bound_and_a_shorter_catalogue_are_to_be_checked() -> None:
    bound, lacking = sorted(
        checks(made_diagnosed(withheld_from_catalogue=["scale_error"])), key=lambda x: "made without" in x
    )
    assert "wave drag (high)" in bound
    assert "low" not in bound
    assert "without scale error" in lacking


@pytest.mark.parametrize(("at", "caveat"), [(0.5, "50 % slower"), (1.2, "20 % faster")])
def test_a_clock_or_gear_that_is_far_off_may_be_a_number_of_the_session(at: float, caveat: str) -> None:
    (reported,) = checks(beating(at))
    assert caveat in reported
    assert "fps" in reported
    assert checks(beating(0.97)) == []
    (reported,) = checks(beating(at, "unexplained", ()))
    assert caveat in reported


def test_what_the_named_effects_leave_beyond_noise_is_a_caveat() -> None:
    data = made_diagnosed()
    assert data.remainder is not None
    noise = replace(data, remainder=replace(data.remainder, p_value=0.3))
    told = [[line for line in diagnosis_lines(each) if "something else is missing" in line] for each in (data, noise)]

    assert [len(lines) for lines in told] == [1, 0]


def test_a_single_fitted_swim_is_reported_to_be_little() -> None:
    data = made_diagnosed("unexplained")
    data = replace(data, missing_forces=replace(data.missing_forces, trials=("fast",)))
    assert any("One trial was fitted" in line for line in checks(data))


def test_names_that_no_trial_left_out_could_check_are_reported_to_be_unchecked() -> None:
    caveat = "cross-validation of the named effects needs three"
    assert any(caveat in line for line in diagnosis_lines(made_diagnosed("named")))
    checked = {"cross_validation": {"trials": ["a", "b", "c"], "shrinkage": 0.4, "shrinkage_ci95": [0.1, 0.6]}}
    assert not any(caveat in line for line in diagnosis_lines(made_diagnosed("named", evidence=checked)))


def test_an_experiment_is_reported_once_with_all_that_it_tells_apart() -> None:
    pairs = {("tendon_slack", "tendon_friction"): 0.1, ("wave_drag", CLOCK): 0.04, ("wave_drag", "tendon_slack"): 0.3}
    experiments = tuple(Experiment("Film a swim at 0.8 Hz", pair, error) for pair, error in pairs.items())
    data = replace(made_diagnosed("inseparable"), next_experiments=experiments)
    reported = [line for line in diagnosis_lines(data) if line.startswith("next: ")]
    assert reported == [
        "next: Film a swim at 0.8 Hz (separates tendon slack from tendon friction, expected error 10%; "
        "wave drag from time base error, expected error 4%)"
    ]


def test_all_names_of_a_verdict_stand_in_the_table_however_many_are_likelier() -> None:
    likelier = {f"effect_{i}": 0.9 - 0.01 * i for i in range(8)}
    data = made_diagnosed("named", probabilities=likelier | {"wave_drag": 0.3, "none_of_these": 0.0})
    lines = diagnosis_lines(data)
    assert any(line.startswith("wave_drag ") for line in lines)
    assert not any(line.startswith("effect_7 ") for line in lines)


def test_numbers_have_the_digits_of_their_interval_and_ratios_no_unit() -> None:
    one = {"value": -0.25051, "ci95": [-0.2526, -0.2484], "unit": "1", "at_bound": False, "parameter": "relative"}
    data = made_diagnosed("named", effect_parameters={"wave_drag": one})
    (line,) = (line for line in diagnosis_lines(data) if line.startswith("wave_drag "))
    assert line.endswith("relative −0.2505 (−0.2526 to −0.2484)")


def test_a_supposed_gap_that_grows_is_reported_to_grow() -> None:
    gap = made_diagnosed("named", gap={"shrinkage": -0.04, "shrinkage_ci95": [-0.25, 0.2]}).gap
    reported = EffectTestResult(("wave_drag",), 1.4, {"wave_drag": 1.4}, {}, gap, gap)
    assert lines_of_test(reported)[-1] == "The held-out gap grows by 4 % (95 % interval −20 % to 25 %)."
