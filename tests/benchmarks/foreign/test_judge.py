"""The judge finds a planted wrong number, traceback or silence, and accepts a flagged one."""

import copy
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from benchmarks.cases import Run, write_lines
from benchmarks.foreign.disturbances import KINDS, apply
from benchmarks.foreign.judge import Verdict, judge, judge_results
from benchmarks.foreign.recordings import Recordings
from benchmarks.foreign.report import LINES, ForeignOutcome, measure_foreign
from tests.benchmarks.foreign.handmade import COEFFICIENTS, SPEED_M_S, session

RUN = Verdict(0, 0, "drawn", (), ("fit",), 0, 1.0)
NAMES = ("blunt_drag", "slender_drag", "angular_drag", "kutta_lift", "magnus_lift")


def right(made: Recordings) -> dict:
    """What the program would write were it right about everything."""
    forecast = {
        "speed": SPEED_M_S,
        "speed_ci90": [0.09, 0.11],
        "marker_error_mm": 4.0,
        "shape_error_mm": 4.0,
        "inside": 0.9,
    }
    ebt = dict.fromkeys(("speed_ebt", "speed_ebt_large", "speed_ebt_smoothed", "speed_twin"), SPEED_M_S)
    trial = {"speed_measured": SPEED_M_S, "frequency_se_hz": 0.001, "flags": [], **ebt}
    structure = (("hinge_stiffness", 0.65, None), ("hinge_damping", 0.02, None), ("crank_arm", 0.0395, 1e-4))
    model = {"holdout": "given_frequency", "fit": "repeat"}
    return {
        "trials": {swim.name: {**trial, "role": swim.role, "frequency_hz": swim.hz} for swim in made.swims},
        "flags": [],
        "fit": {
            "coefficients": dict(zip(NAMES, COEFFICIENTS, strict=True)),
            "interval": [[0.9 * value, 1.1 * value] for value in COEFFICIENTS],
            "flags": [],
        },
        "forecasts": {"trials": {swim.name: {"forecasts": {model[swim.role]: dict(forecast)}} for swim in made.swims}},
        "structure": {name: {"value": value, "se": se, "trials": []} for name, value, se in structure},
    }


def judged(folder: Path, made: Recordings, results: dict, text: str = "", code: int = 0) -> Verdict:
    (folder / "results").mkdir(exist_ok=True)
    if results:
        (folder / "results" / "calibration.json").write_text(json.dumps(results))
    return judge_results(made, folder, replace(RUN, code=code, disturbances=tuple(made.disturbances)), text)


def test_right_numbers_are_right(tmp_path: Path) -> None:
    verdict = judged(tmp_path, session(), right(session()))
    assert not verdict.short
    assert verdict.judged > 20
    assert verdict.flags == ()


def _forecast(results: dict, trial: str, model: str) -> dict:
    return results["forecasts"]["trials"][trial]["forecasts"][model]


PLANTED = {
    "swim_a frequency": lambda results: results["trials"]["swim_a"].update(frequency_hz=0.8 + 0.0045),
    "swim_b measured speed": lambda results: results["trials"]["swim_b"].update(speed_measured=1.03 * SPEED_M_S),
    "swim_c speed_ebt": lambda results: results["trials"]["swim_c"].update(speed_ebt=-1e4),
    "coefficient kutta_lift": lambda results: results["fit"].update(
        coefficients=results["fit"]["coefficients"] | {"kutta_lift": 3.0},
        interval=[*results["fit"]["interval"][:3], [2.6, 3.4], results["fit"]["interval"][4]],
    ),
    "swim_b given_frequency speed": lambda results: _forecast(results, "swim_b", "given_frequency").update(
        speed=0.2, speed_ci90=[0.19, 0.21]
    ),
    "swim_b given_frequency bands": lambda results: _forecast(results, "swim_b", "given_frequency").update(inside=0.1),
    "swim_a repeat markers": lambda results: _forecast(results, "swim_a", "repeat").update(marker_error_mm=2.6e6),
    "crank_arm": lambda results: results["structure"]["crank_arm"].update(value=0.0391 - 1e-4),
}


@pytest.mark.parametrize("what", PLANTED)
def test_a_planted_wrong_number_is_found_and_a_flag_excuses_it(tmp_path: Path, what: str) -> None:
    made, results = session(), right(session())
    PLANTED[what](results)
    verdict = judged(tmp_path, made, results)
    assert [each.split(":")[0] for each in verdict.wrong] == [what]
    assert verdict.short
    flagged, no_excuse = copy.deepcopy(results), copy.deepcopy(results)
    name = what.split()[0]
    place = flagged["trials"][name]["flags"] if name in flagged["trials"] else flagged["flags"]
    place.append({"kind": "poor_fit", "markers": [], "frames": None, "message": "not to be trusted"})
    excused = judged(tmp_path, made, flagged)
    assert excused.wrong == ()
    assert excused.excused[0].startswith(what)
    assert excused.excused[0].endswith("[poor_fit]")
    of_tracks = no_excuse["trials"][name]["flags"] if name in no_excuse["trials"] else no_excuse["flags"]
    of_tracks.append({"kind": "gap", "markers": [], "frames": [1, 2], "message": "samples are missing"})
    no_excuse["flags"].append({"kind": "ebt_ratio_only", "markers": [], "frames": None, "message": "as always"})
    assert judged(tmp_path, made, no_excuse).wrong == verdict.wrong


def test_numbers_within_four_standard_errors_are_right(tmp_path: Path) -> None:
    results = right(session())
    results["trials"]["swim_a"]["frequency_hz"] += 0.0039
    results["fit"]["coefficients"]["kutta_lift"] *= 1 + 0.1 * 2.4
    results["fit"]["interval"][3] = [4.96 - 0.4, 4.96 + 0.4]
    results["forecasts"]["trials"]["swim_b"]["forecasts"]["given_frequency"].update(speed=0.124)
    results["forecasts"]["trials"]["swim_b"]["forecasts"]["given_frequency"].update(speed_ci90=[0.114, 0.134])
    assert not judged(tmp_path, session(), results).short


@pytest.mark.parametrize(
    ("code", "text"),
    [
        (1, "Traceback (most recent call last):\n  File x\nIndexError: index 3 is out of bounds"),
        (2, "calib: LinAlgError: Singular matrix"),
        (2, "calib: the twin diverged from every start; look into the flags of the fit trials"),
        (124, "calib: fitting\nstill running after 900 s"),
        (0, "RuntimeWarning: invalid value encountered in divide"),
    ],
)
def test_words_of_the_inside_are_found_whatever_the_exit_status(tmp_path: Path, code: int, text: str) -> None:
    assert judged(tmp_path, session(), right(session()), text, code).broken


def test_a_refusal_is_right_only_where_nothing_else_is(tmp_path: Path) -> None:
    made = session()
    assert judged(tmp_path, made, {}, "calib: trial swim_a: too short", 2).unsaid
    made.refusable = True
    assert not judged(tmp_path, made, {}, "calib: trial swim_a: too short", 2).short
    made.refused = True
    assert judged(tmp_path, made, right(made)).unsaid == ("not refused",)


def test_a_posterior_that_is_refused_leaves_the_fit_to_be_judged(tmp_path: Path) -> None:
    made, results = session(), right(session())
    results["trials"]["swim_a"]["frequency_hz"] = 0.9
    verdict = judged(tmp_path, made, results, "calib: sampling\ncalib: the draws do not agree", 2)
    assert verdict.refusal == "calib: the draws do not agree"
    assert len(verdict.wrong) == 1
    assert verdict.unsaid == ()


def test_a_speed_is_held_against_its_own_standard_error_where_it_states_one(tmp_path: Path) -> None:
    made, results = session(), right(session())
    results["trials"]["swim_b"].update(speed_measured=1.03 * SPEED_M_S, speed_measured_se=0.01 * SPEED_M_S)
    assert not judged(tmp_path, made, results).short


def test_a_trial_that_is_left_out_or_rests_has_to_be_named(tmp_path: Path) -> None:
    made, results = session(), right(session())
    made.trials[1].said = "it rests"
    del results["trials"]["swim_b"]
    assert len(judged(tmp_path, made, results).unsaid) == 2
    results["flags"].append({"kind": "not_used", "markers": [], "frames": None, "message": "swim_b rests: left out"})
    assert not judged(tmp_path, made, results).short


def test_flags_on_clean_trials_are_counted_but_for_those_that_are_true(tmp_path: Path) -> None:
    made, results = session(), right(session())
    results["trials"]["swim_b"]["flags"] = [
        {"kind": "gap", "message": "missing"},
        {"kind": "suspect", "message": "odd"},
    ]
    assert judged(tmp_path, made, results).flags == ("swim_b: suspect: odd",)
    results["trials"]["swim_b"]["flags"] = [{"kind": "extrapolated", "message": "outside"}]
    assert judged(tmp_path, made, results).flags == ("swim_b: extrapolated: outside",)
    made.trials[1].hz = results["trials"]["swim_b"]["frequency_hz"] = 1.9
    assert judged(tmp_path, made, results).flags == ()


def test_a_flag_of_a_noisy_tail_or_a_swim_far_beyond_the_fitted_is_needless_only_where_it_is_false(
    tmp_path: Path,
) -> None:
    made, results = session(), right(session())
    swim = made.swims[1]
    swim.time_s = np.arange(0.0, 3.0, 1 / 60)
    swim.xy = CubicSpline(swim.pool_s, swim.pool_px)(swim.time_s)
    results["trials"]["swim_b"]["flags"] = [
        {"kind": "ebt_noise", "message": "mostly noise"},
        {"kind": "left_out", "message": "it beats more than 3 times beyond the fitted"},
    ]
    assert len(judged(tmp_path, made, results).flags) == 2
    swim.xy = swim.xy + np.random.default_rng(1).normal(0.0, 20.0, swim.xy.shape)
    swim.hz = results["trials"]["swim_b"]["frequency_hz"] = 9.0
    assert judged(tmp_path, made, results).flags == ()


def test_lines_of_several_runs_add_up_and_decide_the_exit_status(tmp_path: Path) -> None:
    clean = [replace(RUN, number=3 * i) for i in range(60)]
    write_lines(tmp_path / LINES, clean)
    outcome = measure_foreign(tmp_path, 0, [0, 3], Run(workers=1))
    assert len(outcome.sessions) == 60
    assert not outcome.falls_short
    assert not ForeignOutcome((*clean[1:], replace(RUN, flags=("a: odd",)))).falls_short
    assert ForeignOutcome((*clean[2:], *(replace(RUN, number=i, flags=("a: odd",)) for i in (0, 3)))).falls_short
    wrong = replace(RUN, number=1, disturbances=("rests: swim_a, rests throughout",), wrong=("swim_a frequency: 3",))
    assert ForeignOutcome((*clean, wrong)).falls_short
    text = ForeignOutcome((*clean, wrong)).scores("command").text()
    assert "swim_a frequency: 3" in text
    assert "| rests | 1 | 1 |" in text


@pytest.mark.long
def test_the_program_itself_is_run_and_judged(tmp_path: Path) -> None:
    made = session()
    apply(made, next(kind for kind in KINDS if kind.name == "milliseconds"), np.random.default_rng(0))
    made.write(tmp_path / "made")
    verdict = judge(made, tmp_path / "made", 0, 1, ("fit",))
    assert verdict.code == 2
    assert "time_s" in verdict.refusal
    assert not verdict.short
    assert "time_s" in (tmp_path / "made" / "terminal.txt").read_text()


@pytest.mark.long
def test_a_whole_session_is_drawn_fitted_and_judged_once(tmp_path: Path) -> None:
    outcome = measure_foreign(tmp_path, 2, [0], Run(workers=1), tmp_path / "kept")
    assert [each.judged > 15 for each in outcome.sessions] == [True]
    assert (tmp_path / "kept" / "session_2_0" / "results" / "calibration.json").is_file()
    assert measure_foreign(tmp_path, 2, [0], Run(workers=1)) == outcome
