"""Result files, written whole or not at all, with the versions and inputs that they were made from."""

from __future__ import annotations

import hashlib
import json
import math
import os
import secrets
import zlib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Generic, TypeVar, cast
from zipfile import BadZipFile, ZipFile

import numpy as np

from session.errors import Fault, InputError, ResultsNotWritable
from session.flags import Flag
from session.records import External, from_plain, to_plain

T = TypeVar("T")

SCHEMA = 1
"""The version of the JSON results' form."""


def program_version() -> str:
    """Return name and version of this program, as results record it."""
    try:
        return f"swimcal {version('swimcal')}"
    except PackageNotFoundError:
        return "swimcal (not installed)"


@dataclass(frozen=True)
class Provenance:
    """The origin of a result: versions, the model simulated, every input file; it comes first in every JSON result.

    Inputs are hashed by their name relative to the session folder; the effort is ``"quick"`` or ``"full"``.
    """

    mujoco: str
    model_sha256: str
    inputs: Mapping[str, str]
    seed: int
    effort: str
    program: str = field(default_factory=program_version)
    schema: int = SCHEMA

    def to_json(self) -> dict[str, Any]:
        """Return the provenance in the order of the public contract."""
        return {key: getattr(self, key) for key in PROVENANCE}


PROVENANCE = ("schema", "program", "mujoco", "model_sha256", "inputs", "seed", "effort")
"""Keys of every JSON result, in this order, which come before its own."""


PARTS = ".*.part.*"
"""Pattern of the temporary files of `writing_whole`."""


@contextmanager
def writing_whole(path: Path) -> Iterator[Path]:
    """Give the block a temporary path next to `path`, which is renamed to `path` when the block ends well.

    The folder is made when it is not there. When the block fails, or is interrupted, the temporary file is
    removed and what was at `path` is unchanged.

    Raises:
        ResultsNotWritable: the operating system refused.
    """
    if path.is_dir() or not path.name:
        raise ResultsNotWritable(f"{path}: cannot be written; found: a folder; expected: the name of a file.")
    # The name ends in the real one to keep the suffix, by which some writers choose their format.
    part = path.with_name(f".{secrets.token_hex(4)}.part.{path.name}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield part
        with part.open("rb+") as stream:
            os.fsync(stream.fileno())
        part.replace(path)
    except OSError as error:
        raise ResultsNotWritable(
            f"{path}: cannot be written; found: {error.strerror or error}; "
            f"expected: a writable folder with space left. Make {path.parent} writable, or work on a copy "
            "of the session. What stood there is unchanged."
        ) from error
    finally:
        with suppress(OSError):  # if the folder itself is out of reach, the cause is already being raised
            part.unlink(missing_ok=True)


def write_whole(path: Path, data: bytes | str) -> None:
    """Write a file whole or not at all; text as UTF-8.

    Raises:
        ResultsNotWritable: the operating system refused; what stood there is unchanged.
    """
    with writing_whole(path) as part:
        part.write_bytes(data.encode() if isinstance(data, str) else data)


@dataclass(frozen=True)
class ResultFile(Generic[T]):
    """A JSON result of the session: its name and the record that it holds.

    Attributes:
        name: name of the file in the folder of the results.
        kind: the record that it holds, see `session.records`; its fields follow those of the provenance.
        named: types within it of which only names are written.
        arrays_apart: arrays are in a ``.npz`` of the same name.
    """

    name: str
    kind: type[T]
    named: tuple[type, ...] = ()
    arrays_apart: bool = False

    def paths(self, results: Path) -> tuple[Path, ...]:
        """Return the path of the file and, where arrays are apart, that of its arrays."""
        path = results / self.name
        return (path, path.with_suffix(".npz")) if self.arrays_apart else (path,)

    def write(self, results: Path, provenance: Provenance, record: T) -> tuple[Path, ...]:
        """Write the result whole, the provenance first, with null for nan and infinity; return `paths`.

        Args:
            results: the folder of the results.
            provenance: what the result was made with.
            record: its content.

        Raises:
            ResultsNotWritable: a file cannot be written.
        """
        paths = self.paths(results)
        arrays: dict[str, np.ndarray] | None = {} if self.arrays_apart else None
        whole = plain_json({**provenance.to_json(), **to_plain(record, self.named, arrays)})
        if arrays is not None:
            with writing_whole(paths[1]) as part:
                np.savez_compressed(part, allow_pickle=False, **arrays)
        write_whole(paths[0], json.dumps(whole, indent=1, allow_nan=False, ensure_ascii=False) + "\n")
        return paths

    def read(self, results: Path, external: External | None = None) -> T:
        """Read what `write` wrote.

        Args:
            results: the folder of the results.
            external: what is kept in other files, see `session.records`.

        Raises:
            InputError: not there, incomplete, or not of this version.
        """
        path = results / self.name
        data = _read_json(path)
        try:
            rest = {key: value for key, value in data.items() if key not in PROVENANCE}
            if not self.arrays_apart:
                return cast(T, from_plain(self.kind, rest, external))
            check_whole(path.with_suffix(".npz"))
            with np.load(path.with_suffix(".npz")) as arrays:
                return cast(T, from_plain(self.kind, rest, external, arrays))
        except (OSError, KeyError, TypeError, ValueError, AttributeError) as error:
            raise _unreadable(path, "not a result of this version", str(error), "what `calib run` writes") from error


def read_provenance(path: Path) -> Provenance:
    """Read what a JSON result was made with.

    Raises:
        InputError: not there, incomplete, or not of this version.
    """
    data = _read_json(path)
    try:
        return cast(Provenance, from_plain(Provenance, {key: data[key] for key in PROVENANCE}))
    except (KeyError, TypeError, ValueError) as error:
        raise _unreadable(path, "not a result of this version", str(error), "what `calib run` writes") from error


def _read_json(path: Path) -> dict[str, Any]:
    check_whole(path)
    try:
        data = json.loads(path.read_bytes())
    except (OSError, RecursionError) as error:
        raise _unreadable(path, "the result cannot be read", str(error), "a JSON object") from error
    if not isinstance(data, dict) or data.get("schema") != SCHEMA:
        found = f"schema {data.get('schema')!r}" if isinstance(data, dict) else type(data).__name__
        raise _unreadable(path, "not a result of this version", found, f"schema {SCHEMA}")
    return data


def is_incomplete(path: Path) -> bool:
    """Return whether a file is cut short or damaged otherwise: JSON, ``.npz`` or netCDF of HDF5."""
    try:
        if path.suffix == ".npz":
            with ZipFile(path) as packed:
                return packed.testzip() is not None
        if path.suffix == ".nc":
            import h5netcdf  # it takes longer to load than everything else here

            with h5netcdf.File(path) as stored:
                return not stored.groups and not stored.variables
        if path.suffix == ".json":
            json.loads(path.read_bytes())
    except (FileNotFoundError, IsADirectoryError, PermissionError):
        return False
    except (OSError, ValueError, EOFError, RuntimeError, BadZipFile, zlib.error):
        return True
    return False


def check_whole(path: Path, command: str = "calib run") -> None:
    """Check that a result is there and not cut short.

    Raises:
        InputError: it is not; `command` makes it again.
    """
    if not path.is_file():
        raise _unreadable(path, "the result is not there", "", "a result written by this program", command)
    if is_incomplete(path):
        found = f"{path.stat().st_size} bytes, whose end is missing or damaged"
        raise _unreadable(path, "the result is incomplete", found, "the whole file as it was written", command)


def _unreadable(path: Path, what: str, found: str, expected: str, command: str = "calib run") -> InputError:
    return InputError([Fault(str(path), "", what, found, expected, (), f"Make it again with `{command}`.")])


def plain_json(value: Any) -> Any:
    """Convert a value to JSON's own types: arrays to lists, nan and infinity to None, flags to their contract form.

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
    """Compute the sha256 of a file's content, in hexadecimal digits."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
