"""Stamps: which results are up to date, so that what has not changed is not made again.

``results/.stages.json`` holds, for each result, the fingerprint of what it was made from and the hash of what
was written. A result that was edited, deleted or made from something else is not current.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from session.results import plain_json, program_version, sha256_of, write_whole

STAMPS = ".stages.json"


def fingerprint_of(
    inputs: Mapping[str, str],
    parameters: Mapping[str, Any],
    depends: Iterable[str] = (),
    program: str | None = None,
) -> str:
    """A hash over all that a stage's results depend on.

    Args:
        inputs: sha256 of each input file by its name.
        parameters: everything else that steers the stage: seed, effort, engine version, model hash, …
        depends: the fingerprints of the stages it builds on.
        program: the program's version; default: this one's.
    """
    parts = [inputs, parameters, sorted(depends), program or program_version()]
    return hashlib.sha256(json.dumps(plain_json(parts), sort_keys=True).encode()).hexdigest()


def is_current(target: Path, fingerprint: str) -> bool:
    """Whether a result was made with this fingerprint, and still stands as written.

    So must all that was made together with it.

    Args:
        target: the stage's main result, somewhere in the session's ``results`` folder.
        fingerprint: of what the stage would be made from now, see `fingerprint_of`.
    """
    results = _results_of(target)
    stamp = _read(results).get(_name(target, results))
    if not isinstance(stamp, dict) or stamp.get("fingerprint") != fingerprint:
        return False
    outputs = stamp.get("outputs")
    return isinstance(outputs, dict) and all(_stands(results / name, sha256) for name, sha256 in outputs.items())


def mark_current(target: Path, fingerprint: str, also: Iterable[Path] = ()) -> None:
    """Records that `target`, and the results `also` made with it, were just made with this fingerprint.

    Raises:
        ResultsNotWritable: the record cannot be written.
    """
    results = _results_of(target)
    outputs = {_name(path, results): sha256_of(path) for path in (target, *also)}
    stamps = _read(results) | {_name(target, results): {"fingerprint": fingerprint, "outputs": outputs}}
    write_whole(results / STAMPS, json.dumps(stamps, indent=1, sort_keys=True) + "\n")


def _results_of(target: Path) -> Path:
    """The ``results`` folder that holds `target`."""
    for folder in target.parents:
        if folder.name == "results":
            return folder
    raise ValueError(f"{target} is not in a session's results folder")


def _name(path: Path, results: Path) -> str:
    return path.relative_to(results).as_posix()


def _read(results: Path) -> dict[str, Any]:
    """The stamps; none where the record is absent or damaged, which makes every result again."""
    try:
        stamps = json.loads((results / STAMPS).read_bytes())
    except (OSError, ValueError, RecursionError):
        return {}
    return stamps if isinstance(stamps, dict) else {}


def _stands(path: Path, sha256: str) -> bool:
    try:
        return sha256_of(path) == sha256
    except OSError:
        return False
