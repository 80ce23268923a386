"""Commands use what stands: showing computes nothing, and what computes replaces its own results alone, kept aside."""

from hashlib import sha256
from pathlib import Path

import pytest

from tests.calib.door import Front, assert_reports, edit

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


def test_a_report_says_what_it_shows_and_what_renews_the_rest(calib: Front, whole: Path) -> None:
    edit(whole / "results" / "diagnosis.json", '"verdict"', ' "verdict"')
    (whole / "results" / "posterior.nc").unlink()
    shown = calib("report", whole).out
    assert f"fit of quick effort, no posterior (`calib posterior {whole}`)" in shown
    assert f"diagnosis is out of date (`calib diagnose {whole}`)" in shown


@pytest.mark.parametrize("command", ["diagnose", "posterior"])
def test_the_next_step_is_the_report_only_where_it_does_not_stand(calib: Front, whole: Path, command: str) -> None:
    calib("report", whole)
    assert "calib report" not in calib(command, whole).out
    page = whole / "results" / "report.html"
    page.write_text(page.read_text() + " ")
    assert f"Next: the report is out of date: calib report {whole}" in calib(command, whole).out
    page.unlink()
    assert f"Next: calib report {whole}" in calib(command, whole).out


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
        assert_reports(calib(*command), "out of date", f"calib fit {whole}")
    assert results(whole) == before
