"""Results as plain data and back; the types of a record's fields say how it is written and read.

A record is a frozen dataclass or a named tuple of numbers, texts, arrays, flags, mappings, tuples and further records.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, fields, is_dataclass
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

import numpy as np

KEPT_ELSEWHERE = {"kept_elsewhere": True}
"""Metadata of a dataclass field that is not written with its record; the reader of the record provides it."""

External = Mapping[Any, Any]
"""Values that a reader provides.

They are the value of each field that is kept in another file, by the name of the field, and the records of each type
of which only names are written, by name.
"""

Arrays = dict[str, np.ndarray]


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
