"""Result files: how records become JSON and back, written whole or not at all.

A record is a frozen dataclass or a named tuple of numbers, texts, arrays, flags, mappings, tuples and further records.
The types of its fields say how `to_plain` writes and `from_plain` reads it.

A `ResultFile` is a record on disk with its `Provenance`: the versions and inputs that it was made from. `writing_whole`
and `write_whole` leave either the whole file or nothing.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import secrets
import zlib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import MISSING, dataclass, field, fields, is_dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Generic, Literal, TypeVar, Union, cast, get_args, get_origin, get_type_hints
from zipfile import BadZipFile, ZipFile

import numpy as np

from swimcal.errors import Fault, InputError, ResultsNotWritable
from swimcal.flags import Flag

KEPT_ELSEWHERE = {"kept_elsewhere": True}
"""Metadata of a dataclass field that is not written with its record; the reader of the record provides it."""

External = Mapping[Any, Any]
"""Values that a reader provides.

They are the value of each field that is kept in another file, by the name of the field, and the records of each type
of which only names are written, by name.
"""

Arrays = dict[str, np.ndarray]
T = TypeVar("T")

SCHEMA = 1
"""The version of the JSON results' form."""

PROVENANCE = ("schema", "program", "mujoco", "model_sha256", "inputs", "seed", "effort")
"""Keys of every JSON result, in this order, which come before its own."""

PARTS = ".*.part.*"
"""Pattern of the temporary files of `writing_whole`."""


def to_plain(record: Any, named: tuple[type, ...] = (), arrays: Arrays | None = None, key: str = "") -> Any:
    """Convert a record to what JSON can hold.

    Args:
        record: the record, or a value within one.
        named: types of which only the attribute `name` is written.
        arrays: receives the arrays, and their keys take their place; None: arrays are written as nested lists.
        key: key of this record among the arrays.
    """
    if isinstance(record, named):
        return getattr(record, "name")  # noqa: B009 (of what type it is, the caller says)
    if isinstance(record, np.ndarray):
        if arrays is None:
            return record.tolist() if record.size else {"empty": list(record.shape)}
        arrays[key] = record
        return key
    if kept := _fields(type(record)):
        return {name: to_plain(getattr(record, name), named, arrays, _join(key, name)) for name in kept}
    if isinstance(record, Mapping):
        return {name: to_plain(item, named, arrays, _join(key, name)) for name, item in record.items()}
    if isinstance(record, tuple):
        return [to_plain(item, named, arrays, _join(key, i)) for i, item in enumerate(record)]
    return record


def from_plain(kind: Any, data: Any, external: External | None = None, arrays: Mapping[str, Any] | None = None) -> Any:
    """Rebuild a record from what `to_plain` gave; a number that JSON does not know (null) is nan.

    Args:
        kind: the type of the record, or of a value within one.
        data: what `to_plain` gave.
        external: values that are kept in other files, see `External`.
        arrays: the arrays by their keys.

    Raises:
        KeyError, TypeError, ValueError: the data are not of this type, or need something that `external` lacks.
    """
    external, origin = external or {}, get_origin(kind)
    if isinstance(kind, type) and kind in external:
        return external[kind][data]
    if kind is np.ndarray:
        return _array(data, arrays)
    if origin in (Union, UnionType):
        return _one_of(get_args(kind), data, external, arrays)
    if origin is tuple:
        kinds = get_args(kind)
        kinds = len(data) * kinds[:1] if kinds[-1] is Ellipsis else kinds
        return tuple(from_plain(one, item, external, arrays) for one, item in zip(kinds, data, strict=True))
    if isinstance(origin, type) and issubclass(origin, Mapping):
        of = get_args(kind)[1]
        return {name: from_plain(of, item, external, arrays) for name, item in data.items()}
    if isinstance(kind, type) and (names := _fields(kind)):
        return _record(kind, names, data, external, arrays)
    return _plain(kind, data)


def _join(key: str, part: object) -> str:
    return f"{key}.{part}" if key else str(part)


def _fields(kind: type) -> tuple[str, ...]:
    """Return the fields of a dataclass or a named tuple that are written; none of any other type."""
    if is_dataclass(kind):
        return tuple(field.name for field in fields(kind) if not field.metadata.get("kept_elsewhere"))
    return getattr(kind, "_fields", ()) if issubclass(kind, tuple) else ()


def _optional(kind: type) -> set[str]:
    """Return the fields that may be left out."""
    if is_dataclass(kind):
        return {f.name for f in fields(kind) if f.default is not MISSING or f.default_factory is not MISSING}
    return set(getattr(kind, "_field_defaults", ()))


def _record(kind: type, names: tuple[str, ...], data: Any, external: External, arrays: Any) -> Any:
    types, given = get_type_hints(kind), _optional(kind)
    if not isinstance(data, Mapping):
        raise TypeError(f"{kind.__name__}: found {type(data).__name__}, expected its fields by name")
    if strange := sorted(set(data) - set(names)):
        raise KeyError(f"{kind.__name__} has no {', '.join(strange)}")
    there = [name for name in names if name in data or name not in given]
    read = {name: from_plain(types[name], data[name], external, arrays) for name in there}
    kept = {f.name for f in fields(kind)} - set(names) if is_dataclass(kind) else set()
    return kind(**read | {name: external[name] for name in kept})


def _one_of(kinds: tuple[Any, ...], data: Any, external: External, arrays: Any) -> Any:
    if data is None and NoneType in kinds:
        return None
    possible = [one for one in kinds if one is not NoneType]
    for one in possible[:-1]:
        try:
            return from_plain(one, data, external, arrays)
        except (KeyError, TypeError, ValueError):
            continue
    return from_plain(possible[-1], data, external, arrays)


def _array(data: Any, arrays: Mapping[str, Any] | None) -> np.ndarray:
    if isinstance(data, str):
        return np.asarray((arrays or {})[data])
    if isinstance(data, Mapping):
        return np.empty(data["empty"])
    whole = np.array(data)
    return whole if whole.dtype == bool else np.array(data, float)


def _plain(kind: Any, data: Any) -> Any:
    if kind is float:
        return np.nan if data is None else float(data)
    if get_origin(kind) is Literal and data not in get_args(kind):
        raise ValueError(f"found {data!r}, expected one of {', '.join(map(repr, get_args(kind)))}")
    if isinstance(kind, type) and not isinstance(data, kind):
        raise TypeError(f"found {data!r}, expected a value of type {kind.__name__}")
    return data


# Result files.


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
        if blocking := next((folder for folder in path.parents if folder.is_file()), None):
            raise ResultsNotWritable(
                f"{blocking}: cannot be written into; found: a file; expected: a folder. Remove it, or move it away."
            ) from error
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
        kind: the record that it holds; its fields follow those of the provenance.
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
            external: what is kept in other files.

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


def _unreadable(path: Path, what: str, found: str, expected: str, command: str = "calib run") -> InputError:
    return InputError([Fault(str(path), "", what, found, expected, (), f"Make it again with `{command}`.")])
