"""Effects that users have added through the entry point group, each held to the form of an effect."""

from __future__ import annotations

import math
from collections.abc import Callable, Container, Iterable
from importlib.metadata import EntryPoint
from numbers import Real
from typing import Any, get_args

from session import FaultCollector, InputError
from session.errors import shown
from session.session_file import TrialKind
from swimmer.effects.effect import WAYS, Effect, Family, Parameter, Stage

GROUP = "swimcal.effects"
REQUIRED = ("name", "family", "stage", "physics", "source", "seen_in", "parameters")
"""What every effect says of itself, in class attributes."""
_EXAMPLE = "docs/effects.md has a whole example, with all attributes."


def added_effects(points: Iterable[EntryPoint], taken: Container[str]) -> dict[str, Effect]:
    """The effects that entry points lead to, by name.

    Args:
        points: of the group.
        taken: names that are there already.

    Raises:
        InputError: an entry point that cannot be loaded, is no effect, lacks an attribute or has a name that is taken;
            all of them at once.
    """
    found: dict[str, Effect] = {}
    faults = FaultCollector()
    for point in points:
        with faults.nested():
            effect = _loaded(point)
            if effect.name in taken or effect.name in found:
                raise _fault(
                    point,
                    "name",
                    "an effect of this name is there already",
                    found=shown(effect.name),
                    expected="a name of its own",
                    next_step="Rename the effect, or remove one of the two packages.",
                )
            found[effect.name] = effect
    faults.raise_if_any()
    return found


def _loaded(point: EntryPoint) -> Effect:
    """The effect of an entry point.

    Raises:
        InputError: it cannot be loaded, or is not as an effect has to be.
    """
    try:
        told = point.load()
    except Exception as error:  # whatever a module of somebody else's does when it is imported
        raise _fault(
            point,
            "",
            "it cannot be loaded",
            found=_told(error),
            expected='"module:name" of a class derived from swimmer.effects.Effect, in a module that can be imported',
            next_step=f"Mend the entry point or the module and install the package again, or remove it. {_EXAMPLE}",
        ) from error
    if told is Effect or not (isinstance(told, Effect) or (isinstance(told, type) and issubclass(told, Effect))):
        raise _fault(
            point,
            "",
            "not an effect",
            found="the abstract class Effect itself" if told is Effect else shown(told),
            expected="a class derived from swimmer.effects.Effect, or one of it",
            next_step=_EXAMPLE,
        )
    effect = told if isinstance(told, Effect) else _made(point, told)
    _check_form(point, effect)
    return effect


def _made(point: EntryPoint, kind: type[Effect]) -> Effect:
    """One of a class.

    Raises:
        InputError: it is not made without arguments.
    """
    try:
        return kind()
    except Exception as error:
        raise _fault(
            point,
            "",
            "the effect cannot be made",
            found=_told(error),
            expected=f"a class that is made without arguments: {kind.__name__}()",
            next_step="Let the entry point name one of it, made in its module.",
        ) from error


def _check_form(point: EntryPoint, effect: Effect) -> None:
    """That an effect says what it is and does something.

    Raises:
        InputError: it does not.
    """
    faults = FaultCollector(_file(point))
    missing = [name for name in REQUIRED if not hasattr(effect, name)]
    if missing:
        faults.add(
            "",
            f"the effect lacks {', '.join(missing)}",
            expected=f"the class attributes {', '.join(REQUIRED)}",
            next_step=_EXAMPLE,
        )
    for name, (is_right, expected) in _FORM.items():
        if name not in missing and not is_right(value := getattr(effect, name)):
            faults.add(name, "wrong value", found=shown(value), expected=expected)
    if "parameters" not in missing and _is_parameters(effect.parameters):
        for parameter in effect.parameters:
            _check_parameter(parameter, faults)
    if not effect.enters():
        faults.add("", "the effect does nothing", expected="at least one method of its own", choices=WAYS)
    faults.raise_if_any()


def _check_parameter(parameter: Parameter, faults: FaultCollector) -> None:
    """Adds a fault where zero is not within the bounds, or the prior is none."""
    numbers = (parameter.low, parameter.high, parameter.sd)
    are_numbers = all(isinstance(number, Real) and math.isfinite(number) for number in numbers)
    if not (are_numbers and parameter.low <= 0 < parameter.high and parameter.sd > 0):
        faults.add(
            f"parameters, {parameter.name}",
            "bounds or prior out of order",
            found=", ".join(
                f"{name} {shown(value)}" for name, value in zip(("low", "high", "sd"), numbers, strict=True)
            ),
            expected="numbers with low <= 0 < high, and sd above 0",
        )


def _is_line(value: Any) -> bool:
    return isinstance(value, str) and bool(value.strip()) and "\n" not in value


def _is_kinds(value: Any) -> bool:
    return isinstance(value, (frozenset, set)) and bool(value) and value <= set(get_args(TrialKind))


def _is_parameters(value: Any) -> bool:
    if not (
        isinstance(value, tuple)
        and value
        and all(isinstance(one, Parameter) and isinstance(one.name, str) for one in value)
    ):
        return False
    return len({one.name for one in value}) == len(value)


_FORM: dict[str, tuple[Callable[[Any], bool], str]] = {
    "name": (_is_line, "a text"),
    "family": (lambda value: value in get_args(Family), f"one of {', '.join(get_args(Family))}"),
    "stage": (lambda value: value in get_args(Stage), f"one of {', '.join(get_args(Stage))}"),
    "physics": (_is_line, "a line of text"),
    "source": (lambda value: isinstance(value, str) and bool(value.strip()), "a text: paper, equation or law"),
    "seen_in": (_is_kinds, f"a frozenset of {', '.join(get_args(TrialKind))}"),
    "parameters": (_is_parameters, "a tuple of Parameter(name, unit, low, high, sd), each of a name of its own"),
}


def _fault(point: EntryPoint, where: str, what: str, *, found: str, expected: str, next_step: str) -> InputError:
    faults = FaultCollector(_file(point))
    faults.add(where, what, found=found, expected=expected, next_step=next_step)
    return InputError(faults.faults)


def _file(point: EntryPoint) -> str:
    """The entry point as messages name it, with its package where that is known."""
    package = f", package {point.dist.name}" if point.dist is not None else ""
    return f'entry point {point.name} = "{point.value}" ({GROUP}{package})'


def _told(error: Exception) -> str:
    return f"{type(error).__name__}: {error}"
