"""The output of each command for the current results, kept so that a command with nothing to do prints it at once.

``results/.output.json`` holds it with the hash of every file behind it: inputs, results and the program. These are
compared before any library is loaded, which alone takes seconds. Where a file differs, is missing or is new, the
command does its work.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from functools import cache
from hashlib import file_digest, sha256
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from calib import PACKAGES

if TYPE_CHECKING:
    from calib.pipeline import Pipeline

OUTPUT = ".output.json"
_HOME = Path(__file__).resolve().parents[1]
_ENGINES = ("swimcal", "mujoco", "opencv-contrib-python-headless")
_STAMPS = ".stages.json"
_NO_ANSWER_RESTS_ON_IT = ("kept", ".rrd", ".mp4")  # a folder, and suffixes of files that are only looked at


class CommandOutput(NamedTuple):
    """The output of one command.

    Attributes:
        effort: effort of the results that it is about; "" where none matters.
        short, long: output without and with ``--verbose``.
    """

    effort: str
    short: str
    long: str


def standing_output(command: str, folder: Path, effort: str | None, verbose: bool = False) -> str | None:
    """Return what a command prints of a session; None where there is something to do, or that cannot be told.

    Args:
        command: name of the command.
        folder: the session's, as the command has it: the answer names files in it.
        effort: as requested; None for that of the current results.
        verbose: return the long output.
    """
    try:
        kept = json.loads((folder / "results" / OUTPUT).read_bytes())
        answer = CommandOutput(**kept["answers"][command])
        same = kept["folder"] == str(folder) and (effort is None or answer.effort in ("", effort))
        if same and kept["program"] == _program() and kept["files"] == _hashes(folder, kept["inputs"]):
            return answer.long if verbose else answer.short
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        pass
    return None


def print_again(command: str, session: Path, effort: str | None, verbose: bool = False) -> bool:
    """Print what a command says of the current results, where there is nothing to do; return whether it did.

    Args:
        command: name of the command.
        session: the session folder, or its `session.toml`.
        effort: as requested; None for that of the current results.
        verbose: print every number and every flag.
    """
    text = standing_output(command, session.parent if session.name == "session.toml" else session, effort, verbose)
    print(text or "", end="")
    return text is not None


def keep_output(pipeline: Pipeline) -> None:
    """Keep what each command would print of the current results; nothing where the folder cannot be written."""
    from swimcal.errors import ResultsNotWritable, SwimcalError
    from swimcal.results import write_whole

    folder, inputs = pipeline.session.folder, pipeline.job.provenance.inputs
    lacking = (Path(os.path.relpath(file, folder)).as_posix() for file in pipeline.session.absent_inputs())
    names = sorted((*inputs, *lacking))
    files = _hashes(folder, names)
    kept: dict[str, Any] = {"folder": str(folder), "program": _program(), "inputs": names, "files": files}
    if any(files[name] != sha256_ for name, sha256_ in inputs.items()):
        return  # inputs changed during the work
    with suppress(SwimcalError):
        kept["answers"] = {command: answer._asdict() for command, answer in _answers(pipeline)}
        with suppress(ResultsNotWritable):
            write_whole(folder / "results" / OUTPUT, json.dumps(kept, indent=1) + "\n")


def _answers(pipeline: Pipeline) -> Iterator[tuple[str, CommandOutput]]:
    """Yield each command that has current results, with its output."""
    from dataclasses import replace

    from calib.results.made import fit_result, gap_result, posterior_result, structure_result
    from calib.terminal import result_lines

    def make_answer(found: Any, effort: str, main: Path | None = None, notes: tuple[str, ...] = ()) -> CommandOutput:
        again = replace(found, notes=(*notes, *pipeline.recordings.notes), made=())
        short, long = ("\n".join(result_lines(again, verbose, main)) + "\n" for verbose in (False, True))
        return CommandOutput(effort, short, long)

    if pipeline.only_dry:
        if pipeline.structures.is_current:
            dry = make_answer(structure_result(pipeline), "", notes=(pipeline.dry_note,))
            yield from (("fit", dry), ("run", dry))
        return
    fit = pipeline.current_fit
    if fit is None or not pipeline.structures.is_up_to_date:
        return
    posterior, gap, page = pipeline.current_posterior(fit), pipeline.current_diagnosis(), pipeline.current_report()
    yield "fit", make_answer(fit_result(pipeline), fit.effort)
    if posterior is not None:
        yield "posterior", make_answer(posterior_result(pipeline, posterior), posterior.effort)
    usual = gap is not None and not gap.withheld and gap.compared_with is None  # as without options
    if gap is not None and usual:
        yield "diagnose", make_answer(gap_result(pipeline, gap), gap.effort)
    if page is not None:
        text = f"{pipeline.session.name}: {pipeline.standing}\n{page}\n"
        yield "report", CommandOutput(fit.effort, text, text)
        others = {None if stage is None else stage.effort for stage in (posterior, gap)}
        if None not in others and (fit.effort == "quick" or (others == {"full"} and usual)):
            yield "run", make_answer(fit_result(pipeline), fit.effort, page)


@cache
def _program() -> str:
    """Hash the versions and the sizes and times of the program's own files."""
    parts: list[object] = [_version(name) for name in _ENGINES]
    for package in ("calib", *PACKAGES):
        files = sorted(path for path in (_HOME / package).rglob("*") if path.suffix in (".py", ".j2", ".css", ".js"))
        parts += [[path.relative_to(_HOME).as_posix(), path.stat().st_size, path.stat().st_mtime_ns] for path in files]
    return sha256(json.dumps(parts).encode()).hexdigest()


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return ""


def _hashes(folder: Path, inputs: Iterable[str]) -> Mapping[str, str | None]:
    """Hash each input and result (SHA-256), by its name; None where it is not there."""
    results = folder / "results"
    files = {name: folder / name for name in inputs}
    for path in sorted(results.rglob("*")):
        name = path.relative_to(results)
        left_out = name.parts[0] == _NO_ANSWER_RESTS_ON_IT[0] or path.suffix in _NO_ANSWER_RESTS_ON_IT
        if path.is_file() and not left_out and (not path.name.startswith(".") or path.name == _STAMPS):
            files[path.relative_to(folder).as_posix()] = path
    return {name: _sha256(path) for name, path in files.items()}


def _sha256(path: Path) -> str | None:
    try:
        with path.open("rb") as stream:
            return file_digest(stream, "sha256").hexdigest()
    except FileNotFoundError:
        return None
