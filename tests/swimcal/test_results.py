import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
import xarray as xr

from swimcal.errors import InputError, ResultsNotWritable
from swimcal.flags import Flag
from swimcal.results import (
    Provenance,
    ResultFile,
    check_whole,
    is_incomplete,
    read_provenance,
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


def test_a_file_in_the_place_of_the_folder_is_named(tmp_path: Path) -> None:
    (tmp_path / "results").write_text("x")
    with pytest.raises(ResultsNotWritable, match=r"results: cannot be written into; found: a file; expected: a folder"):
        write_whole(tmp_path / "results" / "tracks" / "a.csv", "one")


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


def test_a_failure_of_the_system_is_reported_and_leaves_the_old_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.json"
    write_whole(path, "old")

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("swimcal.results.os.fsync", full)
    with pytest.raises(ResultsNotWritable, match=r"a\.json: cannot be written; found: No space left"):
        write_whole(path, "new")
    assert path.read_text() == "old"
    assert names_in(tmp_path) == ["a.json"]


@dataclass(frozen=True, eq=False)
class Measured:
    array: np.ndarray
    scalar: float
    count: int
    yes: bool
    bad: float
    pair: Interval
    flags: tuple[Flag, ...]


MEASURED = ResultFile("r.json", Measured)
MADE = Measured(
    np.array([[1.0, np.nan], [np.inf, 2.0]]),
    np.float64(0.5),
    np.int64(3),
    np.bool_(True),
    float("nan"),
    Interval(1.0, -np.inf),
    (Flag("gap"),),
)


def test_json_results_begin_with_their_provenance_and_hold_no_nan(tmp_path: Path) -> None:
    assert MEASURED.write(tmp_path, PROVENANCE, MADE) == (tmp_path / "r.json",)
    data = json.loads((tmp_path / "r.json").read_text())
    assert list(data)[:7] == ["schema", "program", "mujoco", "model_sha256", "inputs", "seed", "effort"]
    assert data["program"].startswith("swimcal")
    assert data["array"] == [[1.0, None], [None, 2.0]]
    assert (data["scalar"], data["count"], data["yes"], data["bad"]) == (0.5, 3, True, None)
    assert data["pair"] == {"low": 1.0, "high": None}
    assert data["flags"] == [{"kind": "gap", "markers": [], "frames": None, "message": ""}]


def test_what_is_no_data_is_no_result(tmp_path: Path) -> None:
    with pytest.raises(TypeError, match="a result cannot hold object"):
        MEASURED.write(tmp_path, PROVENANCE, replace(MADE, scalar=object()))
    assert names_in(tmp_path) == []


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, "the result is not there"),
        ("{", "the result is incomplete; found 1 bytes, whose end is missing"),
        ("[]", "not a result of this version; found list; expected schema 1"),
        (json.dumps({"schema": 99}), "found schema 99; expected schema 1. Make it again with `calib run`."),
        (json.dumps({"schema": 1, "count": 3}), "not a result of this version; found 'array'; expected what"),
    ],
)
def test_a_damaged_result_is_reported(tmp_path: Path, text: str | None, message: str) -> None:
    if text is not None:
        (tmp_path / "r.json").write_text(text)
    with pytest.raises(InputError) as caught:
        MEASURED.read(tmp_path)
    assert message in str(caught.value)
    with pytest.raises(InputError):
        read_provenance(tmp_path / "r.json")


@dataclass(frozen=True, eq=False)
class Apart:
    word: str
    array: np.ndarray


APART = ResultFile("apart.json", Apart, arrays_apart=True)


@pytest.mark.parametrize("share", [0.0, 0.01, 0.3, 0.5, 0.9, 0.98])
@pytest.mark.parametrize("name", ["apart.json", "apart.npz"])
def test_a_result_cut_anywhere_is_called_incomplete(tmp_path: Path, name: str, share: float) -> None:
    APART.write(tmp_path, PROVENANCE, Apart("°C", np.arange(300.0)))
    whole = (tmp_path / name).read_bytes()
    (tmp_path / name).write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(InputError, match=rf"{name}: the result is incomplete; .*Make it again with `calib run`\."):
        APART.read(tmp_path)


def test_arrays_that_are_not_there_are_called_that(tmp_path: Path) -> None:
    APART.write(tmp_path, PROVENANCE, Apart("", np.arange(3.0)))[1].unlink()
    with pytest.raises(InputError, match=r"apart.npz: the result is not there"):
        APART.read(tmp_path)


@pytest.mark.parametrize("share", [0.0, 0.01, 0.5, 0.999])
def test_netcdf_cut_anywhere_is_called_incomplete(tmp_path: Path, share: float) -> None:
    path = tmp_path / "posterior.nc"
    xr.Dataset({"blunt_drag": ("draw", np.arange(1e4))}).to_netcdf(path, engine="h5netcdf", group="posterior")
    assert not is_incomplete(path)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(InputError, match=r"the result is incomplete; .*Make it again with `calib posterior`"):
        check_whole(path, "calib posterior")
