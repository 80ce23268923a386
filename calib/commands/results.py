"""Commands about a session and its results: `new`, `run`, `fit`, `posterior`, `diagnose`, `report`, `mjcf`."""

from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperCommand

import calib
from calib.commands.arguments import (
    AsJson,
    Effort,
    LastStep,
    ObjectiveOption,
    Rename,
    Scheduler,
    SessionFolder,
    SessionFolders,
    Verbose,
    Workers,
    renaming,
)
from calib.terminal import print_again, print_export, print_result

_MANY = ("--videos", "--tracks")


class SeveralFiles(TyperCommand):
    """A command whose options of files take all files up to the next option, as the shell expands ``*.mp4``."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Give each file an option of its own."""
        spread, option = [], ""
        for argument in args:
            if argument.startswith("-"):
                option = argument if argument in _MANY else ""
                spread += [] if option else [argument]
            else:
                spread += [option, argument] if option else [argument]
        return super().parse_args(ctx, spread)


def new(  # noqa: PLR0913
    session: Annotated[Path, typer.Argument(metavar="SESSION", help="the folder to make")],
    videos: Annotated[
        list[Path] | None, typer.Option(help="videos, one a trial; all that follow up to the next option")
    ] = None,
    tracks: Annotated[list[Path] | None, typer.Option(help="tracks in any form, one a trial; as --videos")] = None,
    robot: Annotated[Path | None, typer.Option(help="the robot's TOML; default: the published 0.57 m fish")] = None,
    fps: Annotated[
        float | None, typer.Option(help="frames a second; needed for tracks and videos without time")
    ] = None,
    commands: Annotated[
        str, typer.Option(help="crank turns a second of each trial, comma-separated; default: from names like f1_25")
    ] = "",
    from_fishsim: Annotated[
        Path | None,
        typer.Option(help="a checkout of the authors' repository, or a folder of its marker CSVs"),
    ] = None,
    synthetic: Annotated[bool, typer.Option("--synthetic", help="a session made with the twin, truth known")] = False,
    fit: Annotated[str, typer.Option(help="trials to fit on, comma-separated; the others are held out")] = "",
    rename: Rename = "",
    seed: Annotated[int | None, typer.Option(min=0, help="seed of a synthetic session; default: 0")] = None,
) -> None:
    """Make a session folder from your videos or tracks, and list what you still have to fill in."""
    from session.folder import SESSION_FILE

    calib.new_session(
        session,
        videos=videos or (),
        tracks=tracks or (),
        robot=robot,
        fps=fps,
        commands_hz=_parse_numbers(commands),
        from_fishsim=from_fishsim,
        synthetic=synthetic,
        fit=tuple(name.strip() for name in fit.split(",") if name.strip()),
        rename=renaming(rename),
        seed=seed,
    )
    for line in (session / SESSION_FILE).read_text(encoding="utf-8").splitlines():
        if line.startswith("# TODO"):
            print(f"to fill in: {line.removeprefix('# TODO ')}")
        elif line.startswith("# NOTE"):
            print(f"note: {line.removeprefix('# NOTE ')}")
    print(session)


def _parse_numbers(text: str) -> tuple[float, ...]:
    try:
        return tuple(float(number) for number in text.split(",") if number.strip())
    except ValueError as error:
        raise typer.BadParameter(
            f"found {text!r}, expected numbers such as 0.5,0.75", param_hint="--commands"
        ) from error


def run(
    sessions: SessionFolders,
    effort: Effort = None,
    until: Annotated[LastStep, typer.Option(help="the last step before the report")] = "diagnosis",
    jobs: Annotated[int, typer.Option(min=1, help="sessions at a time")] = 1,
    scheduler: Scheduler = None,
    workers: Workers = 0,
    verbose: Verbose = False,
    as_json: AsJson = False,
) -> None:
    """Run every stage the session has data for, then write the report.

    The stages are tracks, fit, MJCF, posterior and diagnosis. With several sessions, also write an index, as `calib
    report` does; one that fails stops no other.
    """
    alone = len(sessions) == 1 and scheduler is None and not as_json
    if alone and until == "diagnosis" and print_again("run", sessions[0], effort, verbose):
        return
    from calib.results.result import Export
    from calib.results.structure import StructureResult

    which = sessions if len(sessions) > 1 else sessions[0]
    made = calib.run(which, effort, until=until, jobs=jobs, workers=workers, scheduler=scheduler, progress=not as_json)
    if isinstance(made, Export):
        print_export(made, as_json)
        return
    page = None if isinstance(made, StructureResult) else made.session.results / "report.html"
    print_result(made, as_json, verbose, page)


def fit(
    session: SessionFolder,
    effort: Effort = None,
    workers: Workers = 0,
    objective: Annotated[
        ObjectiveOption,
        typer.Option(help="published: the published search as well (minutes), for comparison with the fit"),
    ] = "likelihood",
    scheduler: Scheduler = None,
    verbose: Verbose = False,
    as_json: AsJson = False,
) -> None:
    """Fit hinges and crank, swim frequencies and phases, the five fluid coefficients and EBT; write the MJCF.

    Hinge stiffness and damping come from free decays, and with these the crank arm from dry runs. What was not recorded
    is assumed to be as the robot is described, and reported so. Without a swim it ends with hinges and crank.

    Held-out trials are forecast given the frequency, and again after their first two beats; a line, a power law and a
    constant stride through the fitted speeds are given for comparison. The other commands use the current fit, whatever
    its effort; only another fit replaces it.
    """
    plain = objective == "likelihood" and scheduler is None and not as_json
    if plain and print_again("fit", session, effort, verbose):
        return
    found = calib.fit(session, effort, workers=workers, objective=objective, progress=not as_json, scheduler=scheduler)
    print_result(found, as_json, verbose)


def posterior(
    session: SessionFolder,
    effort: Effort = None,
    workers: Workers = 0,
    scheduler: Scheduler = None,
    verbose: Verbose = False,
    as_json: AsJson = False,
) -> None:
    """Sample the posterior of the five fluid coefficients, given the fit trials.

    Where there are too few effective draws, nothing is reported.
    """
    if scheduler is None and not as_json and print_again("posterior", session, effort, verbose):
        return
    found = calib.posterior(session, effort, workers=workers, progress=not as_json, scheduler=scheduler)
    print_result(found, as_json, verbose)


def diagnose(
    session: SessionFolder,
    effort: Effort = None,
    workers: Workers = 0,
    exclude: Annotated[str | None, typer.Option(help="effects that the catalogue is to lack, comma-separated")] = None,
    test: Annotated[str | None, typer.Option(help="instead: test these effects together, comma-separated")] = None,
    scheduler: Scheduler = None,
    verbose: Verbose = False,
    as_json: AsJson = False,
) -> None:
    """Locate the sim-to-real gap, rank its likely causes, and measure how far it shrinks with them.

    Writes results/diagnosis.json and, where an effect is named, the model with it. With --test it writes
    results/supposed.json alone.
    """
    excluded, tested = _parse_effects("--exclude", exclude), _parse_effects("--test", test)
    if tested and excluded:
        raise typer.BadParameter("takes effects of the whole catalogue; leave --exclude out", param_hint="--test")
    if tested:
        alone = calib.effect_test(session, tested, effort, workers=workers, progress=not as_json)
        print_result(alone, as_json, verbose)
        return
    plain = not excluded and scheduler is None and not as_json
    if plain and print_again("diagnose", session, effort, verbose):
        return
    found = calib.diagnose(
        session, effort, exclude=excluded, workers=workers, progress=not as_json, scheduler=scheduler
    )
    print_result(found, as_json, verbose)


def _parse_effects(option: str, text: str | None) -> tuple[str, ...]:
    """Parse the names in a comma-separated list; an `InputError` where the option was given and holds none."""
    names = tuple(name.strip() for name in (text or "").split(",") if name.strip())
    if text is not None and not names:
        from session import InputError
        from session.errors import Fault
        from swimmer.effects import catalogue

        step = "Name some, or leave the option out; docs/effects.md has the table."
        expected, choices = "names of the catalogue, comma-separated", tuple(catalogue())
        raise InputError([Fault(option, "", "names no effect", repr(text), expected, choices, step)])
    return names


def report(
    sessions: SessionFolders,
    index: Annotated[
        Path | None,
        typer.Option(help="where the index of several sessions goes; default: index.html next to the first"),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Write the HTML report of the current results of each session; of several an index, also as CSV. Fits nothing."""
    alone = len(sessions) == 1 and index is None and not as_json
    if alone and print_again("report", sessions[0], None):
        return
    print_export(calib.report(sessions if len(sessions) > 1 else sessions[0], index), as_json)


def mjcf(
    source: Annotated[
        Path | None,
        typer.Argument(metavar="[SESSION | ROBOT]", help="session folder or robot TOML; default: the 0.57 m fish"),
    ] = None,
    out: Annotated[Path, typer.Option(help="the file to write")] = Path("robot.xml"),
) -> None:
    """Write the MJCF: of the current fit for a session, nominal for a robot; fits nothing."""
    print_export(calib.export_mjcf(source, out))


def doctor(
    session: Annotated[Path | None, typer.Argument(metavar="[SESSION]", help="a session folder to check, too")] = None,
    motor: Annotated[bool, typer.Option("--motor", help="also look for the motor on every serial port")] = False,
    as_json: AsJson = False,
) -> None:
    """Check the installation, a session and the motor connection, and say what to do. Exit code 2 after a fault."""
    found = calib.doctor(session, motor=motor)
    if as_json:
        print(found.to_json(orient="index", indent=1))
    for check, (state, what, step) in [] if as_json else found.iterrows():
        mark = {"ok": "ok    ", "advice": "advice", "fault": "FAULT "}[state]
        print(f"{mark} {check}: {what}{'' if not step else f'. {step}'}")
    if (found.state == "fault").any():
        raise typer.Exit(2)
