"""The command line. Every command first brings up to date what it depends on and skips what has not changed."""

import json
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Literal

import typer
from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    SpinnerColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from calib.pipeline import EffortName, Options, Pipeline, open_session, program
from calib.summary import calibration_lines
from fitting import Comparison, MethodName
from session import SESSION_FILE, SwimcalError, new_from_fishsim, read_result_json, session_lock

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    help="From the tracks of a tendon-driven robot fish to a calibrated MuJoCo twin and a report.",
)
benchmark = typer.Typer(no_args_is_help=True, help="Measures what is claimed of speed and accuracy.")
app.add_typer(benchmark, name="benchmark")

SessionFolder = Annotated[Path, typer.Argument(metavar="SESSION", help="a session folder, with its session.toml")]
Effort = Annotated[EffortName, typer.Option(help="how hard to search; recorded in the results")]
Workers = Annotated[int, typer.Option(min=0, help="threads; 0: all cores")]
AsJson = Annotated[bool, typer.Option("--json", help="print the outcome as JSON on standard output")]


INTERRUPTED = 130  # what typer makes of Ctrl-C


def main() -> None:
    """Entry point: errors of ours become one clear message and exit code 2, Ctrl-C exit code 130."""
    try:
        app(standalone_mode=True)
    except SwimcalError as error:
        print(f"calib: {error}", file=sys.stderr)
        sys.exit(error.exit_code)
    except SystemExit as end:
        if end.code == INTERRUPTED:
            print("\ncalib: stopped. What was finished is kept; the same command goes on from there.", file=sys.stderr)
        raise


@app.callback(invoke_without_command=True)
def version(
    show: Annotated[bool, typer.Option("--version", help="print the versions and exit")] = False,
) -> None:
    """Options that stand before a command."""
    if show:
        print(program())
        raise typer.Exit


@app.command()
def run(session: SessionFolder, effort: Effort = "full", workers: Workers = 0, as_json: AsJson = False) -> None:
    """Does everything the session's data allow: fit, calibrated MJCF, report."""
    with _working(session, effort, workers, as_json) as pipeline:
        report = pipeline.report()
    _tell(pipeline, report, as_json)


@app.command()
def fit(
    session: SessionFolder,
    effort: Effort = "full",
    workers: Workers = 0,
    method: Annotated[MethodName, typer.Option(help="the search; `calib benchmark search` compares them")] = "gradient",
    objective: Annotated[
        Literal["published", "shape"],
        typer.Option(help="published: markers in the head frame; shape: relative to the nose in every frame"),
    ] = "published",
    as_json: AsJson = False,
) -> None:
    """Finds swim frequencies, crank phases, the five fluid coefficients and EBT; writes the calibrated MJCF."""
    with _working(session, effort, workers, as_json, method=method, comparison=objective) as pipeline:
        pipeline.fit()
    _tell(pipeline, pipeline.calibration_file, as_json)


@app.command()
def report(
    sessions: Annotated[list[Path], typer.Argument(metavar="SESSION...", help="one or more session folders")],
    effort: Effort = "full",
    workers: Workers = 0,
    index: Annotated[
        Path | None,
        typer.Option(help="where the index of several sessions goes; default: index.html beside the first"),
    ] = None,
) -> None:
    """Writes the HTML report of each session, and an index when there are several."""
    from calib.batch import report_batch

    for path in report_batch(sessions, effort, workers, index, _working):
        print(path)


@app.command()
def new(
    session: Annotated[Path, typer.Argument(metavar="SESSION", help="the folder to make")],
    from_fishsim: Annotated[
        Path | None,
        typer.Option(help="a checkout of the authors' repository, or a folder of its marker CSVs"),
    ] = None,
    synthetic: Annotated[bool, typer.Option("--synthetic", help="a session made with the twin, truth known")] = False,
    fit: Annotated[str, typer.Option(help="trials to fit on, comma-separated; the others are held out")] = "",
    seed: Annotated[int, typer.Option(min=0, help="of a synthetic session")] = 0,
) -> None:
    """Makes a session folder."""
    if (from_fishsim is None) == (not synthetic):
        raise typer.BadParameter("give either --from-fishsim DIR or --synthetic")
    if from_fishsim is not None:
        print(new_from_fishsim(session, from_fishsim, tuple(name.strip() for name in fit.split(",") if name.strip())))
        return
    from synthetic import default_plan, make_session

    print(make_session(session, default_plan(seed)))


@app.command()
def mjcf(
    source: Annotated[
        Path | None,
        typer.Argument(metavar="[SESSION | ROBOT]", help="session folder or robot TOML; default: the 0.57 m fish"),
    ] = None,
    out: Annotated[Path, typer.Option(help="the file to write")] = Path("robot.xml"),
    effort: Effort = "full",
    workers: Workers = 0,
) -> None:
    """Writes the MJCF: calibrated for a session, nominal for a robot."""
    from calib.mjcf_file import write_nominal_mjcf
    from session import write_whole

    if source is None or (source.suffix == ".toml" and source.name != SESSION_FILE):
        write_nominal_mjcf(source, out)
    else:
        with _working(source, effort, workers, quiet=False) as pipeline:
            pipeline.fit()
        write_whole(out, (pipeline.session.results / "calibrated.xml").read_text())
    print(out)


@benchmark.command()
def speed(
    session: Annotated[
        Path | None, typer.Option(help="also measure with the coefficients of this calibrated session")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Times real time on one core and on all, beside a bare step without fluid; distance to an 8 times finer step."""
    from calib.benchmarks.speed import measure_speed, speed_table

    coefficients = None
    if session is not None:
        with _working(session, "full", 0, as_json) as pipeline:
            coefficients = pipeline.calibrated().coefficients
    outcome = measure_speed(coefficients)
    print(json.dumps(outcome.to_json(), indent=1) if as_json else speed_table(outcome))


@benchmark.command(name="search")
def compare(
    session: SessionFolder,
    seeds: Annotated[int, typer.Option(min=1, help="of each search")] = 3,
    budget: Annotated[float, typer.Option(min=100.0, help="simulated seconds of each search")] = 14_000.0,
    workers: Workers = 0,
    as_json: AsJson = False,
) -> None:
    """Compares the searches on a session's fit trials: same budget, both objectives; the report then shows them."""
    from fitting import comparison_payload, comparison_table

    with _working(session, "full", workers, as_json) as pipeline:
        runs = pipeline.compare_searches(seeds, budget)
    print(json.dumps(comparison_payload(runs), indent=1) if as_json else "\n".join(comparison_table(runs)))


@contextmanager
def _working(
    folder: Path,
    effort: EffortName,
    workers: int,
    quiet: bool,
    method: MethodName = "gradient",
    comparison: Comparison = "published",
) -> Iterator[Pipeline]:
    """A locked session and its pipeline, with a progress bar unless quiet."""
    session = open_session(folder.parent if folder.name == SESSION_FILE else folder)
    with session_lock(session.folder), _progress(quiet) as bar:
        task = bar.add_task("reading", total=None)

        def tell(message: str, share: float | None) -> None:
            bar.update(task, description=message, total=None if share is None else 1.0, completed=share or 0.0)

        yield Pipeline(session, Options(effort, workers, method, comparison, tell))


def _progress(quiet: bool) -> Progress:
    columns = (SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    console = Console(stderr=True)
    return Progress(
        *columns, TextColumn("left:"), TimeRemainingColumn(), console=console, transient=True,
        disable=quiet or not console.is_terminal,
    )  # fmt: skip


def _tell(pipeline: Pipeline, result: Path, as_json: bool) -> None:
    """The outcome on standard output; the path of the main result comes last."""
    data = read_result_json(pipeline.calibration_file)
    if as_json:
        made = {
            "result": str(result),
            "made": [str(path) for path in pipeline.made],
            "notes": list(pipeline.notes),
        }
        print(json.dumps(made | {"calibration": data}, indent=1))
        return
    for line in (*pipeline.said, *pipeline.notes, *calibration_lines(data)):
        print(line)
    print(result)


if __name__ == "__main__":
    main()
