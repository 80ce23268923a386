"""Damaged and odd files drawn at random: each is refused in a sentence, or what counts of it is right."""

from pathlib import Path

import pytest

from benchmarks.tracking.damaged import FAULTS, PLAN, Filmed, OddFile, draw_files, film_clip, track_file
from tests.cases import later


@pytest.fixture(scope="module")
def filmed() -> Filmed:
    return film_clip(PLAN.model_copy(update={"frames": 36}))


FILES = (
    OddFile("MOV", ("turned", "dropped"), 1),
    OddFile("GIF", ("gray", "repeated"), 2),
    OddFile("MP4", ("dropped, closed up",), 5),
    OddFile("MKV", ("jittered", "cut off"), 4),
    OddFile("AVI", ("zeroed",), 5),
    OddFile("MP4", ("late", "overwritten"), 6),
)


@pytest.mark.parametrize(
    "file", [*FILES[:2], *later(*FILES[2:], *draw_files(1, 50))], ids=lambda file: f"{file.container} {file.seed}"
)
def test_nothing_wrong_of_a_damaged_or_odd_file_counts_without_a_flag(
    file: OddFile, filmed: Filmed, tmp_path: Path
) -> None:
    found = track_file(file, filmed, tmp_path)

    assert found.traceback == ""
    assert found.unflagged == 0


@pytest.mark.long
def test_a_file_that_is_only_packed_otherwise_counts_whole(filmed: Filmed, tmp_path: Path) -> None:
    found = track_file(OddFile("MKV", ("as it is",), 0), filmed, tmp_path)

    assert (found.refused, found.traceback, found.wrong) == ("", "", 0)
    assert found.samples == 36 * 9


@pytest.mark.long
def test_wrong_times_are_found_by_the_score(filmed: Filmed, tmp_path: Path) -> None:
    late = filmed.truth.shown_px[[*range(18), *range(17, -1, -1)]]  # it turns back, in the truth alone
    turned = Filmed(filmed.pictures, type(filmed.truth)(**{**vars(filmed.truth), "shown_px": late}))

    assert track_file(OddFile("MP4", ("as it is",), 0), turned, tmp_path).wrong > 0


def test_every_fault_is_drawn_and_a_container_has_no_fault_that_it_cannot_hold() -> None:
    files = draw_files(3, 60)
    assert {fault for file in files for fault in file.faults} == {name for names in FAULTS.values() for name in names}
    assert not [file for file in files if file.container == "raw H.264" and "late" in file.faults]
