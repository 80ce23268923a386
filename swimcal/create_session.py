"""The making of new sessions, written whole or not at all, from the authors' public tracks or from a description."""

from __future__ import annotations

import re
import shutil
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import tomlkit

from swimcal.errors import Fault, FaultCollector, InputError, ResultsNotWritable, did_you_mean
from swimcal.results import write_whole
from swimcal.session import SESSION_FILE, load_session
from swimcal.tracks import load_tracks

FISHSIM_MARKERS = ("nose", "neck", "dorsal_fin", *(f"tail_{n}" for n in range(1, 6)), "caudal_fin")
"""The markers of the public tracks, in the order of their columns (fishsim, ``Data/Markers``)."""

FISHSIM_FPS = 60.0
FISHSIM_SCALE_M = 0.142  # distance from nose to neck
FISHSIM_FIT = ("f1_00", "f1_75")
"""The trials that are fitted by default."""


def write_session_toml(
    folder: Path,
    *,
    name: str,
    camera: Mapping[str, Any],
    markers: Sequence[str],
    trials: Sequence[Mapping[str, Any]],
    fit: Mapping[str, Any] | None = None,
    robot_file: str | None = None,
) -> Path:
    """Write ``session.toml`` from the keys of its tables; what it holds is checked when the session is loaded.

    A key whose value is None is left out. Files are relative to the folder.

    Args:
        folder: the session folder.
        name: name of the session.
        camera: keys of the table ``[camera]``.
        markers: names of the tracked markers.
        trials: the keys of each ``[[trial]]``.
        fit: keys of the table ``[fit]``.
        robot_file: the robot's TOML; None for the built-in robot.

    Returns:
        The path of the file.

    Raises:
        ResultsNotWritable: the folder is not writable.
    """
    document = tomlkit.document()
    document["session"] = {"name": name}
    if robot_file is not None:
        document["robot"] = {"file": robot_file}
    document["camera"] = _drop_none(camera)
    document["markers"] = {"names": list(markers)}
    if fit:
        document["fit"] = _drop_none(fit)
    document["trial"] = [_drop_none(trial) for trial in trials]
    path = folder / SESSION_FILE
    write_whole(path, tomlkit.dumps(document))
    return path


def check_empty(folder: Path) -> None:
    """Check that a folder is not there, or empty.

    Raises:
        InputError: it is neither.
    """
    if folder.exists() and not (folder.is_dir() and not any(folder.iterdir())):
        there, step = "something that is already there", "Choose another folder."
        expected = "a new or empty folder"
        raise InputError([Fault(str(folder), "", "cannot make a session here", there, expected, next_step=step)])


@contextmanager
def new_folder(folder: Path) -> Iterator[Path]:
    """Give the block a temporary folder, which becomes `folder` when the block ends well.

    When the block fails, or is interrupted, nothing of it is left.

    Raises:
        InputError: `folder` is there and not empty.
        ResultsNotWritable: the operating system refused.
    """
    folder = folder.absolute()
    check_empty(folder)
    part: Path | None = None
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        part = Path(tempfile.mkdtemp(prefix=f".{folder.name}.part.", dir=folder.parent))
        part.chmod(0o755)
        yield part
        if folder.exists():
            folder.rmdir()
        part.replace(folder)
    except OSError as error:
        raise ResultsNotWritable(
            f"{folder}: the session cannot be made; found: {error.strerror or error}; "
            "expected: a writable place. Choose a folder that you may write to."
        ) from error
    finally:
        if part is not None:
            shutil.rmtree(part, ignore_errors=True)


def new_from_fishsim(session_folder: Path, source: Path, fit: Sequence[str] = ()) -> Path:
    """Make a session of the public tracks that accompany Michelis et al. (2026), in a new or empty folder.

    Args:
        session_folder: the folder to make.
        source: a checkout of the authors' repository, or a folder of its ``f1_00.csv`` or ``markers_f1_00.csv``.
        fit: trials to fit, the others are held out; default: those of `FISHSIM_FIT` that are there.

    Raises:
        InputError: no such files, faulty files, a name in `fit` that is not there, or the folder is not empty.
        ResultsNotWritable: the folder cannot be written.
    """
    files = _fishsim_files(source)
    fitted = _choose_fitted(source, tuple(fit), tuple(files))
    faults = FaultCollector()
    for path in files.values():
        with faults.nested():
            load_tracks(path, FISHSIM_MARKERS, FISHSIM_FPS)
    faults.raise_if_any()
    with new_folder(session_folder) as part:
        (part / "trials").mkdir()
        for name, path in files.items():
            shutil.copyfile(path, part / "trials" / f"{name}.csv")
        write_session_toml(
            part,
            name=session_folder.absolute().name,
            camera={"fps": FISHSIM_FPS, "scale_length_m": FISHSIM_SCALE_M},
            markers=FISHSIM_MARKERS,
            trials=[_fishsim_trial(name, name in fitted) for name in files],
        )
        load_session(part, check_tracks=False)
    return session_folder


def _fishsim_files(source: Path) -> dict[str, Path]:
    """Find the track files by trial name, slowest first."""
    folder = next((place for place in (source / "Data" / "Markers", source) if place.is_dir()), source)
    found = sorted(folder.glob("*.csv")) if folder.is_dir() else []
    named = {match[1]: path for path in found if (match := re.fullmatch(r"(?:markers_)?(f\d+_\d+)\.csv", path.name))}
    if not named:
        there = "CSV files of other names" if found else "no CSV files" if source.is_dir() else "no folder"
        expected = "a checkout with Data/Markers/markers_f1_00.csv, or a folder with f1_00.csv"
        what = "no tracks of the public robot fish here"
        step = "Clone https://github.com/srl-ethz/fishsim and name its folder."
        raise InputError([Fault(str(source), "", what, there, expected, next_step=step)])
    return dict(sorted(named.items(), key=lambda item: _label_hz(item[0])))


def _choose_fitted(source: Path, asked: tuple[str, ...], there: tuple[str, ...]) -> tuple[str, ...]:
    faults = FaultCollector(str(source))
    for name in (name for name in asked if name not in there):
        what, hint = "no such trial to fit", did_you_mean(name, there)
        faults.add("", what, found=repr(name), expected="trials that are there", choices=there, next_step=hint)
    fitted = asked or tuple(name for name in FISHSIM_FIT if name in there)
    if not fitted:
        faults.add("", "no trial to fit", expected="at least one", choices=there, next_step="Name it with --fit.")
    faults.raise_if_any()
    return fitted


def _fishsim_trial(name: str, fitted: bool) -> dict[str, Any]:
    label = tomlkit.item(_label_hz(name)).comment(
        "the label of the file, published as the motor's Hz: tails beat at 0.75 of it"
    )
    return {
        "name": name,
        "kind": "swim",
        "tracks": f"trials/{name}.csv",
        "commanded_hz": label,
        "role": "fit" if fitted else "holdout",
    }


def _label_hz(name: str) -> float:
    """Read the command from a trial's label: f1_25 is 1.25 crank turns a second."""
    return float(name.removeprefix("f").replace("_", "."))


def _drop_none(table: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in table.items() if value is not None}
