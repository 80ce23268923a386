"""Functions on what is there: report, viewer, exported model, twin, effects, comparison, check-up."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from calib.given import AnySession, find_effects, folder_of, is_robot, list_folders, working_on
from calib.options import Options
from swimcal.errors import Fault, InputError
from swimcal.results import write_whole
from swimcal.session import Session

if TYPE_CHECKING:
    import pandas as pd

    from calib.results.fit import FitResult
    from calib.results.gap import GapResult, PosteriorResult
    from calib.results.result import Export
    from calib.results.twin import SwimTwin
    from swimcal.effects.effect import Effect


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
        entry, note = report_session(folder_of(sessions))
        assert entry.report is not None
        return Export((entry.report,), (note,))
    several = [sessions] if isinstance(sessions, Session | str | Path) else sessions
    return index_sessions(list_folders(several), index, {})


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

    with working_on(session, Options(), True) as pipeline:
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

    if is_robot(source):
        robot = load_robot(source if source is None else Path(source))  # type: ignore[arg-type]
        write_whole(Path(out), nominal_mjcf(robot))
        return Export((Path(out),), (f"{robot.name}, nominal: the published coefficients",))
    with working_on(source, Options(), False) as pipeline:  # type: ignore[arg-type]
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

    if is_robot(source):
        robot = load_robot(source if source is None else Path(source))  # type: ignore[arg-type]
        water, markers, fitted_hz = PUBLISHED_COEFFICIENTS, tuple(robot.markers), None
    else:
        with working_on(source, Options(workers=workers), False) as pipeline:  # type: ignore[arg-type]
            stage = pipeline.the_fit()
            found, robot, markers = stage.result(), stage.robot, pipeline.session.markers
            water, fitted_hz = found.coefficients, found.fitted_hz
    if coefficients is not None:
        water, fitted_hz = check_coefficients(coefficients), None
    engine, chosen = Twin(robot, markers, workers=workers), tuple(find_effects(effects))
    return SwimTwin(robot, water, AffectedTwin(engine, chosen) if chosen else engine, fitted_hz)


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

    Where sessions share a name, it is that of the folder; where folders do, their paths.

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
    if not results:
        raise InputError([Fault("compare", "", "nothing to compare", expected="sessions, or results of one kind")])
    sessions = [result.session for result in results]
    names = [each.name for each in sessions]
    if len(set(names)) < len(names):
        names = [each.folder.name for each in sessions]
    if len(set(names)) < len(names):
        names = [str(each.folder) for each in sessions]
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
    checks += [] if session is None else check_session(folder_of(session))
    checks += check_motor() if motor else []
    return pd.DataFrame(checks, columns=["check", "state", "found", "step"]).set_index("check")


def _current_fit(session: AnySession) -> FitResult:
    with working_on(session, Options(), False) as pipeline:
        from calib.results.made import fit_result

        return fit_result(pipeline)
