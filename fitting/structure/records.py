"""Results as plain data and back: frozen dataclasses and named tuples field by field, their arrays kept apart.

The type of each field says how it is read back, so that a result needs no reader of its own.
"""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from types import NoneType, UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

import numpy as np

Named = Mapping[type, Mapping[str, Any]]
"""By their type, records that stand elsewhere: by name, which is all that is written of them."""


def to_plain(record: Any, named: tuple[type, ...], arrays: dict[str, np.ndarray], key: str = "") -> Any:
    """What JSON can hold of a record; each array goes into `arrays`, and its key there stands in its place.

    Args:
        record: of dataclasses, named tuples, tuples, arrays, numbers, texts and None.
        named: types of which only the `name` is written.
        arrays: receives the arrays.
        key: of this record.
    """
    if type(record) in named:
        return record.name
    if isinstance(record, np.ndarray):
        arrays[key] = record
        return key
    if names := _fields(type(record)):
        return {name: to_plain(getattr(record, name), named, arrays, f"{key}.{name}") for name in names}
    if isinstance(record, tuple):
        return [to_plain(item, named, arrays, f"{key}.{i}") for i, item in enumerate(record)]
    return record


def from_plain(kind: Any, data: Any, named: Named, arrays: Mapping[str, np.ndarray]) -> Any:
    """A record of this type from what `to_plain` gave; numbers that JSON does not know (null) are nan.

    Raises:
        KeyError: an array or a named record that is not there.
    """
    if kind in named:
        return named[kind][data]
    if kind is np.ndarray:
        return arrays[data]
    if get_origin(kind) in (Union, UnionType):
        (kind,) = (one for one in get_args(kind) if one is not NoneType)
        return None if data is None else from_plain(kind, data, named, arrays)
    if get_origin(kind) is tuple:
        kinds = get_args(kind)
        kinds = len(data) * kinds[:1] if kinds[-1] is Ellipsis else kinds
        return tuple(from_plain(one, item, named, arrays) for one, item in zip(kinds, data, strict=True))
    if isinstance(kind, type) and (names := _fields(kind)):
        types = get_type_hints(kind)
        return kind(**{name: from_plain(types[name], data[name], named, arrays) for name in names})
    return np.nan if data is None else data


def _fields(kind: type) -> tuple[str, ...]:
    """The fields of a dataclass or a named tuple; none of any other type."""
    if is_dataclass(kind):
        return tuple(field.name for field in fields(kind))
    return getattr(kind, "_fields", ()) if issubclass(kind, tuple) else ()
