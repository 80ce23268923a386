"""Results whose end is missing, as after a full disk or a broken copy: said so, and made again by what makes them."""

from pathlib import Path

import pytest

import calib as front
from swimcal.errors import InputError
from swimgym import load_fish
from tests.calib.door import Front, assert_reports


def cut(path: Path, share: float) -> None:
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])


@pytest.mark.parametrize("share", [0.0, 0.97])
@pytest.mark.parametrize("command", ["report", "mjcf"])
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


@pytest.mark.parametrize("share", [0.0, 0.97])
@pytest.mark.parametrize(("name", "what"), [("posterior.nc", "posterior"), ("diagnosis.json", "diagnosis")])
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


@pytest.mark.parametrize("share", [0.0, 0.5, 0.97])
@pytest.mark.parametrize("suffix", [".npz", ".json"])
def test_a_policy_cut_short_is_called_incomplete(suffix: str, share: float, tmp_path: Path) -> None:
    from swimgym.policy import SHIPPED, load_policy

    for part in (".npz", ".json"):
        (tmp_path / f"target{part}").write_bytes((SHIPPED / f"target{part}").read_bytes())
    load_policy(tmp_path / "target")
    cut(tmp_path / f"target{suffix}", share)
    with pytest.raises(InputError, match=rf"it is incomplete; found target{suffix}, whose end is missing"):
        load_policy(tmp_path / "target")


def test_python_says_the_same(finished: Path) -> None:
    cut(finished / "results" / "calibration.json", 0.5)
    with pytest.raises(InputError, match="the fit is incomplete"):
        front.report(finished)
