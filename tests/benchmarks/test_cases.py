"""Cases are done once, also when a worker dies over one; what stands stays, what failed is tried again."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import pytest
from distributed import LocalCluster

from benchmarks.cases import Records, Run, read_lines, run_cases, write_lines
from swimcal.errors import InputError

ALONE = Run(workers=1)


@dataclass(frozen=True)
class Square:
    """A record."""

    number: int
    value: float
    names: tuple[str, ...] = ()


def squared(number: int) -> Square:
    if number == 3:
        raise ValueError("odd one")
    return Square(number, float("nan") if number == 0 else number**2, ("a", "b"))


def numbers(*chosen: int) -> dict[str, int]:
    return {str(number): number for number in chosen}


@pytest.fixture
def records(tmp_path: Path) -> Records[Square]:
    return Records(tmp_path / "records", Square, "this code")


def test_what_is_there_is_not_done_again_and_failures_are_tried_again(records: Records[Square]) -> None:
    shares: list[float | None] = []
    run = Run(1, progress=lambda _message, share: shares.append(share))
    assert run_cases(squared, numbers(1, 2, 3, 4), run, records.keep) == (("3", "ValueError: odd one"),)
    assert shares == [0.25, 0.5, 0.75, 1.0]
    assert records.missing(["1", "2", "3", "4", "10"]) == ["3", "10"]
    run_cases(squared, numbers(10, 0), ALONE, records.keep)
    assert [*records.every()] == ["0", "1", "2", "4", "10"]
    assert records.read("2") == squared(2)
    assert repr(records.read("0")) == repr(squared(0))


def test_records_of_other_code_or_inputs_or_broken_ones_do_not_count(records: Records[Square]) -> None:
    for name in ("1", "2"):
        records.keep(name, squared(int(name)), inputs="a clip")
    (records.folder / "2.json").write_text("{")
    assert records.read("1", "a clip") == squared(1)
    assert records.read("1") is records.read("2", "a clip") is None
    other = replace(records, made_by="other code")
    assert (other.every(), other.others) == ({}, 2)


def test_lines_of_several_shards_are_read_as_one_file(tmp_path: Path) -> None:
    for number in (1, 2):
        write_lines(tmp_path / f"{number}.jsonl", [squared(number)])
    both = tmp_path / "both.jsonl"
    both.write_text("".join((tmp_path / f"{number}.jsonl").read_text() for number in (1, 2)))
    assert read_lines(both, Square, lambda record: str(record.number)) == (squared(1), squared(2))


def test_all_lines_that_are_no_records_are_reported(tmp_path: Path) -> None:
    file = tmp_path / "records.jsonl"
    good = '{"number": 1, "value": 1.0}\n'
    file.write_text(f'{good}{good}{{"number": 1}}\nnonsense\n[]\n')
    with pytest.raises(InputError, match=r"(?s)line 2.*is listed twice.*line 3.*line 4.*line 5"):
        read_lines(file, Square, lambda record: str(record.number))
    file.write_text("")
    for path, fault in ((file, "holds no record"), (tmp_path / "none.jsonl", "cannot be read")):
        with pytest.raises(InputError, match=fault):
            read_lines(path, Square, lambda record: str(record.number))


def test_the_workers_of_a_scheduler_do_it_as_well(records: Records[Square]) -> None:
    with LocalCluster(n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None) as cluster:
        run_cases(squared, numbers(0, 1, 2), Run(scheduler=cluster.scheduler_address), records.keep)
    assert [*records.every()] == ["0", "1", "2"]
