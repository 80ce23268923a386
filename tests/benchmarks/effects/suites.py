"""Suites without any simulation: folders that hold next to nothing, and answers."""

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from benchmarks.cases import write_record
from benchmarks.effects.folder import DIAGNOSIS, Answer, SuiteFolder
from benchmarks.effects.suite import SessionPlan

ANSWERS = (
    Answer("w00000001", "null"),
    Answer("w00000002", "single", ("tendon_slack",), None, ((),), 10.0, "tail", 0.8),
    Answer("w00000003", "single", ("scale_error",), None, ((),), 2.0, "camera", 0.4),
    Answer("w00000004", "outside", (), "tether", ((),), 5.0),
)
_NO_BENCH: dict[str, Any] = {"dry_hz": None, "free_decay": False}


def suite_in(folder: Path, answers: Sequence[Answer] = ANSWERS) -> SuiteFolder:
    suite = SuiteFolder(folder)
    for answer in answers:
        (suite.sessions / answer.session).mkdir(parents=True)
        (suite.sessions / answer.session / "session.toml").write_text(f'[session]\nname = "{answer.session}"\n')
        write_record(suite.answer(answer.session), answer)
    return suite


def shortened(plan: SessionPlan, seconds: float = 2.0) -> SessionPlan:
    """Two short swims, with logs or without: enough for a folder."""
    whole = plan.recorded
    fit_hz, holdout_hz = whole.fit_hz[:1], whole.holdout_hz[:1]
    return replace(plan, recorded=replace(whole, fit_hz=fit_hz, holdout_hz=holdout_hz, seconds=seconds, **_NO_BENCH))


def says_slack(session: Path, without: frozenset[str]) -> None:
    """A program that finds slack tendons everywhere, as long as it knows of them; it keeps a count of its runs."""
    named = "tendon_slack" not in without
    reported = {
        "verdict": "named" if named else "unexplained",
        "groups": [["tendon_slack"]] if named else [],
        "probabilities": {"tendon_slack": 0.95, "none_of_these": 0.05} if named else {"none_of_these": 1.0},
        "where": {"by_stage": {"tail": 0.8, "floor": 0.2}},
        "gap": None,
        "withheld_from_catalogue": sorted(without),
    }
    path = session / DIAGNOSIS
    path.parent.mkdir(exist_ok=True)
    path.write_text(json.dumps(reported))
    with (session / "runs").open("a") as file:
        file.write("once\n")


def runs(folder: Path) -> dict[str, int]:
    """How often the program ran in each session of a folder."""
    return {path.parent.name: path.read_text().count("once") for path in folder.glob("*/runs")}
