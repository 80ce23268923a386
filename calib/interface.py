"""The functions behind `import calib`, one a command; the command line is a thin layer on top of them.

Commands with commands of their own are modules: `calib.camera` (board, lens, scale), `calib.capture` (scan, run,
emulate: the motor) and `calib.policy` (train, evaluate, play, aquarium).

A session is given as what `open_session` returns, or as the path of its folder. What has not changed since it was made
is not made again, so that every function returns at once where its results are current. Functions that compute are
`run`, `track`, `fit`, `posterior`, `diagnose` and `effect_test`; all others use existing results. Results are frozen
and read from finished files; every one has `to_frame()`, `summary()` and, where there is something to see, `plot`.

The same in all functions: `session` is opened, or its folder; `effort`, "quick" or "full", says how hard to search:
None takes that of the current result, without one that of the fit, without a fit "full"; `workers` are threads, 0
for all cores; `progress` is shown on standard error; `scheduler`, the address of a dask scheduler, has one of its
workers compute, which needs to see the same folder: `InputError` where none answers or is of another version; what
fails there is a plain `SwimcalError` here.

Errors are a `SwimcalError`: `InputError` (all faults of what was given, at once), `NotEnoughData`, `NotConverged`,
`SimulationDiverged`, `ModelMismatch`, `SessionLocked`, `ResultsNotWritable`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from calib import camera, capture, policy
from calib.kept_output import keep_output
from calib.options import EffortName, LastStepName, ObjectiveName, Options, check_last_step
from swimcal.errors import (
    Fault,
    FaultCollector,
    InputError,
    ModelMismatch,
    NotConverged,
    NotEnoughData,
    ResultsNotWritable,
    SessionLocked,
    SimulationDiverged,
    SwimcalError,
)
from swimcal.results import write_whole
from swimcal.session import SESSION_FILE, Session
from swimcal.tracks import NO_NAMES

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from calib.batch import Work
    from calib.pipeline import Pipeline
    from calib.results.fit import FitResult, StructureResult
    from calib.results.gap import EffectTest, GapResult, PosteriorResult
    from calib.results.result import Export
    from calib.results.tracks import TrackResult
    from calib.results.twin import SwimTwin, draw_robot
    from swimcal.effects.effect import Effect, Parameter
    from tracking.follow_video import TrackerName

__all__ = [
    "Effect",
    "EffectTest",
    "FitResult",
    "GapResult",
    "InputError",
    "ModelMismatch",
    "NotConverged",
    "NotEnoughData",
    "Parameter",
    "PosteriorResult",
    "ResultsNotWritable",
    "Session",
    "SessionLocked",
    "SimulationDiverged",
    "StructureResult",
    "SwimTwin",
    "SwimcalError",
    "TrackResult",
    "camera",
    "capture",
    "compare",
    "convert_tracks",
    "correct",
    "diagnose",
    "doctor",
    "draw_robot",
    "effect_test",
    "effects",
    "export_mjcf",
    "fit",
    "load_tracks",
    "load_twin",
    "new_session",
    "open_session",
    "policy",
    "posterior",
    "report",
    "run",
    "track",
    "view",
]

AnySession = Session | str | Path

FISHSIM = "--from-fishsim DIR"
SYNTHETIC = "--synthetic"
_OPTIONS_OF_NEW = {
    "--videos or --tracks": ("--robot", "--fps", "--commands", "--fit", "--rename", "--like"),
    FISHSIM: ("--fit",),
    SYNTHETIC: ("--robot", "--seed", "--like"),
}
"""The sources of the trials of a new session, and the options that each may have."""


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

    return pipeline.open_session(_folder(folder), needs_commands=False)


def fit(
    session: AnySession,
    effort: EffortName | None = None,
    *,
    workers: int = 0,
    objective: ObjectiveName = "likelihood",
    progress: bool = True,
    scheduler: str | None = None,
) -> FitResult | StructureResult:
    """Fit the five fluid coefficients, with hinges, crank, frequencies, phases and elongated body theory; forecast.

    The coefficients are the mode of a hierarchical model of the fit trials, which also has what differs from
    trial to trial (trim, registration of the head frame, boxes, start) and a model discrepancy over frequency. Every
    held-out trial is forecast by the twin alone, given the frequency, and after its first two beats; compared with a
    line, a power law and a constant stride through the fitted speeds, and the continuation of its first two beats.

    Hinge stiffness and damping come from free decays, and with these the crank arm from dry runs. What was not recorded
    is assumed to be as the robot is described. A previous fit is kept in `results/kept`.

    Args:
        session: an opened session, or its folder.
        effort: "quick" or "full"; default: that of the current result, else of the fit, else "full".
        workers: threads; 0 for all cores.
        progress: show the progress on standard error.
        scheduler: address of a dask scheduler, one of whose workers computes; it needs to see the same folder.
        objective: "published" also runs the published search (Bayesian optimisation, then Nelder-Mead, of the mean
            marker distance) and keeps it next to the fit, for comparison; it takes minutes.

    Returns:
        The fit; for a session without a swim trial what the dry experiments alone determine.

    Raises:
        InputError, NotEnoughData, SimulationDiverged: what keeps trials from being fitted, all at once.

    Source:
        Kennedy and O'Hagan (2001), calibration with a discrepancy; Patterson and Thompson (1971), restricted
        likelihood. Michelis et al. (2026), "Simple Models, Real Swimming": crank grid search, head frame.

    Example:
        >>> found = calib.fit("pool", "quick", progress=False)
        >>> list(found.to_frame().index)
        ['slow', 'fast']
    """
    work = partial(_fit, objective=objective)
    _compute_elsewhere(scheduler, session, effort, work)
    with _working(session, Options(effort, workers), progress) as pipeline:
        work(pipeline)
        keep_output(pipeline)
        return _result_of_fit(pipeline)


def posterior(
    session: AnySession,
    effort: EffortName | None = None,
    *,
    workers: int = 0,
    progress: bool = True,
    scheduler: str | None = None,
) -> PosteriorResult:
    """Sample the posterior of the five coefficients given the fit trials; fit first where there is no fit.

    Args:
        session: an opened session, or its folder.
        effort: "quick" or "full"; default: that of the current result, else of the fit, else "full".
        workers: threads; 0 for all cores.
        progress: show the progress on standard error.
        scheduler: address of a dask scheduler, one of whose workers computes; it needs to see the same folder.

    Raises:
        NotConverged: draws that must not be relied on; none are reported.
        InputError, NotEnoughData, SimulationDiverged: as `fit`.

    Source:
        Goodman and Weare (2010), affine-invariant ensemble sampler, by emcee.

    Example:
        >>> list(calib.posterior("pool", "quick", progress=False).to_frame("coefficients").index)[:2]
        ['blunt_drag', 'slender_drag']
    """
    from calib.pipeline import Pipeline
    from calib.results.made import posterior_result

    _compute_elsewhere(scheduler, session, effort, Pipeline.posterior)
    with _working(session, Options(effort, workers), progress) as pipeline:
        stage = pipeline.posterior()
        keep_output(pipeline)
        return posterior_result(pipeline, stage)


def diagnose(
    session: AnySession,
    effort: EffortName | None = None,
    *,
    exclude: Iterable[str] = (),
    effects: Iterable[str | Effect] | None = None,
    reference: AnySession | None = None,
    workers: int = 0,
    progress: bool = True,
    scheduler: str | None = None,
) -> GapResult:
    """Locate the sim-to-real gap, rank its likely causes, and measure how far it shrinks with the named effects.

    Args:
        session: an opened session, or its folder.
        effort: "quick" or "full"; default: that of the current result, else of the fit, else "full".
        workers: threads; 0 for all cores.
        progress: show the progress on standard error.
        scheduler: address of a dask scheduler, one of whose workers computes; it needs to see the same folder.
        exclude: names of effects that the catalogue is to lack.
        effects: the catalogue of this diagnosis: names, or effects of your own; default: all.
        reference: a session of the same robot, camera and water, filmed before something changed: the effects are then
            those of the change. It is fitted first where it has no fit.

    Raises:
        InputError: no effect of this name; a reference of another robot or camera; or as `fit`.
        NotEnoughData: no swim trial has the role "fit".
        SimulationDiverged: the plain twin, from every start.

    Example:
        >>> gap = calib.diagnose("pool", "quick", progress=False)
        >>> round(sum(gap.where.by_stage.values()), 6)
        1.0
    """
    from calib.pipeline import Pipeline
    from calib.results.made import gap_result
    from calib.stages.diagnosis import check_names
    from swimcal.effects.catalogue import catalogue
    from swimcal.effects.effect import Effect

    asked = list(catalogue().values()) if effects is None else list(effects)
    own = tuple(effect for effect in asked if isinstance(effect, Effect))
    named = {effect.name if isinstance(effect, Effect) else effect for effect in asked}
    check_names("effects", sorted(named), dict(catalogue()) | {effect.name: effect for effect in own})
    without = frozenset(exclude) | (frozenset(catalogue()) - named)
    further = tuple(each for each in own if each.name not in catalogue())
    healthy = None if reference is None else _folder(reference)
    work = partial(Pipeline.diagnosis, without=without, own=further, reference=healthy)
    _compute_elsewhere(scheduler, session, effort, work)
    with _working(session, Options(effort, workers), progress) as pipeline:
        stage = pipeline.diagnosis(without, own=further, reference=healthy)
        keep_output(pipeline)
        return gap_result(pipeline, stage)


def effect_test(
    session: AnySession,
    effects: Iterable[str],
    effort: EffortName | None = None,
    *,
    workers: int = 0,
    progress: bool = True,
) -> EffectTest:
    """Test some effects of the catalogue together: log Bayes factor over the plain twin; computed anew every time.

    Args:
        session: an opened session, or its folder.
        effects: names of the effects.
        effort: "quick" or "full"; default: as `diagnose`.
        workers: threads; 0 for all cores.
        progress: show the progress on standard error.

    Raises:
        InputError, NotEnoughData, SimulationDiverged: as `diagnose`.

    Example:
        >>> found = calib.effect_test("pool", ["camera_parallax"], "quick", progress=False)
        >>> found.log_bayes_factor < 0              # the trials are against it
        True
    """
    from calib.results.made import test_result

    with _working(session, Options(effort, workers), progress) as pipeline:
        return test_result(pipeline, pipeline.effect_test(tuple(effects)))


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
    with _working(session, options, progress, needs_commands=False) as pipeline:
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
        'filmed/trials/f1_25.edits.jsonl: added line 1; 1 edit counts. `calib track` replays them'
    """
    from calib.results.tracks import correct_track

    return correct_track(_folder(session), trial, correction)


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

    faults = FaultCollector("the options")
    _check_fps(fps, faults)
    faults.raise_if_any()
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
    _check_fps(fps, faults)
    if not all(names) or len(set(names)) < len(names):
        faults.add("--markers", "not a list of markers", found=", ".join(names), expected="each marker once")
    if Path(out).suffix in (".h5", ".hdf5"):
        faults.add("--out", "HDF5 is not written", found=str(out), expected="a name that ends in .csv or .nc")
    if Path(out).suffix == ".gz":
        faults.add("--out", "packed files are read, not written", found=str(out), expected="a name without .gz")
    faults.raise_if_any()
    export_tracks(as_tracked(import_tracks(Path(path), names, fps, rename)), Path(out), to)
    return Path(out)


def run(
    sessions: AnySession | Sequence[AnySession],
    effort: EffortName | None = None,
    *,
    until: LastStepName = "diagnosis",
    jobs: int = 1,
    workers: int = 0,
    scheduler: str | None = None,
    progress: bool = True,
) -> FitResult | StructureResult | Export:
    """Run every stage a session has data for, then write the report.

    The stages are tracks, fit, MJCF, posterior and diagnosis.

    Args:
        sessions: one, or several: then a session that fails stops no other.
        effort: "quick" or "full"; default: that of the current result, else of the fit, else "full".
        until: the last step before the report: "fit", "posterior" or "diagnosis".
        jobs: sessions at a time, each in a process of its own.
        workers: threads of each session; 0 for its share of the cores, one with a scheduler.
        scheduler: address of a dask scheduler, whose workers run the sessions; they need to see the same folders.
        progress: show the progress on standard error.

    Returns:
        The fit, or what the dry experiments alone determine; for several sessions, or with a scheduler, their reports
        and the index, as `report`.

    Raises:
        InputError, NotEnoughData, SimulationDiverged: as `fit`, of a single session. Draws that did not converge are
            only reported in `notes`.
        InputError: no scheduler answers, or a worker has another version of the program or the engine.

    Example:
        >>> calib.run("pool", "quick", progress=False).file.name
        'calibration.json'
    """
    from calib.batch import index_sessions, run_all, run_pipeline

    check_last_step(until)
    options = Options(effort, workers)
    if jobs < 1:
        raise InputError([Fault("jobs", "", "no number of sessions at a time", str(jobs), "1 or more")])
    if isinstance(sessions, Session | str | Path):
        if scheduler is None:
            with _working(sessions, options, progress) as pipeline:
                run_pipeline(pipeline, until)
                keep_output(pipeline)
                return _result_of_fit(pipeline)
        sessions = [sessions]
    folders = _list_folders(sessions)
    return index_sessions(
        folders, None, run_all(folders, effort, jobs, workers, progress, scheduler, partial(run_pipeline, until=until))
    )


def report(sessions: AnySession | Sequence[AnySession], index: str | Path | None = None) -> Export:
    """Write the HTML report of the current results of each session, and an index of several; nothing is fitted.

    Args:
        sessions: one, or several: then one without a report is listed in the index with the reason.
        index: where the index goes, with a CSV of the same numbers; default: `index.html` next to the first session.

    Returns:
        The pages, the index last, and what they show.

    Raises:
        InputError: a single session has no fit of its recordings; names the command that makes one.

    Example:
        >>> calib.report("pool").file.name
        'report.html'
        >>> calib.report(["pool", "filmed"]).failures           # one that fails stops no other
        {'filmed': 'filmed/results/calibration.json: ... Run `calib fit filmed`.'}
    """
    from calib.batch import index_sessions, report_session
    from calib.results.result import Export

    if isinstance(sessions, Session | str | Path) and index is None:
        entry, note = report_session(_folder(sessions))
        assert entry.report is not None
        return Export((entry.report,), (note,))
    several = [sessions] if isinstance(sessions, Session | str | Path) else sessions
    return index_sessions(_list_folders(several), index, {})


def view(session: AnySession, *, open_viewer: bool = False, inline: bool = False) -> Export:
    """Write the rerun recording of the current tracks, with the twin and the missing forces where there are any.

    Args:
        session: an opened session, or its folder.
        open_viewer: also open it in the Rerun viewer.
        inline: also show it in the notebook; where that cannot be, `notes` say why.

    Raises:
        NotEnoughData: no trial has tracks; names the command that makes them.
        SwimcalError: the viewer cannot be opened.

    Example:
        >>> calib.view("pool").file.name
        'session.rrd'
    """
    from calib import viewer as recording
    from calib.results.result import Export

    with _working(session, Options(), True) as pipeline:
        file = recording.make_recording(pipeline)
    if open_viewer:
        recording.open_viewer(file)
    why_not = recording.show_inline(file) if inline else ""
    return Export((file,), (*pipeline.notes, *filter(None, [why_not])))


def export_mjcf(source: AnySession | None = None, out: str | Path = "robot.xml") -> Export:
    """Write an MJCF for a plain `mujoco`: of the current fit for a session, nominal for a robot; nothing is fitted.

    Args:
        source: a session, or a robot's TOML; default: the published 0.57 m fish.
        out: the file to write.

    Raises:
        InputError: the session has no fit of its recordings, or the robot's file has faults.
        ResultsNotWritable: `out` cannot be written.

    Example:
        >>> import mujoco
        >>> made = calib.export_mjcf(out="fish.xml")
        >>> mujoco.MjModel.from_xml_path(str(made.file)).nu     # the motor
        1
    """
    from calib.results.result import Export
    from calib.stages.fit import nominal_mjcf
    from swimcal.robot import load_robot

    if _is_robot(source):
        robot = load_robot(source if source is None else Path(source))  # type: ignore[arg-type]
        write_whole(Path(out), nominal_mjcf(robot))
        return Export((Path(out),), (f"{robot.name}, nominal: the published coefficients",))
    with _working(source, Options(), False) as pipeline:  # type: ignore[arg-type]
        stage = pipeline.the_fit()
        write_whole(Path(out), stage.mjcf_file.read_bytes())
    return Export((Path(out),), (f"{pipeline.session.name}: {stage.name}",))


def load_twin(
    source: AnySession | None = None,
    *,
    coefficients: Sequence[float] | None = None,
    effects: Iterable[str | Effect] = (),
    workers: int = 0,
) -> SwimTwin:
    """Load a twin to drive, by `SwimTwin.swim`: of the current fit for a session, or of a robot.

    Args:
        source: a session, or a robot's TOML; default: the published 0.57 m fish.
        coefficients: blunt, slender and angular drag, Kutta and Magnus lift; default: those of the fit, for a robot the
            published ones.
        effects: names of the catalogue, or effects of your own, that the twin is to have.
        workers: threads; 0 for all cores.

    Raises:
        InputError: no current fit, no such effect, or faults of the robot's file.

    Example:
        >>> swim = calib.load_twin().swim([0.8, 1.2], seconds=4.0)
        >>> swim.position.dims, bool(swim.speed[1] > swim.speed[0] > 0)
        (('run', 'time', 'space', 'keypoint'), True)
    """
    from calib.results.twin import SwimTwin, check_coefficients
    from swimcal.effects.affected_twin import AffectedTwin
    from swimcal.mjcf import PUBLISHED_COEFFICIENTS
    from swimcal.robot import load_robot
    from swimcal.twin import Twin

    if _is_robot(source):
        robot = load_robot(source if source is None else Path(source))  # type: ignore[arg-type]
        water, markers = PUBLISHED_COEFFICIENTS, tuple(robot.markers)
    else:
        with _working(source, Options(workers=workers), False) as pipeline:  # type: ignore[arg-type]
            stage = pipeline.the_fit()
            robot, water, markers = stage.robot, stage.result().coefficients, pipeline.session.markers
    if coefficients is not None:
        water = check_coefficients(coefficients)
    engine, chosen = Twin(robot, markers, workers=workers), tuple(_find_effects(effects))
    return SwimTwin(robot, water, AffectedTwin(engine, chosen) if chosen else engine)


def effects() -> Mapping[str, Effect]:
    """Return the catalogue by name: the effects that the twin leaves out and a diagnosis may name.

    Example:
        >>> calib.effects()["crank_arm_error"].parameters[0].unit
        '1'
    """
    from swimcal.effects.catalogue import catalogue

    return catalogue()


def compare(
    items: Iterable[AnySession | FitResult | PosteriorResult | GapResult], table: str = "trials"
) -> pd.DataFrame:
    """Join a table of several sessions; the first level of its index is the session's name.

    Args:
        items: results of one kind; a session or its folder means its current fit.
        table: name of the table, as their `to_frame` takes it.

    Raises:
        InputError: a session has no current fit, or no such table.

    Example:
        >>> calib.compare(["pool"], "coefficients").index[0]
        ('synthetic', 'blunt_drag')
    """
    import pandas as pd

    several = [items] if isinstance(items, Session | str | Path) else items
    results = [_current_fit(item) if isinstance(item, Session | str | Path) else item for item in several]
    names = [result.session.name for result in results]
    return pd.concat([result.to_frame(table) for result in results], keys=names, names=["session"])


def doctor(session: AnySession | None = None, *, motor: bool = False) -> pd.DataFrame:
    """Check the installation and, if given, a session and the motor connection.

    Args:
        session: an opened session, or its folder.
        motor: also look for the motor on every serial port; takes up to a minute.

    Returns:
        A row a check: `state` ("ok", "advice" or "fault"), `found` and `step`, what to do.

    Raises:
        Nothing: what is wrong is in the table.

    Example:
        >>> calib.doctor().loc["engine"].state
        'ok'
    """
    import pandas as pd

    from calib.checkup import check_installation, check_motor, check_session

    checks = [*check_installation()]
    checks += [] if session is None else check_session(_folder(session))
    checks += check_motor() if motor else []
    return pd.DataFrame(checks, columns=["check", "state", "found", "step"]).set_index("check")


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

    films, own = _list_paths(videos), tracks if isinstance(tracks, Mapping) else _list_paths(tracks)
    _check_options(
        {"--videos or --tracks": len(films) + len(own) > 0, FISHSIM: from_fishsim is not None, SYNTHETIC: synthetic},
        {"--robot": robot, "--fps": fps, "--commands": commands_hz, "--fit": fit}
        | {"--rename": dict(rename), "--seed": seed, "--like": like},
    )
    model = None if like is None else open_session(_folder(like))
    faults = FaultCollector("the options")
    _check_fps(fps, faults)
    faults.raise_if_any()
    if from_fishsim is not None:
        new_from_fishsim(Path(folder), Path(from_fishsim), tuple(fit))
    elif synthetic:
        from calib.progress_bar import progress_bar

        check_empty(Path(folder).absolute())  # before anything is simulated
        with progress_bar(quiet=not progress) as tell:
            file = robot if robot is not None or model is None else model.robot_file
            spec = None if file is None else load_robot(Path(file))
            tell("simulating the trials", 0.0)
            make_session(Path(folder), default_plan(seed or 0, spec))
    else:
        new_from_files(Path(folder), films, own, robot, fps, commands_hz, fit, rename, model)
    return Path(folder)


def __getattr__(name: str) -> Any:
    """Load what functions return or take, or draw, when it is asked for: with the libraries behind it takes seconds."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from calib.results.fit import FitResult, StructureResult
    from calib.results.gap import EffectTest, GapResult, PosteriorResult
    from calib.results.tracks import TrackResult
    from calib.results.twin import SwimTwin, draw_robot
    from swimcal.effects.effect import Effect, Parameter

    results = (FitResult, StructureResult, PosteriorResult, GapResult, EffectTest, TrackResult)
    return {each.__name__: each for each in (*results, SwimTwin, draw_robot, Effect, Parameter)}[name]


def _fit(pipeline: Pipeline, objective: ObjectiveName) -> None:
    if pipeline.only_dry:
        pipeline.structured()
        return
    pipeline.fit()
    if objective == "published":
        pipeline.published()


def _result_of_fit(pipeline: Pipeline) -> FitResult | StructureResult:
    from calib.results.made import fit_result, structure_result

    return structure_result(pipeline) if pipeline.only_dry else fit_result(pipeline)


def _check_fps(fps: float | None, faults: FaultCollector) -> None:
    if fps is not None and not 0 < fps < float("inf"):
        faults.add("--fps", "not a frame rate", found=f"{fps:g}", expected="a number above 0")


def _compute_elsewhere(scheduler: str | None, session: AnySession, effort: EffortName | None, work: Work) -> None:
    """Let a dask worker do the work where a scheduler is given; its results are then current here."""
    if scheduler is not None:
        from calib.batch import run_all

        for why in run_all([_folder(session)], effort, scheduler=scheduler, work=work).values():
            raise SwimcalError(why)


def _check_options(sources: Mapping[str, bool], options: Mapping[str, object]) -> None:
    """Check that trials come from one source, and that every option means something for it."""
    faults, given = FaultCollector("a new session"), [name for name, is_given in sources.items() if is_given]
    if len(given) != 1:
        what, found = "several sources of trials" if given else "no trials", ", ".join(given)
        faults.add("", what, found=found, expected="one of these", choices=tuple(_OPTIONS_OF_NEW))
    meant = {option for name in given or _OPTIONS_OF_NEW for option in _OPTIONS_OF_NEW[name]}
    for option, value in options.items():
        if value not in (None, (), [], {}) and option not in meant:
            of_others = [name for name, theirs in _OPTIONS_OF_NEW.items() if option in theirs]
            what, step = f"means nothing with {' and '.join(given)}", f"Leave it out; it is for {', '.join(of_others)}."
            found = ", ".join(map(str, value)) if isinstance(value, list | tuple) else str(value)
            faults.add(option, what, found=found, choices=tuple(sorted(meant)), next_step=step)
    faults.raise_if_any()


def _folder(session: AnySession) -> Path:
    if isinstance(session, Session):
        return session.folder
    if not isinstance(session, str | Path):
        expected = "its folder, or what `open_session` gives"
        raise InputError([Fault("session", "", "no session", repr(session), expected)])
    path = Path(session)
    return path.parent if path.name == SESSION_FILE else path


def _list_folders(sessions: Iterable[AnySession]) -> list[Path]:
    """Return the folders of several sessions.

    Raises:
        InputError: there is none.
    """
    folders = [_folder(each) for each in sessions]
    if not folders:
        raise InputError([Fault("sessions", "", "no session", "an empty list", "one or more")])
    return folders


def _list_paths(paths: Any) -> list[Any]:
    """List the paths of one or several files; what is no path is left to those who look into it."""
    listed = [paths] if isinstance(paths, str | Path) or hasattr(paths, "data_vars") else paths
    return [Path(path) if isinstance(path, str | Path) else path for path in listed]


def _working(session: AnySession, options: Options, progress: bool, needs_commands: bool = True) -> Any:
    from calib.pipeline import working

    return working(_folder(session), not progress, options, needs_commands)


def _is_robot(source: AnySession | None) -> bool:
    if source is None:
        return True
    return not isinstance(source, Session) and Path(source).suffix == ".toml" and Path(source).name != SESSION_FILE


def _find_effects(effects: Iterable[str | Effect]) -> Iterable[Effect]:
    from calib.stages.diagnosis import check_names
    from swimcal.effects.catalogue import catalogue
    from swimcal.effects.effect import Effect

    asked = [effects] if isinstance(effects, str) else list(effects)
    check_names("effects", [each for each in asked if isinstance(each, str)], catalogue())
    return (each if isinstance(each, Effect) else catalogue()[each] for each in asked)


def _current_fit(session: AnySession) -> FitResult:
    with _working(session, Options(), False) as pipeline:
        from calib.results.made import fit_result

        return fit_result(pipeline)
