"""Functions on sessions and their tracks: open or make a session, track its videos, read and convert tracks."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from calib.given import FISHSIM, SYNTHETIC, AnySession, check_fps, check_options, folder_of, list_paths, working_on
from calib.options import Options
from swimcal.errors import FaultCollector
from swimcal.session import Session
from swimcal.tracks import NO_NAMES

if TYPE_CHECKING:
    import xarray as xr

    from calib.results.result import Export
    from calib.results.tracks import TrackResult
    from tracking.follow_video import TrackerName


def open_session(folder: str | Path) -> Session:
    """Read and check a session folder, or its `session.toml`, with tracks, robot and markers; nothing is written.

    Raises:
        InputError: all faults of `session.toml` and of the files it names, at once.

    Example:
        >>> session = calib.open_session("pool")
        >>> [trial.name for trial in session.trials if trial.role == "fit"]
        ['slow']
    """
    from calib import pipeline

    return pipeline.open_session(folder_of(folder), needs_commands=False)


def new_session(  # noqa: PLR0913  it is the command `new`, of which a user gives three or four
    folder: str | Path,
    *,
    videos: Iterable[str | Path] = (),
    tracks: Iterable[str | Path] | Mapping[str, Any] = (),
    robot: str | Path | None = None,
    fps: float | None = None,
    commands_hz: Sequence[float] = (),
    from_fishsim: str | Path | None = None,
    synthetic: bool = False,
    fit: Sequence[str] = (),
    rename: Mapping[str, str] = NO_NAMES,
    seed: int | None = None,
    like: AnySession | None = None,
    progress: bool = True,
) -> Path:
    """Make a session folder of one's own videos or tracks, of the public tracks, or one simulated with the twin.

    Of your own files a commented `session.toml` is written with all that they contain; its first lines, marked TODO,
    list what you still have to fill in. The truth of a synthetic session, of swims, dry runs and free decays, is in
    `truth.json`. Nothing is missing from the twin there, so a diagnosis is to find nothing.

    Args:
        folder: the folder to make; new or empty.
        videos: one a trial, in any order; they are copied.
        tracks: one a trial, in any order; they are copied. They may also be datasets by the trial's name.
        robot: the robot's TOML, for your own files or a synthetic session; default: the published 0.57 m fish.
        fps: frames a second, needed for tracks and videos without time; with times it has to agree with them.
        commands_hz: crank turns a second, one a trial in the order of `videos`, then `tracks`; default: from
            names such as f1_25, else to fill in.
        from_fishsim: instead of your own files: the data of Michelis et al. (2026), "Simple Models, Real Swimming", a
            checkout of their repository, or a folder of its marker CSVs.
        synthetic: instead of files: simulate the trials.
        fit: trials to fit, the others are held out; default: every other one, of the public tracks f1_00 and f1_75.
        rename: names of the tracks' files, and which markers they are: `{"snout": "nose"}`.
        seed: seed of a synthetic session's noise, phases and headings; default: 0.
        like: a session of the same robot and camera, as a reference for `diagnose`: robot, frame rate, lens and names
            of markers are taken from it, and commands and roles of trials of the same name.
        progress: show the progress on standard error.

    Returns:
        The folder, for `open_session`.

    Raises:
        InputError: every fault of the files at once, no or several sources of trials, an argument that means nothing
            for these, or `folder` is not empty.
        ResultsNotWritable: the folder cannot be written.

    Example:
        >>> calib.new_session("mine", videos=["f0_75.mp4", "f1_25.mp4"])
        PosixPath('mine')
        >>> [(trial.name, trial.commanded_hz, trial.role) for trial in calib.open_session("mine").trials]
        [('f0_75', 0.75, 'fit'), ('f1_25', 1.25, 'holdout')]
    """
    from calib.new import new_from_files
    from swimcal.create_session import check_empty, new_from_fishsim
    from swimcal.robot import load_robot
    from swimsynth.plan import default_plan
    from swimsynth.session import make_session

    films, own = list_paths(videos), tracks if isinstance(tracks, Mapping) else list_paths(tracks)
    check_options(
        {"--videos or --tracks": len(films) + len(own) > 0, FISHSIM: from_fishsim is not None, SYNTHETIC: synthetic},
        {"--robot": robot, "--fps": fps, "--commands": commands_hz, "--fit": fit}
        | {"--rename": dict(rename), "--seed": seed, "--like": like},
    )
    model = None if like is None else open_session(folder_of(like))
    check_fps(fps)
    if from_fishsim is not None:
        new_from_fishsim(Path(folder), Path(from_fishsim), tuple(fit))
    elif synthetic:
        from calib.progress_bar import progress_bar

        check_empty(Path(folder).absolute())  # before anything is simulated
        with progress_bar(quiet=not progress) as tell:
            file = robot if robot is not None or model is None else model.robot_file
            spec = None if file is None else load_robot(Path(file))
            tell("simulating the trials", 0.0)
            plan = default_plan(seed or 0, spec)
            make_session(Path(folder), plan.model_copy(update={"name": Path(folder).absolute().name}))
    else:
        new_from_files(Path(folder), films, own, robot, fps, commands_hz, fit, rename, model)
    return Path(folder)


def track(
    session: AnySession,
    *,
    method: TrackerName | None = None,
    export: str = "",
    click: bool = False,
    frame: int | None = None,
    workers: int = 0,
    progress: bool = True,
) -> TrackResult | Export:
    """Track the markers in a session's videos, and read the tracks of its other trials.

    Args:
        session: an opened session, or its folder.
        workers: threads; 0 for all cores.
        progress: show the progress on standard error.
        method: "hybrid", "spots" or "csrt"; default: that of the existing tracks, else hybrid.
        export: another form to write next to the tracks: "deeplabcut", "movement" or "fishsim".
        click: track nothing, only write a page a video on which to click its start boxes: `<trial>.click.html`.
        frame: with `click`, the number of the frame that the pages show; default: that of the boxes, else the first.

    Raises:
        InputError: faults of videos, boxes or edits, after all other videos are tracked; with `click`, no video.

    Example:
        >>> tracks = calib.track("pool", progress=False)
        >>> tracks["slow"].position_head.dims
        ('time', 'space', 'keypoint')
    """
    from calib.results.made import track_result
    from calib.results.result import Export
    from calib.results.tracks import click_pages, track_videos

    options = Options(workers=workers, tracker=method)
    with working_on(session, options, progress, needs_commands=False) as pipeline:
        return Export(click_pages(pipeline, frame)) if click else track_result(pipeline, track_videos(pipeline, export))


def correct(session: AnySession, trial: str, correction: str | Mapping[str, Any]) -> str:
    """Add a correction to the edit log of a tracked trial; `track` replays it. Nothing is removed from the log.

    Args:
        session: an opened session, or its folder.
        trial: name of the trial.
        correction: for instance `{"op": "swap", "markers": ["tail_3", "tail_4"], "frames": [120, 180]}`; others:
            "drop", "relabel", "box" (set a box and track on), "undo". A mapping, or JSON.

    Raises:
        InputError: no such trial, or the correction or the log has faults.

    Example:
        >>> swapped = {"op": "swap", "markers": ["tail_3", "tail_4"], "frames": [2, 8]}
        >>> calib.correct("filmed", "f1_25", swapped)
        'filmed/trials/f1_25.edits.jsonl: added line 1; 1 edit counts. `calib track` replays them; ...'
    """
    from calib.results.tracks import correct_track

    return correct_track(folder_of(session), trial, correction)


def load_tracks(
    path: str | Path, markers: Sequence[str], fps: float | None = None, rename: Mapping[str, str] = NO_NAMES
) -> xr.Dataset:
    """Read tracks of any program: this one's CSV, DeepLabCut, SLEAP, movement, or the authors' headerless CSV.

    Args:
        path: the file; its form is recognised from its content.
        markers: names of the markers to take; in files without a header, their order.
        fps: frames a second, for forms without time.
        rename: names of the file, and which markers they are: `{"snout": "nose"}`.

    Returns:
        An `xarray.Dataset` with `position` (time, space, keypoint), px, x to the right and y down, nan where
        missing, and `confidence` (time, keypoint); attributes `fps`, `time_unit` and `source`, the file.

    Raises:
        InputError: every fault of the file at once.

    Example:
        >>> names = calib.open_session("pool").markers
        >>> calib.load_tracks("pool/trials/slow.csv.gz", names).position.attrs["units"]
        'px'
    """
    from tracking.formats import import_tracks

    check_fps(fps)
    return import_tracks(Path(path), tuple(markers), fps, rename)


def convert_tracks(
    path: str | Path,
    out: str | Path,
    to: str = "swimcal",
    *,
    markers: Sequence[str] = (),
    fps: float | None = None,
    rename: Mapping[str, str] = NO_NAMES,
) -> Path:
    """Convert tracks between this program, DeepLabCut, movement and the authors' CSV; SLEAP's CSV is read too.

    Args:
        path: the file; its form is recognised from its content.
        out: the file to write.
        to: "swimcal", "deeplabcut", "movement" or "fishsim".
        markers: names of the markers to take; in files without a header, their order; default: the published nine.
        fps: frames a second, for forms without time.
        rename: names of the file, and which markers they are: `{"snout": "nose"}`.

    Raises:
        InputError: every fault of the file or the options at once.
        ResultsNotWritable: `out` cannot be written.

    Example:
        >>> calib.convert_tracks("pool/trials/slow.csv.gz", "slow.nc", "movement").name
        'slow.nc'
    """
    from calib.results.tracks import check_form
    from swimcal.create_session import FISHSIM_MARKERS
    from tracking.formats import export_tracks, import_tracks
    from tracking.tracked import as_tracked

    check_form(to, "--to")
    names, faults = tuple(markers) or FISHSIM_MARKERS, FaultCollector("the options")
    with faults.nested():
        check_fps(fps)
    if not all(names) or len(set(names)) < len(names):
        faults.add("--markers", "not a list of markers", found=", ".join(names), expected="each marker once")
    if Path(out).suffix in (".h5", ".hdf5"):
        faults.add("--out", "HDF5 is not written", found=str(out), expected="a name that ends in .csv or .nc")
    if Path(out).resolve() == Path(path).resolve():
        faults.add("--out", "this is the file that is read", found=str(out), expected="another name")
    if Path(out).suffix == ".gz":
        faults.add("--out", "packed files are read, not written", found=str(out), expected="a name without .gz")
    faults.raise_if_any()
    export_tracks(as_tracked(import_tracks(Path(path), names, fps, rename)), Path(out), to)
    return Path(out)
