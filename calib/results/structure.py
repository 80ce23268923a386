"""What the dry experiments say of a robot that does not swim: `results/structure.json`."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import pandas as pd

from calib.results.tables import chosen, flag_frame, page_of
from fitting import Structure
from session import Session


@dataclass(frozen=True, eq=False)
class StructureResult:
    """Hinges and crank of a session that has no swim trial.

    Attributes:
        session: that was fitted.
        name: what it is, in words.
        file: `results/structure.json`.
        data: all that the file holds.
        notes: what was said while it was made.
        made: files that were made anew.
    """

    session: Session = field(repr=False)
    name: str
    file: Path
    data: Structure = field(repr=False)
    notes: tuple[str, ...] = ()
    made: tuple[Path, ...] = ()

    def to_frame(self, table: str = "structure") -> pd.DataFrame:
        """One of the tables.

        Args:
            table: "structure" (a row a quantity: value, standard error, unit, whether it is assumed) or "flags".

        Raises:
            InputError: no such table.
        """
        flags = [("", flag) for flag in self.data.flags]
        flags += [(decay.name, flag) for decay in self.data.decays for flag in decay.flags]
        flags += [(run.name, flag) for run in (self.data.crank.trials if self.data.crank else ()) for flag in run.flags]
        tables = {"structure": self._structure, "flags": lambda: flag_frame(flags)}
        frame: pd.DataFrame = chosen(tables, table)()
        return frame

    def summary(self) -> str:
        """Where each number of the structure comes from, the biggest doubt, and what to do next."""
        flags = self.to_frame("flags")
        doubt = f"Biggest doubt: {flags.message.iloc[0]}." if len(flags) else "No doubt was raised."
        sources = [source.sentence for source in self.data.sources]
        add = f"Next: film a swim, add it to {self.session.folder / 'session.toml'}"
        return "\n".join([f"{self.session.name}: {self.name}.", *sources, doubt, add])

    def _repr_html_(self) -> str:
        return page_of(self.summary(), self.to_frame())

    def _structure(self) -> pd.DataFrame:
        rows = [
            {"quantity": each.quantity, "value": each.value, "se": each.se, "unit": each.unit, "assumed": each.assumed}
            for each in self.data.sources
        ]
        return pd.DataFrame(rows).set_index("quantity")
