"""Commands that make a session's results: `run`, `fit`, `posterior`, `report`, `mjcf`."""

from pathlib import Path
from typing import Annotated

import typer

from calib.commands.arguments import AsJson, ComparisonOption, Effort, MethodOption, SessionFolder, Workers


def run(session: SessionFolder, effort: Effort = "full", workers: Workers = 0, as_json: AsJson = False) -> None:
    """Does everything the session's data allow: tracks, fit, MJCF, posterior and gap (effort full), report."""
    from calib.options import Options
    from calib.working import tell_outcome, working
    from session import NotConverged

    with working(session, as_json, Options(effort, workers)) as pipeline:
        pipeline.fit()
        pipeline.evidence()
        if effort == "full":
            try:
                pipeline.posterior()
            except NotConverged as refusal:  # said beside the results, which stand without it
                pipeline.said.append(f"! {refusal}")
            pipeline.diagnosis()
        report = pipeline.report()
    tell_outcome(pipeline, report, as_json)


def fit(
    session: SessionFolder,
    effort: Effort = "full",
    workers: Workers = 0,
    method: Annotated[MethodOption, typer.Option(help="the search; see `calib benchmark search`")] = "gradient",
    objective: Annotated[
        ComparisonOption,
        typer.Option(help="published: markers in the head frame; shape: relative to the nose in every frame"),
    ] = "published",
    as_json: AsJson = False,
) -> None:
    """Finds hinges and crank, swim frequencies and phases, the five fluid coefficients and EBT; writes the MJCF.

    Hinge stiffness and damping come from free decays, and with these the crank arm from dry runs. What was not
    recorded is assumed to be as the robot is described, and that is said. Without a swim it ends with hinges and crank.
    The other commands take the fit of this effort as it stands, by whatever search; only another fit replaces it.
    """
    from calib.options import Options
    from calib.working import tell_outcome, working

    with working(session, as_json, Options(effort, workers, method, objective)) as pipeline:
        result = pipeline.structured() if pipeline.only_dry else pipeline.fit()
    tell_outcome(pipeline, result, as_json)


def posterior(session: SessionFolder, effort: Effort = "full", workers: Workers = 0, as_json: AsJson = False) -> None:
    """Tells how sure the five fluid coefficients are: draws from their posterior given the fit trials.

    Stopped, it goes on where it was. Where the draws are not enough nothing is reported.
    """
    from calib.options import Options
    from calib.working import tell_outcome, working

    with working(session, as_json, Options(effort, workers)) as pipeline:
        result = pipeline.posterior()
    tell_outcome(pipeline, result, as_json)


def diagnose(
    session: SessionFolder,
    effort: Effort = "full",
    workers: Workers = 0,
    without: Annotated[str | None, typer.Option(help="effects that the catalogue is to lack, comma-separated")] = None,
    suppose: Annotated[
        str | None, typer.Option(help="instead: ask what the swims say of these effects together, comma-separated")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Tells where the sim-to-real gap lies, which unmodelled effect makes it, and how far it shrinks with that effect.

    Writes results/diagnosis.json and, where an effect is named, the model with it. With --suppose it writes
    results/supposed.json alone.
    """
    from calib.options import Options
    from calib.working import tell_diagnosis, tell_supposition, working

    lacking, supposed = _effects_named("--without", without), _effects_named("--suppose", suppose)
    if supposed and lacking:
        raise typer.BadParameter("takes effects of the whole catalogue; leave --without out", param_hint="--suppose")
    if supposed:
        with working(session, as_json, Options(effort, workers)) as pipeline:
            found = pipeline.supposition(supposed)
        tell_supposition(pipeline, found, as_json)
        return
    with working(session, as_json, Options(effort, workers)) as pipeline:
        result = pipeline.diagnosis(frozenset(lacking))
    tell_diagnosis(pipeline, result, as_json)


def _effects_named(option: str, told: str | None) -> tuple[str, ...]:
    """The names in a comma-separated list.

    Raises:
        InputError: the option was given and holds none.
    """
    names = tuple(name.strip() for name in (told or "").split(",") if name.strip())
    if told is not None and not names:
        from session import FaultCollector
        from swimmer.effects import catalogue

        faults = FaultCollector(option)
        faults.add(
            "",
            "names no effect",
            found=repr(told),
            expected="names of the catalogue, comma-separated",
            choices=tuple(catalogue()),
            next_step="Name some, or leave the option out; docs/effects.md has the table.",
        )
        faults.raise_if_any()
    return names


def report(
    sessions: Annotated[list[Path], typer.Argument(metavar="SESSION...", help="one or more session folders")],
    workers: Workers = 0,
    index: Annotated[
        Path | None,
        typer.Option(help="where the index of several sessions goes; default: index.html beside the first"),
    ] = None,
) -> None:
    """Writes the HTML report of what stands in each session, and an index when there are several; fits nothing."""
    from calib.batch import report_batch
    from calib.options import Options

    for path in report_batch(sessions, Options(workers=workers), index):
        print(path)


def mjcf(
    source: Annotated[
        Path | None,
        typer.Argument(metavar="[SESSION | ROBOT]", help="session folder or robot TOML; default: the 0.57 m fish"),
    ] = None,
    out: Annotated[Path, typer.Option(help="the file to write")] = Path("robot.xml"),
) -> None:
    """Writes the MJCF: that of the fit which stands for a session, nominal for a robot; fits nothing."""
    from calib.mjcf_file import write_nominal_mjcf
    from calib.working import working
    from session import SESSION_FILE, write_whole

    if source is None or (source.suffix == ".toml" and source.name != SESSION_FILE):
        write_nominal_mjcf(source, out)
    else:
        with working(source, False) as pipeline:
            fit = pipeline.the_fit()
        write_whole(out, fit.mjcf_file.read_text())
        print(f"{fit.name}, {fit.file}")
    print(out)
