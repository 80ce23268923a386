"""The result of dry experiments with a robot that does not swim: `results/structure.json`."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

import pandas as pd

from calib.results.figures import StructureFigures
from calib.results.result import Result, flag_frame, flag_lines
from fitting import Structure
from session import Flag


@dataclass(frozen=True, eq=False, kw_only=True)
class StructureResult(Result):
    """Hinges and crank of a session that has no swim trial.

    Tables of `to_frame`: "structure" (a row a quantity: value, standard error, unit, whether assumed) and "flags".

    Example:
        >>> found = calib.fit("bench", "quick", progress=False)     # a session of one free decay
        >>> found.to_frame()[["unit", "assumed"]]
                            unit  assumed
        quantity
        hinge_stiffness  N m/rad    False
        hinge_damping   N m s/rad   False
        crank_arm             m      True
        >>> found.plot.names
        ('robot', 'decay-spectrum-1', 'decay-1')
    """

    key = "structure"

    data: Structure = field(repr=False)
    plot: StructureFigures = field(repr=False)

    def summary(self) -> str:
        """Summarise where each number of the structure comes from, the main caveat, and what to do next."""
        about, flag = next(self._flags(), ("", None))
        caveat = f"Main caveat: {f'{about}: ' if about else ''}{flag.message}." if flag else "No caveat."
        sources = [source.sentence for source in self.data.sources]
        add = f"Next: film a swim trial, add it to {self.session.folder / 'session.toml'}"
        return "\n".join([f"{self.session.name}: {self.name}.", *sources, caveat, add])

    def details(self) -> list[str]:
        """List the numbers of the structure, and every flag: of the experiments, each once, then of the whole."""
        return [*(source.sentence for source in self.data.sources), *flag_lines(self._flags())]

    def _tables(self) -> Mapping[str, Callable[[], pd.DataFrame]]:
        return {"structure": self._structure, "flags": lambda: flag_frame(self._flags())}

    def _flags(self) -> Iterator[tuple[str, Flag]]:
        yield from (("", flag) for flag in self.data.flags)
        yield from ((decay.name, flag) for decay in self.data.decays for flag in decay.flags)
        crank = self.data.crank
        yield from ((run.name, flag) for run in (crank.trials if crank else ()) for flag in run.flags)

    def _structure(self) -> pd.DataFrame:
        rows = [
            {"quantity": each.quantity, "value": each.value, "se": each.se, "unit": each.unit, "assumed": each.assumed}
            for each in self.data.sources
        ]
        return pd.DataFrame(rows).set_index("quantity")
