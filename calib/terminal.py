"""What a command prints when it is done: eight lines at most, all of it with -v, or JSON."""

import json
from collections.abc import Sequence
from pathlib import Path

from calib.results.export import Export
from calib.results.fit import FitResult
from calib.results.gap import EffectTest, GapResult
from calib.results.posterior import PosteriorResult
from calib.results.structure import StructureResult

Result = FitResult | PosteriorResult | GapResult | EffectTest | StructureResult
_KEYS = {
    FitResult: "calibration",
    PosteriorResult: "posterior",
    GapResult: "diagnosis",
    EffectTest: "test",
    StructureResult: "structure",
}


def tell(result: Result, as_json: bool, verbose: bool, main: Path | None = None) -> None:
    """The outcome on standard output; the path of the main result comes last.

    Args:
        result: of a function of `calib`.
        as_json: the content of its file, what was made and what was said.
        verbose: every number and every flag instead of the summary.
        main: the main result; default: the result's own file.
    """
    path = main or result.file
    if as_json:
        made = {"result": str(path), "made": list(map(str, result.made)), "notes": list(result.notes)}
        print(json.dumps(made | {_KEYS[type(result)]: json.loads(_json_file(result).read_text())}, indent=1))
        return
    lines = [*result.notes, *_details(result)] if verbose else [*_short(result.notes), *result.summary().splitlines()]
    for line in lines:
        print(line)
    print(path)


def _short(notes: Sequence[str]) -> Sequence[str]:
    """Notes in one line at most."""
    if not notes:
        return ()
    return (notes[0] + (f" ({len(notes) - 1} more notes: -v)" if len(notes) > 1 else ""),)


def tell_export(made: Export) -> None:
    """What was written: what it is, then the files."""
    for line in (*made.notes, *made.files):
        print(line)


def _json_file(result: Result) -> Path:
    return result.file.with_suffix(".json")


def _details(result: Result) -> Sequence[str]:
    from calib.diagnosis_summary import diagnosis_lines, supposition_lines
    from calib.summary import calibration_lines, posterior_lines, structure_lines

    match result:
        case FitResult():
            return calibration_lines(result.data)
        case PosteriorResult():
            return posterior_lines(result.data)
        case GapResult():
            return diagnosis_lines(result.data)
        case EffectTest():
            return supposition_lines(result.data)
        case StructureResult():
            return structure_lines(result.data)
