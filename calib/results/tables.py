"""Tables of a result: which there are, and how one is asked for."""

from collections.abc import Iterable, Mapping
from typing import Any

import pandas as pd

from session import FaultCollector, Flag


def chosen(tables: Mapping[str, Any], name: str) -> Any:
    """One of several tables by name.

    Raises:
        InputError: there is none of this name.
    """
    if name not in tables:
        faults = FaultCollector("to_frame")
        faults.add("", "no such table", found=repr(name), expected="a table of this result", choices=tuple(tables))
        faults.raise_if_any()
    return tables[name]


def flag_frame(flags: Iterable[tuple[str, Flag]]) -> pd.DataFrame:
    """A row a flag: trial (empty for the whole), kind, markers, frames, message."""
    rows = [
        {
            "trial": trial,
            "kind": flag.kind,
            "markers": ", ".join(flag.markers),
            "first_frame": flag.frames[0] if flag.frames else None,
            "last_frame": flag.frames[1] if flag.frames else None,
            "message": flag.message,
        }
        for trial, flag in flags
    ]
    columns = ["trial", "kind", "markers", "first_frame", "last_frame", "message"]
    return pd.DataFrame(rows, columns=columns).astype({"first_frame": "Int64", "last_frame": "Int64"})


def page_of(summary: str, frame: pd.DataFrame) -> str:
    """A result in a notebook: its summary above a table."""
    import html

    lines = "<br>".join(html.escape(line) for line in summary.splitlines())
    return f"<p>{lines}</p>{frame.to_html(float_format=lambda value: f'{value:.4g}', na_rep='')}"
