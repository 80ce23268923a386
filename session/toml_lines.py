"""The lines on which the keys of a TOML file are, which the parsers do not give."""

from __future__ import annotations

import tomllib
from collections import Counter
from collections.abc import Iterator
from typing import Any

Key = tuple[str | int, ...]
"""The place of a value: table names, keys and positions, counted from 0, in arrays."""


def lines_of_keys(text: str) -> dict[Key, int]:
    """Find the line on which the statement of each key of a valid TOML text starts."""
    lines: dict[Key, int] = {}
    tables: Counter[Key] = Counter()  # how many tables each array of tables has so far
    table: Key = ()
    for line, statement, content in _statements(text):
        if statement.lstrip().startswith("["):
            table = _open_table(content, tables)
            for length in range(1, len(table) + 1):
                lines.setdefault(table[:length], line)
        else:
            for key in _keys(content):
                lines.setdefault(table + key, line)
    return lines


def _statements(text: str) -> Iterator[tuple[int, str, dict[str, Any]]]:
    """Yield line number, first line and content of each statement: the shortest run of lines that is TOML alone."""
    pending: list[str] = []
    for number, line in enumerate(text.replace("\r\n", "\n").split("\n"), start=1):
        pending.append(line)
        try:
            content = tomllib.loads("\n".join(pending))
        except ValueError:  # the statement continues in the next line
            continue
        if content:
            yield number - len(pending) + 1, pending[0], content
        pending = []


def _open_table(header: dict[str, Any], tables: Counter[Key]) -> Key:
    """Return the key of the table that a header opens; [a.b] parses to {"a": {"b": {}}}, [[a]] to {"a": [{}]}."""
    key: Key = ()
    node: Any = header
    while node:
        name, node = next(iter(node.items()))
        key += (name,)
        if isinstance(node, list):
            tables[key] += 1
            node = {}
        if key in tables:
            key += (tables[key] - 1,)
    return key


def _keys(content: Any) -> Iterator[Key]:
    """Yield every key within a value, its own empty key left out."""
    if not isinstance(content, dict | list):
        return
    for name, value in content.items() if isinstance(content, dict) else enumerate(content):
        yield (name,)
        yield from ((name, *key) for key in _keys(value))


def dotted(key: Key) -> str:
    """Format a key as TOML users write it: ``trial[2].role``."""
    parts = [f"[{part}]" if isinstance(part, int) else f".{part}" for part in key]
    return "".join(parts).removeprefix(".")
