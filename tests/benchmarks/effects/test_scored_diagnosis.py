"""A diagnosis is read by the contract, whoever wrote it."""

import json
from pathlib import Path
from typing import Any

import pytest

from benchmarks.effects.scored_diagnosis import Diagnosis, read_diagnosis
from swimcal.errors import InputError
from swimcal.results import from_plain, to_plain

DIAGNOSIS: dict[str, Any] = {
    "verdict": "inseparable",
    "groups": [["tendon_slack", "tendon_friction"], ["scale_error"]],
    "effects": ["tendon_slack", "tendon_friction", "scale_error"],
    "probabilities": {"tendon_slack": 0.5, "tendon_friction": 0.4, "scale_error": 0.97, "none_of_these": 0.01},
    "where": {"by_stage": {"camera": 0.2, "drive": -0.1, "body": 0.1, "tail": 0.3, "floor": 0.5}},
    "gap": {"shrinkage": 0.7, "shrinkage_ci95": [0.6, 0.8]},
    "seconds": 41.0,
}


def written(folder: Path, **changes: Any) -> Path:
    path = folder / "diagnosis.json"
    path.write_text(json.dumps(DIAGNOSIS | changes))
    return path


def test_it_is_read(tmp_path: Path) -> None:
    reported = read_diagnosis(written(tmp_path))
    assert reported.first == "scale_error"
    assert reported.names == {"tendon_slack", "tendon_friction", "scale_error"}
    assert reported.stage == "tail"  # floor is no stage that an effect acts at
    assert (reported.shrinkage, reported.interval, reported.seconds) == (0.7, (0.6, 0.8), 41.0)


def test_what_does_not_apply_is_none(tmp_path: Path) -> None:
    reported = read_diagnosis(written(tmp_path, verdict="no_gap", groups=[], gap=None, where=None, seconds=None))
    assert (reported.first, reported.stage, reported.shrinkage, reported.interval, reported.seconds) == (None,) * 5


def test_all_faults_are_told_at_once(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"(?s)verdict.*perhaps.*probabilities\.x.*1\.5"):
        read_diagnosis(written(tmp_path, verdict="perhaps", probabilities={"x": 1.5, "none_of_these": 0.0}))


@pytest.mark.parametrize(
    ("changes", "place"),
    [
        ({"groups": ["tendon_slack"]}, r"groups\.0"),
        ({"groups": [["a", "b", "c", "d"]]}, r"groups\.0"),
        ({"groups": [[]]}, r"groups\.0"),
        ({"gap": {"shrinkage": "0.5"}}, r"gap\.shrinkage"),
        ({"probabilities": {"x": None}}, r"probabilities\.x"),
        ({"where": {"by_stage": {"tail": "most"}}}, r"by_stage\.tail"),
        ({"seconds": float("nan")}, "seconds"),
    ],
)
def test_what_is_not_by_the_contract_is_told_where_it_stands(
    changes: dict[str, Any], place: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=place):
        read_diagnosis(written(tmp_path, **changes))


@pytest.mark.parametrize("text", ["", "[]", "{}", '"named"'])
def test_what_is_no_diagnosis_is_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "diagnosis.json"
    path.write_text(text)
    with pytest.raises(InputError):
        read_diagnosis(path)


def test_a_record_of_it_comes_back(tmp_path: Path) -> None:
    for changes in ({}, {"verdict": "no_gap", "groups": [], "gap": None, "where": None}):
        reported = read_diagnosis(written(tmp_path, **changes))
        assert from_plain(Diagnosis, json.loads(json.dumps(to_plain(reported)))) == reported
