"""Mechanisms of the second simulator: each effect of the catalogue in another form, and others.

A mechanism is in the module of its family, with a function of its name: a generator draws what differs from one
session to the next (sign, side, marker, shape), and the function that comes back gives the mechanisms at a strength
above 0, typical of robots as they are built at 1.
"""

from collections.abc import Callable, Mapping
from inspect import isfunction
from types import ModuleType

import numpy as np

from benchmarks.reality.mechanism import AtStrength
from benchmarks.reality.mechanisms import drive, fluid, measurement, outside, structure, tendons

Drawn = Callable[[np.random.Generator], AtStrength]


def none_at_zero(draw: Drawn) -> Drawn:
    """Return the same draw, with nothing that acts at strength 0."""

    def drawn(random: np.random.Generator) -> AtStrength:
        at = draw(random)
        return lambda strength: at(strength) if strength else ()

    return drawn


def _list_draws(module: ModuleType) -> dict[str, Drawn]:
    """Return how each mechanism of a module is drawn, in their order; at strength 0 there is none."""
    own = {name: each for name, each in vars(module).items() if isfunction(each) and each.__module__ == module.__name__}
    return {name: none_at_zero(draw) for name, draw in own.items() if not name.startswith("_")}


FAMILIES: Mapping[str, Mapping[str, Drawn]] = {
    "measurement": _list_draws(measurement),
    "drive": _list_draws(drive),
    "tendons": _list_draws(tendons),
    "structure": _list_draws(structure),
    "fluid": _list_draws(fluid),
}
"""Each effect of the catalogue, by its family and its name."""
CATALOGUED: Mapping[str, Drawn] = {name: drawn for family in FAMILIES.values() for name, drawn in family.items()}
OUTSIDE: Mapping[str, Drawn] = _list_draws(outside)
"""Mechanisms that the catalogue does not hold, by name."""
EVERY: Mapping[str, Drawn] = {**CATALOGUED, **OUTSIDE}
