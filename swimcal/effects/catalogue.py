"""The catalogue of all known effects: the built-in ones, and those that users add.

Users add theirs through the entry point group `swimcal.effects`; each is checked against the form of an effect when the
catalogue is made.
"""

import math
from collections.abc import Container, Iterable, Mapping
from functools import lru_cache
from importlib.metadata import EntryPoint, entry_points
from types import MappingProxyType
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, StringConstraints, ValidationError, field_validator

from swimcal.effects import drive, measurement, structure, tendons, water
from swimcal.effects.effect import WAYS, Effect, Family, Parameter, Stage
from swimcal.errors import FaultCollector, InputError, shown
from swimcal.session_file import TrialKind
from swimcal.toml import dotted, fault_of, key_error

GROUP = "swimcal.effects"
_EXAMPLE = "docs/effects.md has a whole example, with all attributes."
_Line = Annotated[str, StringConstraints(pattern=r"^.*\S.*$")]
FAMILIES = (measurement, drive, tendons, structure, water)


@lru_cache(maxsize=1)
def catalogue() -> Mapping[str, Effect]:
    """Return every effect by its name, built-in ones first.

    Raises:
        InputError: the faults in the effects of users, all of them at once.
    """
    found = {effect.name: effect for family in FAMILIES for effect in family.EFFECTS}
    return MappingProxyType(found | added_effects(entry_points(group=GROUP), found))


def added_effects(points: Iterable[EntryPoint], taken: Container[str]) -> dict[str, Effect]:
    """Load the effects that entry points lead to, by name.

    Args:
        points: the entry points.
        taken: names that are in use already.

    Raises:
        InputError: an entry point that cannot be loaded, is no effect, lacks an attribute or has a name that is taken;
            all of them at once.
    """
    found: dict[str, Effect] = {}
    faults = FaultCollector()
    for point in points:
        with faults.nested():
            effect = _load(point)
            if effect.name in taken or effect.name in found:
                raise _fault(
                    point,
                    "an effect of this name is there already",
                    found=shown(effect.name),
                    expected="a name of its own",
                    next_step="Rename the effect, or remove one of the two packages.",
                )
            found[effect.name] = effect
    faults.raise_if_any()
    return found


class _Form(BaseModel):
    """The class attributes that describe every effect."""

    model_config = ConfigDict(from_attributes=True)

    name: _Line
    family: Family
    stage: Stage
    physics: _Line
    source: Annotated[str, StringConstraints(min_length=1)]
    seen_in: Annotated[frozenset[TrialKind], Field(min_length=1)]
    parameters: Annotated[tuple[Parameter, ...], Field(min_length=1)]

    @field_validator("parameters")
    @classmethod
    def _in_order(cls, parameters: tuple[Parameter, ...]) -> tuple[Parameter, ...]:
        for name, _, low, high, sd in parameters:
            if not (-math.inf < low <= 0 < high < math.inf and 0 < sd < math.inf):
                raise key_error(
                    f"{name}: bounds or prior out of order",
                    found=f"low {low}, high {high}, sd {sd}",
                    expected="numbers with low <= 0 < high, and sd above 0",
                )
        if len({parameter.name for parameter in parameters}) < len(parameters):
            raise key_error("two parameters of one name", expected="a name of its own for each")
        return parameters


def _load(point: EntryPoint) -> Effect:
    """Load the effect of an entry point.

    Raises:
        InputError: it cannot be loaded, or is not as an effect has to be.
    """
    try:
        loaded = point.load()
        is_class = isinstance(loaded, type) and issubclass(loaded, Effect) and loaded is not Effect
        effect = loaded() if is_class else loaded
    except Exception as error:  # a foreign module may raise anything on import
        raise _fault(
            point,
            "it cannot be loaded",
            found=f"{type(error).__name__}: {error}",
            expected='"module:name" of a class derived from calib.Effect that is made without arguments, or '
            "of one of it, in a module that can be imported",
            next_step=f"Mend the entry point or the module and install the package again, or remove it. {_EXAMPLE}",
        ) from error
    if not isinstance(effect, Effect):
        expected = "a class derived from calib.Effect, or one of it"
        raise _fault(point, "not an effect", found=shown(loaded), expected=expected, next_step=_EXAMPLE)
    faults = FaultCollector(_file(point))
    try:
        _Form.model_validate(effect)
    except ValidationError as error:
        faults.extend(fault_of(_Form, one, faults.file, dotted(tuple(one["loc"]))) for one in error.errors())
    if not effect.enters():
        expected = "at least one method of its own"
        faults.add("", "the effect does nothing", expected=expected, choices=WAYS, next_step=_EXAMPLE)
    faults.raise_if_any()
    return effect


def _fault(point: EntryPoint, what: str, *, found: str, expected: str, next_step: str) -> InputError:
    faults = FaultCollector(_file(point))
    faults.add("", what, found=found, expected=expected, next_step=next_step)
    return InputError(faults.faults)


def _file(point: EntryPoint) -> str:
    """Return the entry point as messages name it, with its package where that is known."""
    package = f", package {point.dist.name}" if point.dist is not None else ""
    return f'entry point {point.name} = "{point.value}" ({GROUP}{package})'
