"""Cases are worked off side by side, whatever becomes of one, and their records come back from their files."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path

import pytest

from benchmarks.cases import Run, add_line, read_lines, run_cases, write_lines
from swimcal.errors import InputError
from tests.cases import later


@dataclass(frozen=True)
class Square:
    """A record."""

    number: int
    value: float
    names: tuple[str, ...] = ()


def squared(number: int) -> Square:
    if number == 3:
        raise ValueError("odd one")
    return Square(number, float("nan") if number == 0 else float(number**2), ("a", "b"))


def numbers(*chosen: int) -> dict[str, int]:
    return {str(number): number for number in chosen}


@pytest.mark.parametrize("workers", [1, *later(2)])
def test_a_failure_is_told_and_stops_no_other(workers: int) -> None:
    shares: list[float | None] = []
    found: list[Square] = []
    run = Run(workers, progress=lambda _message, share: shares.append(share))
    assert run_cases(squared, numbers(1, 2, 3, 4), run, found.append) == (("3", "ValueError: odd one"),)
    assert shares == [0.25, 0.5, 0.75, 1.0]
    assert sorted(each.number for each in found) == [1, 2, 4]


def test_records_that_are_added_are_read_as_they_were(tmp_path: Path) -> None:
    run_cases(squared, numbers(0, 3, 2), Run(1), partial(add_line, tmp_path / "made" / "records.jsonl"))
    found = read_lines(tmp_path / "made" / "records.jsonl", Square, lambda record: str(record.number))
    assert repr(found) == repr((squared(0), squared(2)))


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
