import json
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from session import (
    Flag,
    InputError,
    Provenance,
    ResultsNotWritable,
    read_result_json,
    write_result_json,
    write_whole,
    writing_whole,
)

PROVENANCE = Provenance("4.0.0", "abc", {"session.toml": "def"}, 7, "quick")


class Interval(NamedTuple):
    low: float
    high: float


def names_in(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_a_file_is_written_and_replaced_and_folders_are_made(tmp_path: Path) -> None:
    path = tmp_path / "results" / "tracks" / "a.csv"
    write_whole(path, "one µ")
    write_whole(path, b"two")
    assert path.read_bytes() == b"two"
    assert names_in(path.parent) == ["a.csv"]


@pytest.mark.parametrize("failure", [RuntimeError("lost"), KeyboardInterrupt()])
def test_a_failure_midway_leaves_the_old_file_and_nothing_else(tmp_path: Path, failure: BaseException) -> None:
    path = tmp_path / "a.json"
    write_whole(path, "old")

    def write() -> None:
        with writing_whole(path) as part:
            part.write_text("ne")
            raise failure

    with pytest.raises(type(failure)):
        write()
    assert path.read_text() == "old"
    assert names_in(tmp_path) == ["a.json"]


def test_a_failure_of_the_system_is_told_and_leaves_the_old_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.json"
    write_whole(path, "old")

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("session.results.os.fsync", full)
    with pytest.raises(ResultsNotWritable, match=r"a\.json: cannot be written; found: No space left"):
        write_whole(path, "new")
    assert path.read_text() == "old"
    assert names_in(tmp_path) == ["a.json"]


def test_results_that_cannot_be_a_folder_are_told(tmp_path: Path) -> None:
    (tmp_path / "results").write_text("a file in the way")
    with pytest.raises(ResultsNotWritable, match=r"expected: a writable folder with space left\. Make "):
        write_whole(tmp_path / "results" / "a.json", "x")


def test_json_results_begin_with_their_provenance_and_hold_no_nan(tmp_path: Path) -> None:
    path = tmp_path / "r.json"
    payload = {
        "array": np.array([[1.0, np.nan], [np.inf, 2.0]]),
        "scalar": np.float64(0.5),
        "count": np.int64(3),
        "yes": np.bool_(True),
        "bad": float("nan"),
        "pair": Interval(1.0, -np.inf),
        "flags": [Flag("gap")],
        3: "key",
    }
    write_result_json(path, PROVENANCE, payload)  # type: ignore[arg-type]
    data = read_result_json(path)
    assert list(data)[:7] == ["schema", "program", "mujoco", "model_sha256", "inputs", "seed", "effort"]
    assert data["program"].startswith("swimcal")
    assert data["array"] == [[1.0, None], [None, 2.0]]
    assert (data["scalar"], data["count"], data["yes"], data["bad"]) == (0.5, 3, True, None)
    assert data["pair"] == [1.0, None]
    assert data["flags"] == [{"kind": "gap", "markers": [], "frames": None, "message": ""}]
    assert data["3"] == "key"


def test_a_payload_cannot_overwrite_the_provenance_or_hold_what_is_no_data(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="seed belongs to the provenance"):
        write_result_json(tmp_path / "r.json", PROVENANCE, {"seed": 3})
    with pytest.raises(TypeError, match="a result cannot hold object"):
        write_result_json(tmp_path / "r.json", PROVENANCE, {"x": object()})
    assert names_in(tmp_path) == []


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, "the result is not there"),
        ("{", "the result cannot be read"),
        ("[]", "not a result of this version; found list; expected schema 1"),
        (json.dumps({"schema": 99}), "found schema 99; expected schema 1. Make it again with `calib run`."),
    ],
)
def test_a_damaged_result_is_told(tmp_path: Path, text: str | None, message: str) -> None:
    if text is not None:
        (tmp_path / "r.json").write_text(text)
    with pytest.raises(InputError) as caught:
        read_result_json(tmp_path / "r.json")
    assert message in str(caught.value)
