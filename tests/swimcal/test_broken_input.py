"""Whatever a file holds, reading it ends well or with an `InputError`."""

import gzip
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import tomlkit
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from swimcal.errors import InputError
from swimcal.motor_log import MOTOR_COLUMNS, load_motor
from swimcal.robot import load_robot
from swimcal.session import load_session
from swimcal.session_file import load_camera
from swimcal.toml import lines_of_keys
from swimcal.tracks import load_tracks
from tests.swimcal.sample import MARKERS, SESSION_TOML, make_session, tracks_text

HEADER = "time_s,nose_x,nose_y,nose_confidence,neck_x,neck_y,tail_1_x,tail_1_y"
WITH_HEADER = HEADER + "\n" + "".join(f"{k / 60},1,2,0.5,3,4,5,{k}\n" for k in range(6))
MOTOR = ",".join(MOTOR_COLUMNS) + "\n" + "".join(f"{k},0.1,6.28,0.5,12,30,0\n" for k in range(6))
CAMERA = "[camera]\nwidth_px = 3840\nheight_px = 2160\nfx_px = 2e3\nfy_px = 2e3\ncx_px = 1920.0\ncy_px = 1080.0\n"
PIECES = [*',\n\r-_";\0é[]=#', "", "nan", "inf", "1e999", "'''", "0x"]

broken = settings(suppress_health_check=[HealthCheck.too_slow])


def mutated(text: str) -> st.SearchStrategy[bytes]:
    """The text with up to four stretches replaced."""
    edit = st.tuples(
        st.integers(0, len(text)), st.integers(0, 12), st.one_of(st.sampled_from(PIECES), st.text(max_size=4))
    )

    def apply(edits: list[tuple[int, int, str]]) -> bytes:
        result = text
        for start, length, piece in edits:
            result = result[:start] + piece + result[start + length :]
        return result.encode("utf-8", "surrogatepass")

    return st.lists(edit, min_size=1, max_size=4).map(apply)


def cells() -> st.SearchStrategy[bytes]:
    """Rows of cells of every sort."""
    cell = st.one_of(st.floats().map(str), st.integers().map(str), st.sampled_from([*PIECES, *HEADER.split(",")]))
    rows = st.lists(st.lists(cell, max_size=9).map(",".join), max_size=9)
    return rows.map(lambda lines: "\n".join(lines).encode())


def damaged_gzip(content: bytes) -> st.SearchStrategy[bytes]:
    """Packed content with one byte changed and the end cut off."""
    packed = gzip.compress(content, mtime=0)
    change = st.tuples(st.integers(0, len(packed) - 1), st.integers(0, 255), st.integers(0, len(packed)))
    return change.map(lambda c: (packed[: c[0]] + bytes([c[1]]) + packed[c[0] + 1 :])[: c[2]])


def message_of(reader: Callable[[Path], object], path: Path) -> str:
    try:
        reader(path)
    except InputError as error:
        return str(error)
    return ""


def read(content: bytes, name: str, reader: Callable[[Path], object]) -> None:
    """Reads the content as a file; the test fails for any error but the one meant for the user."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / name
        path.write_bytes(content)
        said = message_of(reader, path)
    assert len(said) < 20_000


def read_tracks(path: Path) -> None:
    tracks = load_tracks(path, MARKERS, 60.0)
    assert len(tracks.time.values) >= 2
    assert (tracks.time.values[1:] > tracks.time.values[:-1]).all()
    assert ((tracks.confidence.values >= 0) & (tracks.confidence.values <= 1)).all()


def read_session(path: Path) -> None:
    make_session(path.parent, path.read_bytes().decode("utf-8", "replace"))
    path.parent.joinpath("session.toml").write_bytes(path.read_bytes())
    load_session(path.parent, load_robot)
    assert not (path.parent / "results").exists()


FILES: dict[str, tuple[st.SearchStrategy[bytes], Callable[[Path], object]]] = {
    "t.csv": (st.one_of(mutated(tracks_text(6)), mutated(WITH_HEADER), cells(), st.binary(max_size=200)), read_tracks),
    "t.csv.gz": (damaged_gzip(tracks_text(6).encode()), read_tracks),
    "m.csv": (st.one_of(mutated(MOTOR), cells(), st.binary(max_size=200)), load_motor),
    "camera.toml": (st.one_of(mutated(CAMERA), st.binary(max_size=100)), load_camera),
    "broken.toml": (st.one_of(mutated(SESSION_TOML), st.binary(max_size=100)), read_session),
}


@pytest.mark.parametrize("name", FILES)
@broken
@given(data=st.data())
def test_broken_files_never_end_in_a_traceback(name: str, data: st.DataObject) -> None:
    contents, reader = FILES[name]
    read(data.draw(contents), name, reader)


KEYS = ["session", "robot", "camera", "markers", "fit", "trial", "name", "file", "fps", "names", "kind", "tracks"]
scalars = st.one_of(
    st.booleans(),
    st.integers(-(10**30), 10**30),
    st.just(10**400),
    st.floats(),
    st.text(st.characters(exclude_categories=["Cs"]), max_size=6),
    st.sampled_from(["slow.csv", "swim", "nose", "neck", "..", "/", "x" * 5000]),
    st.datetimes(),
)
values = st.recursive(
    scalars,
    lambda inner: st.one_of(st.lists(inner, max_size=4), st.dictionaries(st.sampled_from(KEYS), inner, max_size=4)),
    max_leaves=12,
)


@broken
@given(st.data())
def test_one_value_of_any_type_in_a_valid_session_never_ends_in_a_traceback(data: st.DataObject) -> None:
    content = tomlkit.parse(SESSION_TOML).unwrap()
    table = data.draw(
        st.sampled_from([content, *(t for t in content.values() if isinstance(t, dict)), *content["trial"]])
    )
    known = ["robot", "fit", "video", "boxes", "motor", "motor_offset_s", "calibration"]
    table[data.draw(st.sampled_from([*table, *known]))] = data.draw(values)
    read(tomlkit.dumps(content).encode(), "broken.toml", read_session)


@broken
@given(st.dictionaries(st.text(st.characters(exclude_categories=["Cs"]), max_size=4), values, max_size=5))
def test_every_key_of_any_toml_has_a_line(content: dict[str, Any]) -> None:
    text = tomlkit.dumps(content)
    lines = lines_of_keys(text)
    assert {key for key in lines if len(key) == 1} == {(key,) for key in content}
    assert all(1 <= line <= len(text.split("\n")) for line in lines.values())
