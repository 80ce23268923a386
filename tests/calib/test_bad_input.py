"""Whatever is wrong with a session, `calib` says so once, clearly, with exit code 2, and writes nothing."""

import gzip
import tempfile
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from calib.pipeline import Pipeline, open_session
from swimcal.errors import SwimcalError
from tests.calib.door import Front, assert_reports, edit, files_in
from tests.swimcal.test_broken_input import mutated

Break = Callable[[Path], None]


def toml(old: str, new: str) -> Break:
    return lambda folder: edit(folder / "session.toml", old, new)


def rows(change: Callable[[list[str]], list[str]]) -> Break:
    """Changes the lines of the tracks of the slow trial; the first is the header."""

    def apply(folder: Path) -> None:
        path = folder / "trials" / "slow.csv.gz"
        lines = gzip.decompress(path.read_bytes()).decode().splitlines()
        path.write_bytes(gzip.compress("\n".join([*change(lines), ""]).encode(), mtime=0))

    return apply


def cell(value: str) -> Break:
    """Another value in the second column of the fifth line."""

    def change(lines: list[str]) -> list[str]:
        cells = lines[4].split(",")
        lines[4] = ",".join([cells[0], value, *cells[2:]])
        return lines

    return rows(change)


def robot(text: str) -> Break:
    def apply(folder: Path) -> None:
        (folder / "robot.toml").write_text(text)
        edit(folder / "session.toml", "[camera]", '[robot]\nfile = "robot.toml"\n\n[camera]')

    return apply


def on_one_spot(lines: list[str]) -> list[str]:
    def both(cells: list[str]) -> str:
        return ",".join([*cells[:4], *cells[1:4], *cells[7:]])

    return [lines[0], *(both(line.split(",")) for line in lines[1:])]


SLOW = "slow.csv.gz"
CASES: dict[str, tuple[Break, tuple[str, ...]]] = {
    "no session": (lambda folder: (folder / "session.toml").unlink(), ("no session.toml here", "calib new")),
    "unknown kind": (toml('"swim"', '"swimm"'), ("'swimm'", "swim")),
    "a marker the robot lacks": (toml('"tail_1"', '"tail_9"'), ("tail_9", "choices", "tail_1")),
    "missing tracks": (lambda folder: (folder / "trials" / SLOW).unlink(), (SLOW, "the file is not there")),
    "beyond any image": (cell("1e300"), (SLOW, "line 5", "'nose' is beyond any image", "1e+300")),
    "nose on neck": (rows(on_one_spot), ("trial slow", "nose and neck are never seen apart")),
    "too short": (rows(lambda lines: lines[:7]), ("trial slow", "too short", "0.0833 s", "warm-up of 1 s")),
    "shorter than a beat": (rows(lambda lines: lines[:64]), ("trial slow", "beats", "at least one")),
    "wrong robot": (robot('name = "x"\nlenght = 3\n'), ("robot.toml", "lenght")),
}


@pytest.mark.parametrize("case", CASES)
def test_a_broken_session_is_reported_what_is_wrong_and_left_alone(calib: Front, fresh: Path, case: str) -> None:
    break_it, parts = CASES[case]
    break_it(fresh)
    before = files_in(fresh)
    outcome = calib("run", fresh, "--effort", "quick", "--until", "fit")

    assert_reports(outcome, *parts)
    measured = case in ("shorter than a beat", "nose on neck", "too short")
    kept = {".swimcal.lock", "results/.stages.json", "results/.stages.lock"}
    allowed = kept | {"results/tracks/fast.csv"}  # tracks of the sound trial
    assert files_in(fresh).keys() - before.keys() <= (allowed if measured else set())


def test_results_that_cannot_be_written_are_reported_to_be(calib: Front, fresh: Path) -> None:
    (fresh / "results").write_text("a file in its place")
    before = files_in(fresh)

    assert_reports(
        calib("run", fresh, "--effort", "quick", "--until", "fit"),
        str(fresh / "results"),
        "cannot be written",
        "expected",
    )
    assert (fresh / "results").read_text() == "a file in its place"
    assert files_in(fresh).keys() - before.keys() <= {".swimcal.lock"}


@pytest.mark.parametrize("arguments", [["run"], ["fly", "x"], ["run", "x", "--effort", "medium"]])
def test_a_wrong_command_line_is_refused(calib: Front, arguments: list[str]) -> None:
    outcome = calib(*arguments)

    assert outcome.code == 2
    assert "Usage" in outcome.err
    assert "Traceback" not in outcome.err


def outcome_of(folder: Path) -> str:
    """The message reading and measuring a session ends with; empty if it ends well."""
    try:
        _ = Pipeline(open_session(folder)).recordings.swims
    except SwimcalError as error:
        return str(error)
    return ""


HEADER = "nose_x,nose_y,neck_x,neck_y,tail_1_x,tail_1_y,tail_5_x,tail_5_y"
TOML = """\
[session]
name = "pool"

[camera]
fps = 30.0
scale_length_m = 0.142

[markers]
names = ["nose", "neck", "tail_1", "tail_5"]

[fit]
warmup_s = 0.5

[[trial]]
name = "slow"
kind = "swim"
tracks = "slow.csv"
commanded_hz = 1.0
"""


def small_tracks() -> str:
    """Two seconds of a fish whose tail sways once a second."""
    import numpy as np

    time_s = np.arange(60) / 30
    sway = 40 * np.sin(2 * np.pi * time_s)
    x = [100 - 5 * time_s, 240 - 5 * time_s, 400 - 5 * time_s, 480 - 5 * time_s]
    y = [200 + 0 * time_s, 200 + 0.05 * sway, 200 + 0.3 * sway, 200 + sway]
    columns = [time_s, *(series for pair in zip(x, y, strict=True) for series in pair)]
    return (
        f"time_s,{HEADER}\n" + "\n".join(",".join(f"{v:.3f}" for v in row) for row in np.column_stack(columns)) + "\n"
    )


TRACKS = small_tracks()
broken = settings(suppress_health_check=[HealthCheck.too_slow])


def outcome_with(toml_text: bytes, tracks: bytes) -> str:
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "session.toml").write_bytes(toml_text)
        (Path(folder) / "slow.csv").write_bytes(tracks)
        return outcome_of(Path(folder))


@pytest.mark.long
@broken
@given(mutated(TRACKS))
def test_no_tracks_make_the_pipeline_fall(text: bytes) -> None:
    assert isinstance(outcome_with(TOML.encode(), text), str)


@pytest.mark.long
@broken
@given(
    start=st.integers(0, 59),
    length=st.integers(0, 60),
    columns=st.sets(st.integers(1, 8)),
    value=st.sampled_from(["", "0", "1e9", "-3", "240", "1e300"]),
)
def test_no_stretch_of_odd_samples_makes_it_fall(start: int, length: int, columns: set[int], value: str) -> None:
    lines = TRACKS.splitlines()
    for number in range(1 + start, min(1 + start + length, len(lines))):
        cells = lines[number].split(",")
        lines[number] = ",".join(value if k in columns else cell for k, cell in enumerate(cells))

    assert isinstance(outcome_with(TOML.encode(), "\n".join(lines).encode()), str)
