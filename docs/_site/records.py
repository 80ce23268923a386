"""Markdown of the keys of a result file, from the record that is written."""

import inspect
import re
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from importlib import import_module


def record(place: str) -> str:
    """Return a heading and a table of keys; `place` is `module:Class`."""
    module, name = place.split(":")
    made = getattr(import_module(module), name)
    about, _, attributes = (inspect.getdoc(made) or "").partition("Attributes:\n")
    told = dict(_list_attributes(inspect.cleandoc(attributes)))
    head, keys = [f"### {name}\n", about.strip() + "\n"], written_keys(made)
    if not told:
        return "\n".join([*head, f"Keys: {', '.join(f'`{key}`' for key in keys)}.", ""])
    rows = [f"| `{key}` | {told.get(key, '').replace('|', '&#124;')} |" for key in keys]
    return "\n".join([*head, "| key | content |\n|---|---|", *rows, ""])


def written_keys(made: type) -> list[str]:
    """List the keys of a record that stand in its file."""
    if is_dataclass(made):
        return [field.name for field in fields(made) if not field.metadata]
    return list(made._fields)  # type: ignore[attr-defined]


def _list_attributes(text: str) -> Iterator[tuple[str, str]]:
    """Yield names with what is said of them, from a section of a docstring; names before one colon share it."""
    joined = re.sub(r"\n +", " ", text)
    for line in joined.splitlines():
        names, colon, meaning = line.partition(": ")
        for name in names.split(", ") if colon else ():
            yield name, meaning
