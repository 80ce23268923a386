"""Results: written whole or not at all, and with where they come from."""

from __future__ import annotations

import hashlib
import json
import math
import os
import secrets
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np

from session.errors import FaultCollector, ResultsNotWritable
from session.flags import Flag

SCHEMA = 1
"""The version of the JSON results' form."""


def program_version() -> str:
    """Name and version of this program, as results record it."""
    try:
        return f"swimcal {version('swimcal')}"
    except PackageNotFoundError:
        return "swimcal (not installed)"


@dataclass(frozen=True)
class Provenance:
    """What a result was made with; stands first in every JSON result.

    Attributes:
        mujoco: version of the engine.
        model_sha256: hash of the model that was simulated.
        inputs: sha256 of every input file, by its name relative to the session folder.
        seed: the seed of every random draw.
        effort: ``"quick"`` or ``"full"``.
        program: name and version of this program.
        schema: version of the result's form.
    """

    mujoco: str
    model_sha256: str
    inputs: Mapping[str, str]
    seed: int
    effort: str
    program: str = field(default_factory=program_version)
    schema: int = SCHEMA

    def to_json(self) -> dict[str, Any]:
        """The provenance in the order of the public contract."""
        order = ("schema", "program", "mujoco", "model_sha256", "inputs", "seed", "effort")
        return {key: asdict(self)[key] for key in order}


@contextmanager
def writing_whole(path: Path) -> Iterator[Path]:
    """Gives the block a temporary path beside `path`, renamed to it when the block ends well.

    The folder is made when it is not there. When the block fails, or is interrupted, the temporary file is
    removed and what stood at `path` still stands.

    Raises:
        ResultsNotWritable: the operating system refused.
    """
    if path.is_dir() or not path.name:
        raise ResultsNotWritable(f"{path}: cannot be written; found: a folder; expected: the name of a file.")
    # Ending in the real name keeps the suffix, by which some writers choose their format.
    part = path.with_name(f".{secrets.token_hex(4)}.part.{path.name}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield part
        _flush_to_disk(part)
        part.replace(path)
    except OSError as error:
        raise ResultsNotWritable(
            f"{path}: cannot be written; found: {error.strerror or error}; "
            f"expected: a writable folder with space left. Make {path.parent} writable, or work on a copy "
            "of the session. What stood there is unchanged."
        ) from error
    finally:
        _remove(part)


def write_whole(path: Path, data: bytes | str) -> None:
    """Writes a file whole or not at all; text as UTF-8.

    Raises:
        ResultsNotWritable: the operating system refused; what stood there is unchanged.
    """
    with writing_whole(path) as part:
        part.write_bytes(data.encode() if isinstance(data, str) else data)


def write_result_json(path: Path, provenance: Provenance, payload: Mapping[str, Any]) -> None:
    """Writes one JSON result: the provenance first, then the payload, with null for nan and infinity.

    Raises:
        ResultsNotWritable: the file cannot be written.
        ValueError: the payload uses a key of the provenance.
    """
    head = provenance.to_json()
    if taken := sorted(head.keys() & payload.keys()):
        raise ValueError(f"{', '.join(taken)} belongs to the provenance; choose another key in the payload")
    whole = plain_json({**head, **payload})
    write_whole(path, json.dumps(whole, indent=1, allow_nan=False, ensure_ascii=False) + "\n")


def read_result_json(path: Path) -> dict[str, Any]:
    """Reads one JSON result.

    Raises:
        InputError: not there, not JSON, or written in a form this version does not know.
    """
    faults = FaultCollector(str(path))
    again = "Make it again with `calib run`."
    data: Any = None
    try:
        data = json.loads(path.read_bytes())
    except FileNotFoundError:
        faults.add("", "the result is not there", expected="a result written by this program", next_step=again)
    except (OSError, ValueError, RecursionError) as error:
        faults.add("", "the result cannot be read", found=str(error), expected="a JSON object", next_step=again)
    faults.raise_if_any()
    if not isinstance(data, dict) or data.get("schema") != SCHEMA:
        found = f"schema {data.get('schema')!r}" if isinstance(data, dict) else type(data).__name__
        faults.add("", "not a result of this version", found=found, expected=f"schema {SCHEMA}", next_step=again)
    faults.raise_if_any()
    return data


def plain_json(value: Any) -> Any:
    """The value in JSON's own types: arrays as lists, nan and infinity as None, flags in their contract form.

    Raises:
        TypeError: a value of a type that no result should hold.
    """
    if isinstance(value, Mapping):
        return {str(key): plain_json(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return plain_json(value.tolist())
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Flag):
        return value.to_json()
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, Iterable) and not isinstance(value, bytes):
        return [plain_json(item) for item in value]
    raise TypeError(f"a result cannot hold {type(value).__name__}")


def sha256_of(path: Path) -> str:
    """The sha256 of a file's content, in hexadecimal digits."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _flush_to_disk(path: Path) -> None:
    with path.open("rb+") as stream:
        os.fsync(stream.fileno())


def _remove(path: Path) -> None:
    try:
        path.unlink(missing_ok=True)
    except OSError:  # the folder itself is out of reach; the cause is already being raised
        return
