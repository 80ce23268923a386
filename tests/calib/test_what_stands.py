"""Commands use what stands: showing computes nothing, what computes replaces its own results alone; damaged ones."""

from dataclasses import replace
from hashlib import sha256
from pathlib import Path

import pytest

import calib as front
from swimcal.errors import InputError
from swimgym import load_fish
from tests.calib.door import Front, assert_reports, edit
from tests.cases import later

OF_FIT = {"calibration.json", "calibrated.xml", "report.html"}
OF_POSTERIOR = {"posterior.nc", "posterior.json"}
OF_DIAGNOSIS = {"diagnosis.json"}


def results(folder: Path) -> dict[str, str]:
    """The hash of each result, but for records of the work itself."""
    found = (folder / "results").rglob("*")
    return {
        path.relative_to(folder / "results").as_posix(): sha256(path.read_bytes()).hexdigest()
        for path in found
        if path.is_file() and not path.name.startswith(".")
    }


def changed(before: dict[str, str], after: dict[str, str]) -> set[str]:
    return {name for name in before.keys() | after.keys() if before.get(name) != after.get(name)}


COMMANDS: tuple[tuple[tuple[str, ...], set[str]], ...] = (
    (("report",), set()),
    (("mjcf", "--out", "{out}"), set()),
    (("view",), {"session.rrd"}),
    (("doctor",), set()),
    (("track",), set()),
    (("fit", "--effort", "quick"), set()),
    (("posterior", "--effort", "quick"), set()),
    (("diagnose", "--effort", "quick"), set()),
    (("run", "--effort", "quick", "--until", "fit"), set()),
)
"""With what each may change of a finished session."""


@pytest.mark.long
def test_after_any_command_no_other_changes_what_stands(calib: Front, whole: Path, tmp_path: Path) -> None:
    before = results(whole)
    for first, _ in COMMANDS:
        for second, _ in COMMANDS:
            for name, *options in (first, second):
                calib(name, whole, *(option.format(out=tmp_path / "fish.xml") for option in options))
            assert changed(before, results(whole)) <= {"session.rrd"}, (first, second)


@pytest.mark.parametrize(("command", "own"), COMMANDS, ids=lambda value: value[0] if isinstance(value, tuple) else "")
def test_what_stands_is_used_whatever_its_effort(
    calib: Front, whole: Path, command: tuple[str, ...], own: set[str], tmp_path: Path
) -> None:
    before, (name, *options) = results(whole), command
    outcome = calib(name, whole, *(option.format(out=tmp_path / "fish.xml") for option in options))
    assert outcome.code == 0, outcome.err
    assert changed(before, results(whole)) == own
    if name == "mjcf":
        assert (tmp_path / "fish.xml").read_bytes() == (whole / "results" / "calibrated.xml").read_bytes()
        assert "quick effort" in outcome.out


@pytest.mark.long
@pytest.mark.parametrize(
    ("command", "own", "kept"),
    [
        ("fit", OF_FIT | OF_POSTERIOR | OF_DIAGNOSIS, OF_FIT | OF_POSTERIOR | OF_DIAGNOSIS),
        ("posterior", OF_POSTERIOR | {"calibration.json"}, OF_POSTERIOR),
        ("diagnose", OF_DIAGNOSIS, OF_DIAGNOSIS),
    ],
)
def test_another_effort_replaces_its_own_results_and_keeps_them_aside(
    calib: Front, whole: Path, command: str, own: set[str], kept: set[str]
) -> None:
    before = results(whole)
    outcome = calib(command, whole, "--effort", "full")
    assert outcome.code == 0, outcome.err
    after = results(whole)
    aside = {Path(name).name: value for name, value in after.items() if name.startswith("kept/")}
    assert kept <= aside.keys()
    assert all(aside[name] == before[name] for name in kept)
    touched = {name for name in changed(before, after) if not name.startswith(("kept/", "calibrated+"))}
    assert touched <= own
    assert str(whole / "results" / "kept") in outcome.out


@pytest.mark.long
def test_the_next_step_is_the_report_only_where_it_does_not_stand(calib: Front, whole: Path) -> None:
    calib("report", whole)
    assert "calib report" not in calib("diagnose", whole).out
    page = whole / "results" / "report.html"
    page.write_text(page.read_text() + " ")
    assert f"Next: the report is out of date: calib report {whole}" in calib("diagnose", whole).out
    page.unlink()
    assert f"Next: calib report {whole}" in calib("diagnose", whole).out


def test_without_a_fit_what_shows_says_how_to_make_one(calib: Front, fresh: Path, tmp_path: Path) -> None:
    shows = (
        ("report", fresh),
        ("mjcf", fresh, "--out", tmp_path / "fish.xml"),
    )
    for command in shows:
        assert_reports(calib(*command), "there is no fit", f"calib fit {fresh}")
    assert not (tmp_path / "fish.xml").exists()


def test_a_fit_that_is_out_of_date_is_named_and_left_alone(calib: Front, whole: Path, tmp_path: Path) -> None:
    edit(whole / "session.toml", "[fit]", "[fit]\nseed = 7")
    before = results(whole)
    for command in (("report", whole), ("mjcf", whole, "--out", tmp_path / "fish.xml")):
        assert_reports(calib(*command), "out of date", "a change of session.toml;", f"calib fit {whole}")
    assert results(whole) == before


def test_columns_of_trials_are_as_wide_as_the_longest_name(whole: Path) -> None:
    found = front.fit(whole, progress=False)
    trials = dict(zip(("slow_against_the_current", "fast"), found.trials.values(), strict=True))
    head, *rows = replace(found, data=replace(found.data, trials=trials)).details()[:3]
    assert {line.index(word) for line, word in zip((head, *rows), ("role", "fit", "holdout"), strict=True)} == {25}


def cut(path: Path, share: float) -> None:
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])


@pytest.mark.parametrize(("command", "share"), [("report", 0.0), ("mjcf", 0.97)])
def test_a_fit_cut_short_is_called_incomplete(command: str, share: float, finished: Path, calib: Front) -> None:
    cut(finished / "results" / "calibration.json", share)
    out = ("--out", finished / "out.xml") if command == "mjcf" else ()
    outcome = calib(command, finished, *out)
    assert_reports(outcome, "the fit is incomplete; found calibration.json, whose end is missing", "Run `calib fit ")
    assert "the fit is incomplete" in calib("doctor", finished).out
    with pytest.raises(InputError, match=r"calibration\.json: the result is incomplete"):
        load_fish(finished)


@pytest.mark.long
def test_a_fit_cut_short_is_made_again_and_the_reason_is_told(finished: Path, calib: Front) -> None:
    cut(finished / "results" / "calibration.json", 0.5)
    outcome = calib("fit", finished, "--effort", "quick", "-v")
    assert outcome.code == 0
    assert "calibration.json was incomplete: its end was missing or damaged. It was made again." in outcome.out
    assert calib("report", finished).code == 0


@pytest.mark.parametrize(
    ("name", "what", "share"), [*later(("posterior.nc", "posterior", 0.97)), ("diagnosis.json", "diagnosis", 0.0)]
)
def test_what_builds_on_a_fit_is_left_out_where_it_is_cut_short(
    name: str, what: str, share: float, whole: Path, calib: Front
) -> None:
    cut(whole / "results" / name, share)
    outcome = calib("report", whole)
    assert outcome.code == 0
    command = {"posterior": "posterior", "diagnosis": "diagnose"}[what]
    assert f"{what} is incomplete (`calib {command} " in outcome.out


@pytest.mark.parametrize(
    ("name", "command", "untrue"),
    [("posterior.json", "posterior", "was not sampled"), ("diagnosis.json", "diagnose", "were not searched")],
)
def test_a_summary_names_the_file_that_is_cut_short_and_the_next_step(
    name: str, command: str, untrue: str, whole: Path, calib: Front
) -> None:
    cut(whole / "results" / name, 0.5)
    said = calib("fit", whole).out
    assert f"results/{name} is damaged or cut short." in said
    assert f"Next: calib {command} {whole}" in said
    assert untrue not in said


@pytest.mark.long
def test_a_posterior_cut_short_is_made_again_and_the_reason_is_told(whole: Path, calib: Front) -> None:
    cut(whole / "results" / "posterior.json", 0.5)
    outcome = calib("posterior", whole, "-v")
    assert "posterior.json was incomplete: its end was missing or damaged. It was made again." in outcome.out


def test_draws_cut_short_are_called_incomplete(whole: Path) -> None:
    cut(whole / "results" / "posterior.nc", 0.6)
    with pytest.raises(InputError, match=r"posterior.nc: the result is incomplete.*again with `calib posterior`"):
        load_fish(whole, draws=3)


@pytest.mark.parametrize("share", [0.0, 0.97])
@pytest.mark.parametrize("suffix", [".npz", ".json"])
def test_a_policy_cut_short_is_called_incomplete(suffix: str, share: float, tmp_path: Path) -> None:
    from swimgym.policy import SHIPPED, load_policy

    for part in (".npz", ".json"):
        (tmp_path / f"target{part}").write_bytes((SHIPPED / f"target{part}").read_bytes())
    load_policy(tmp_path / "target")
    cut(tmp_path / f"target{suffix}", share)
    with pytest.raises(InputError, match=rf"it is incomplete; found target{suffix}, whose end is missing"):
        load_policy(tmp_path / "target")
