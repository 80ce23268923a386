"""What is said where no name is."""

from __future__ import annotations

import pytest

from diagnosis.result import FittedParameter
from diagnosis.sentences import at_stage, where, which
from reports.caveats import gap_caveats
from reports.words import Change, effect_size, how_far
from tests.reports.diagnoses import made_diagnosed

_OTHER = {"none_of_these": 0.95}


@pytest.mark.parametrize(
    ("chances", "said"),
    [
        ({"background_current": 0.54, "scale_error": 0.02, "none_of_these": 0.38}, "looks most like"),
        ({"background_current": 0.2, "scale_error": 0.19, "none_of_these": 0.3}, "no effect stands out"),
        ({"background_current": 0.96, "scale_error": 0.95, "none_of_these": 0.1}, "many at once"),
        ({"background_current": 0.1, "none_of_these": 0.8}, "no effect of the catalogue explains it"),
    ],
)
def test_an_unexplained_gap_is_told_by_what_it_looks_like(chances: dict[str, float], said: str) -> None:
    assert said in which(made_diagnosed("unexplained", probabilities=chances))


@pytest.mark.parametrize(
    ("shares", "said"),
    [
        ({"nose": 0.1, "neck": 0.1, "caudal_fin": 0.7}, "in how the markers move, most at caudal fin."),
        (
            {"nose": 0.2, "neck": 0.2, "caudal_fin": 0.25, "speed": 0.3},
            "in how the markers move, along the whole fish.",
        ),
        ({"nose": 0.1, "neck": 0.1, "frequency": 0.7}, "mostly in the beat frequency."),
    ],
)
def test_markers_count_together_where_it_shows(shares: dict[str, float], said: str) -> None:
    """A number of the whole trial is named where it holds more than all markers, not more than any one."""
    assert where(made_diagnosed("named", where={"by_marker": shares})).endswith(f"; it shows {said}")


@pytest.mark.parametrize("verdict", ["named", "inseparable", "unexplained", "no_gap"])
def test_the_answers_hold_no_share_of_the_gap(verdict: str) -> None:
    """Shares have denominators of their own: the answers say millimetres, mm/s and mHz before and after."""
    data = made_diagnosed(verdict)
    assert "%" not in "".join((where(data), which(data), how_far(data)))


@pytest.mark.parametrize(
    ("ends", "said"),
    [((0.1, 0.3), "x 0.1 to 0.3 m"), ((0.21, 0.24), "x 0.21 to 0.24 m"), ((0.201, 0.202), "x 0.20 m as before")],
)
def test_a_change_has_a_digit_more_where_both_ends_would_look_alike(ends: tuple[float, float], said: str) -> None:
    assert Change("x", "m", *ends).text == said


@pytest.mark.parametrize("chance", [0.4, 0.6])
def test_the_place_of_a_stranger_is_told_where_it_is_sure(chance: float) -> None:
    """Alike in all trials or not, it is the same place."""
    split = [
        {"place": "marker tail_4", "same_in_all_trials": same, "probability": chance / 2} for same in (True, False)
    ]
    data = made_diagnosed("unexplained", probabilities=_OTHER, evidence={"elsewhere": split})
    said = "something that no catalogue holds acts on the marker tail 4" in which(data)
    assert said == (chance > 0.5)


def test_a_gap_of_noise_has_no_stage() -> None:
    by_stage = {"camera": 0.001, "drive": 0.0, "body": 0.0, "tail": 0.0, "floor": 0.999}
    data = made_diagnosed("unexplained", where={"by_stage": by_stage})
    assert where(data) == "Where: in nothing that repeats with the beat."


def test_beside_a_beat_that_is_off_its_command_the_motion_has_a_place_of_its_own() -> None:
    by_stage = {"camera": 0.04, "drive": 0.85, "body": 0.1, "tail": 0.01, "floor": 0.0}
    shares = {"by_stage": by_stage, "by_marker": {"nose": 0.1, "frequency": 0.9}}
    told = where(made_diagnosed("unexplained", where=shares))
    assert told.endswith("mostly in the beat frequency; of the motion itself mostly in the forces on the whole fish.")
    by_stage["body"], by_stage["camera"], by_stage["tail"], by_stage["drive"] = 0.001, 0.001, 0.0, 0.998
    assert where(made_diagnosed("unexplained", where=shares)).endswith("mostly in the beat frequency.")


@pytest.mark.parametrize("noise", [0.4, 0.6])
def test_a_stage_is_not_all_where_noise_is_larger(noise: float) -> None:
    by_stage = {"camera": 0.0, "drive": 1 - noise, "body": 0.0, "tail": 0.0, "floor": noise}
    told = where(made_diagnosed("unexplained", where={"by_stage": by_stage}))
    assert told.startswith("Where: mostly in clock and drive")
    assert ("though noise is larger" in told) == (noise > 0.5)


@pytest.mark.parametrize(
    ("chances", "said"),
    [
        ({"wave_drag": 0.5, "tendon_slack": 0.49}, "; wave drag and tendon slack help most, although not enough"),
        ({"wave_drag": 0.5}, "; wave drag helps most, although not enough"),
        ({}, "something else acts; see"),
    ],
)
def test_what_helps_most_does_not_say_whether_it_acts_together(chances: dict[str, float], said: str) -> None:
    """Effects that act at once and alternatives are told alike, as only their single probabilities are known."""
    adequate = {"p_value": 1e-5, "squares": 900.0, "numbers": 500}
    assert said in which(made_diagnosed("unexplained", probabilities=chances | _OTHER, adequate=adequate, stages={}))


@pytest.mark.parametrize(
    ("chance", "likeliest", "said"),
    [
        (
            0.65,
            "none_of_these",
            "of 0.65, and an alarm needs 0.98; the likeliest is something that no catalogue holds (0.60)",
        ),
        (0.65, "tendon_slack", "the likeliest is tendon slack (0.60)"),
        (0.4, "tendon_slack", ""),
    ],
)
def test_a_gap_that_just_misses_the_alarm_is_told(chance: float, likeliest: str, said: str) -> None:
    chances = {"scale_error": 0.02, "none_of_these": 0.1} | {likeliest: 0.6}
    told = which(made_diagnosed("no_gap", no_gap_probability=1 - chance, probabilities=chances))
    assert said in told
    assert ("near miss" in told) == bool(said)


@pytest.mark.parametrize(
    ("verdict", "before"), [("unexplained", "looks like"), ("named", "; not"), ("no_gap", "look like")]
)
def test_names_that_trials_left_out_speak_against_are_told_as_that(verdict: str, before: str) -> None:
    against = {"effects": ["fluid_memory", "wave_drag"], "shrinkage": -0.8, "shrinkage_ci95": [-1.6, -0.1]}
    told = made_diagnosed(verdict, evidence={"refuted": [against]})
    why = "but with that fitted swims are forecast worse from the others (their gap grows by 80 %, 10 % to 160 %)"
    assert f"{before} fluid memory or wave drag, {why}" in which(told)
    told = made_diagnosed(verdict, evidence={"refuted": [{"effects": ["wave_drag"], "held_out_mm": [2.2, 4.21]}]})
    why = "but with that held-out swims are forecast worse (2.2 to 4.2 mm)"
    assert f"{before} wave drag, {why}" in which(told)


@pytest.mark.parametrize(("interval", "warns"), [([-0.1, 0.3], True), ([0.05, 0.3], False), (None, True)])
def test_beside_the_twins_speeds_stands_the_line_and_what_does_not_surely_improve_is_no_model(
    interval: list[float] | None, warns: bool
) -> None:
    gap = {"shrinkage": 0.1, "shrinkage_ci95": interval, "speed_mae_baselines": {"line": 0.0056}}
    said = how_far(made_diagnosed("named", gap=gap))
    assert "mm/s (a line in frequency: 5.6)" in said
    assert said.endswith("Do not use it for forecasts.") == warns


@pytest.mark.parametrize("shrinkage", [0.5, None])
def test_effects_that_forecast_beats_worse_are_no_model_whatever_else_they_do(shrinkage: float | None) -> None:
    interval = None if shrinkage is None else [0.3, 0.6]
    gap = {"shrinkage": shrinkage, "shrinkage_ci95": interval, "frequency_mae_before": 0.25}
    for after, worse in ((0.666, True), (0.252, False)):
        told = made_diagnosed("named", gap=gap | {"frequency_mae_after": after})
        assert how_far(told).endswith("for forecasts.") == worse
        assert any("held-out beats are forecast worse: 666.0 mHz off" in each for each in gap_caveats(told)) == worse


def test_a_direction_is_named_as_it_points() -> None:
    parameters = {
        "background_current": {name: fitted(name, value) for name, value in (("right", -5e-3), ("down", 2e-3))}
    }
    assert effect_size(parameters, "background_current") == "left 5.0 (4.0 to 6.0) mm/s, down 2.0 (1.0 to 3.0) mm/s"


def fitted(name: str, value: float) -> FittedParameter:
    return FittedParameter(value, (value - 0.001, value + 0.001), "m/s", at_bound=False, parameter=name)


@pytest.mark.parametrize(
    ("stage", "share", "said"),
    [
        ("water", 0.9, "most probably in the water (0.97), beside a beat frequency that is off"),
        ("water", 0.2, "most probably in the water (0.97)"),
        ("drive", 0.9, "most probably in motor or clock (0.97)"),
    ],
)
def test_a_beat_frequency_is_told_beside_an_unknown_effect_that_does_not_make_it(
    stage: str, share: float, said: str
) -> None:
    where = {"by_marker": {"frequency": share, "nose": 1 - share}}
    adequate = {"p_value": 1e-9, "squares": 900.0, "numbers": 300}
    found = made_diagnosed("unexplained", where=where, adequate=adequate, stages={stage: 0.97})
    assert at_stage(found) == said
