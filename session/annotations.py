"""What the annotations of a pydantic model say of the value at one place: its keys, its choices, its type."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel

from session.toml_lines import Key


def _options(annotation: Any) -> Iterator[Any]:
    """Yield the types that a value may have: the members of a union, without `Annotated`."""
    origin = get_origin(annotation)
    if origin is Annotated:
        yield from _options(get_args(annotation)[0])
    elif origin in (Union, UnionType):
        for member in get_args(annotation):
            yield from _options(member)
    else:
        yield annotation


def annotation_at(annotation: Any, key: Key) -> Any:
    """Find the annotation that a model gives to the value at `key`; None where it is not known.

    Args:
        annotation: the model, or the annotation of a value that holds others.
        key: the place of the value in it.
    """
    for part in key:
        inner = (_inner(option, part) for option in _options(annotation))
        annotation = next((found for found in inner if found is not None), None)
    return annotation


def _inner(annotation: Any, part: str | int) -> Any:
    """Find the annotation of one key, or of one position, within an annotated value; None where there is none."""
    if fields := _fields(annotation):
        return fields.get(str(part))
    origin, args = get_origin(annotation), get_args(annotation)
    if isinstance(part, str):
        return args[1] if origin in (dict, Mapping) else None
    if origin is tuple and Ellipsis not in args:
        return args[part] if part < len(args) else None
    return args[0] if args else None


def _fields(annotation: Any) -> dict[str, Any]:
    """Return the keys of a table and their annotations; empty for an annotation that is no model."""
    if get_origin(annotation) or not isinstance(annotation, type) or not issubclass(annotation, BaseModel):
        return {}
    return {field.alias or name: field.annotation for name, field in annotation.model_fields.items()}


def known_keys(annotation: Any) -> tuple[str, ...]:
    """Return the keys that a table of this annotation may have; empty for an annotation that is no table."""
    return tuple(key for option in _options(annotation) for key in _fields(option))


def choices_of(annotation: Any) -> tuple[str, ...]:
    """Return the values that a `Literal` allows; empty for every other annotation."""
    literals = (get_args(option) for option in _options(annotation) if get_origin(option) is Literal)
    return tuple(str(choice) for choices in literals for choice in choices)


NAMES_OF_TYPES = {float: "a number", int: "a whole number", str: "a text", bool: "true or false", tuple: "a list"}


def expectation_of(annotation: Any) -> str:
    """Describe in words what a value of this annotation looks like."""
    if choices := choices_of(annotation):
        return f"one of {', '.join(choices)}"
    if keys := known_keys(annotation):
        return f"a table with the keys {', '.join(keys)}"
    names = (NAMES_OF_TYPES.get(get_origin(option) or option) for option in _options(annotation))
    return " or ".join(name for name in names if name)
