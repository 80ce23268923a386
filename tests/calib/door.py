"""The command line from outside: what it prints, writes and ends with."""

import json
import re
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import jsonschema
import pytest

from calib import cli, pipeline
from calib.stages import diagnosis as diagnosis_stage
from calib.stages import fit as fit_stage
from fitting import calibration
from fitting.baselines import sweep_frequencies
from fitting.posterior import prediction, sampling, summary
from swimcal.effects.catalogue import catalogue
from swimcal.results import write_whole
from swimsynth.disturbances import TrackingNoise
from swimsynth.plan import SyntheticPlan, SyntheticTrial
from tests.fitting.swims import with_little_search

ROOT = Path(__file__).resolve().parents[2]

FEW_EFFECTS = {name: catalogue()[name] for name in ("crank_arm_error", "scale_error")}

PLAN = SyntheticPlan(
    trials=(
        SyntheticTrial(name="slow", frequency_hz=0.8, commanded_hz=0.82, seconds=2.8, phase_rad=1.0),
        SyntheticTrial(name="fast", frequency_hz=1.3, commanded_hz=1.35, seconds=2.5, role="holdout"),
    ),
    noise=TrackingNoise(),
    run_in_s=3.0,
)


class Outcome(NamedTuple):
    """What a command ended with."""

    code: int
    out: str
    err: str


Front = Callable[..., Outcome]
"""Runs `calib` with these arguments."""


def front_door(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], main: Callable[[], None] = cli.main
) -> Front:
    """`calib`, or the program of another entry point, within this process."""

    def run(*arguments: str | Path) -> Outcome:
        monkeypatch.setattr(sys, "argv", ["calib", *map(str, arguments)])
        capsys.readouterr()
        code = 0
        try:
            main()
        except SystemExit as end:
            code = int(end.code or 0)
        return Outcome(code, *capsys.readouterr())

    return run


def with_little_effort(patch: pytest.MonkeyPatch, true_report: bool = False) -> None:
    """A short search, little next to it, and a report without figures."""
    patch.setattr(fit_stage, "STARTS", {"quick": 1, "full": 1})
    patch.setattr(fit_stage, "PUBLISHED_S", {"quick": 100.0, "full": 100.0})
    with_little_search(patch)
    patch.setattr(diagnosis_stage, "catalogue", lambda: FEW_EFFECTS)
    patch.setattr(calibration, "sweep_frequencies", partial(sweep_frequencies, count=3))
    if not true_report:
        patch.setattr(pipeline, "write_report", lambda path, *_, **__: write_whole(path, "<html></html>"))


def hurried() -> None:
    """Little effort, for as long as the process lives."""
    with_little_effort(pytest.MonkeyPatch())


def files_in(folder: Path) -> dict[str, int]:
    """The time of writing of each file below a folder, by name; temporary files of an interrupted write too."""
    return {
        path.relative_to(folder).as_posix(): path.stat().st_mtime_ns for path in folder.rglob("*") if path.is_file()
    }


def results_in(folder: Path) -> dict[str, int]:
    """When each result of a session was written, by name; without what the program keeps for itself."""
    return {name: when for name, when in files_in(folder / "results").items() if not name.startswith(".")}


def lasting(folder: Path) -> dict[str, str]:
    """Content of each result of the contract, by name, without what differs from run to run: times."""
    results = folder / "results"
    found = {
        name: (results / name).read_text(errors="replace")
        for name in files_in(results)
        if not name.startswith((".", "kept/"))
    }
    return {name: re.sub(r'"seconds": [0-9.e-]+', "", text) for name, text in found.items()}


def calibration_of(folder: Path) -> Any:
    """The content of its `calibration.json`."""
    return json.loads((folder / "results" / "calibration.json").read_text())


def assert_public_form(folder: Path) -> None:
    """Its calibration is by the public schema, where that is here."""
    schema = ROOT.parent / "shared" / "design" / "schema" / "calibration.schema.json"
    if schema.is_file():
        jsonschema.validate(calibration_of(folder), json.loads(schema.read_text()))


def edit(path: Path, old: str, new: str) -> None:
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


def assert_reports(outcome: Outcome, *parts: str) -> None:
    """One clear message on standard error, exit code 2, no traceback."""
    assert outcome.code == 2, outcome
    assert outcome.out == ""
    assert outcome.err.startswith("calib: ")
    assert "Traceback" not in outcome.err
    for part in parts:
        assert part in outcome.err


def little_posterior(patch: pytest.MonkeyPatch) -> None:
    """Draws that nobody should rely on, in a second or two."""
    patch.setattr(sampling, "_FIRST", 32)
    patch.setattr(sampling, "_ROUND", 16)
    patch.setattr(sampling, "_ROUNDS", 1)
    patch.setattr(sampling, "_CHUNK", 250)
    patch.setattr(sampling, "R_HAT", 2.0)
    patch.setattr(fit_stage, "EFFECTIVE", {"quick": 5, "full": 5})
    patch.setattr(summary, "SWEPT", 2)
    patch.setattr(prediction, "DRAWS", 3)
