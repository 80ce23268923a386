"""Check and open what a user gives to a function of `calib.interface`: session, files, effects, options, scheduler."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from calib.options import EffortName, Options
from swimcal.errors import Fault, FaultCollector, InputError, SwimcalError
from swimcal.session import SESSION_FILE, Session

if TYPE_CHECKING:
    from calib.batch import Work
    from swimcal.effects.effect import Effect


AnySession = Session | str | Path

FISHSIM = "--from-fishsim DIR"
SYNTHETIC = "--synthetic"
_OPTIONS_OF_NEW = {
    "--videos or --tracks": ("--robot", "--fps", "--commands", "--fit", "--rename", "--like"),
    FISHSIM: ("--fit",),
    SYNTHETIC: ("--robot", "--seed", "--like"),
}
"""The sources of the trials of a new session, and the options that each may have."""


def check_options(sources: Mapping[str, bool], options: Mapping[str, object]) -> None:
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


def check_fps(fps: float | None) -> None:
    """Raise an `InputError` for frames a second that are none; None where they are not given."""
    if fps is not None and not 0 < fps < float("inf"):
        raise InputError([Fault("the options", "--fps", "not a frame rate", f"{fps:g}", "a number above 0")])


def folder_of(session: AnySession) -> Path:
    """Return the folder of a session.

    Raises:
        InputError: it is no session.
    """
    if isinstance(session, Session):
        return session.folder
    if not isinstance(session, str | Path):
        expected = "its folder, or what `open_session` gives"
        raise InputError([Fault("session", "", "no session", repr(session), expected)])
    path = Path(session)
    return path.parent if path.name == SESSION_FILE else path


def list_folders(sessions: Iterable[AnySession]) -> list[Path]:
    """Return the folders of several sessions.

    Raises:
        InputError: there is none.
    """
    folders = [folder_of(each) for each in sessions]
    if not folders:
        raise InputError([Fault("sessions", "", "no session", "an empty list", "one or more")])
    return folders


def list_paths(paths: Any) -> list[Any]:
    """List the paths of one or several files; what is no path is left to those who look into it."""
    listed = [paths] if isinstance(paths, str | Path) or hasattr(paths, "data_vars") else paths
    return [Path(path) if isinstance(path, str | Path) else path for path in listed]


def is_robot(source: AnySession | None) -> bool:
    """Tell whether a source is the file of a robot, or nothing, which stands for the published one."""
    if source is None:
        return True
    return not isinstance(source, Session) and Path(source).suffix == ".toml" and Path(source).name != SESSION_FILE


def find_effects(effects: Iterable[str | Effect]) -> Iterable[Effect]:
    """Return effects, each given as itself or by its name in the catalogue.

    Raises:
        InputError: a name is not in the catalogue.
    """
    from calib.stages.diagnosis import check_names
    from swimcal.effects.catalogue import catalogue
    from swimcal.effects.effect import Effect

    asked = [effects] if isinstance(effects, str) else list(effects)
    check_names("effects", [each for each in asked if isinstance(each, str)], catalogue())
    return (each if isinstance(each, Effect) else catalogue()[each] for each in asked)


def working_on(session: AnySession, options: Options, progress: bool, needs_commands: bool = True) -> Any:
    """Return a context in which a session is worked on, `calib.pipeline.working`.

    Args:
        session: the session.
        options: options of the commands.
        progress: whether progress is shown.
        needs_commands: whether every swim needs its commanded frequency.
    """
    from calib.pipeline import working

    return working(folder_of(session), not progress, options, needs_commands)


def compute_elsewhere(scheduler: str | None, session: AnySession, effort: EffortName | None, work: Work) -> None:
    """Let a dask worker do the work where a scheduler is given; its results are then current here."""
    if scheduler is not None:
        from calib.batch import run_all

        for why in run_all([folder_of(session)], effort, scheduler=scheduler, work=work).values():
            raise SwimcalError(why)
