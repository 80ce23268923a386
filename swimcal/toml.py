"""TOML files read with the place of every value, so that all faults are reported at once.

`load_toml` validates a file by a pydantic model; every fault has its key, its line and the choices. The lines come from
`lines_of_keys`, because TOML parsers do not give them; what is expected at a place, from the annotations of the model.
"""

from __future__ import annotations

import re
import tomllib
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Literal, Self, TypeVar, Union, get_args, get_origin

from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic_core import ErrorDetails, PydanticCustomError

from swimcal.errors import Fault, FaultCollector, InputError, did_you_mean, shown
from swimcal.tables import read_text

Key = tuple[str | int, ...]
"""The place of a value: table names, keys and positions, counted from 0, in arrays."""

UNITS = {"m": "metres", "kg": "kilograms", "s": "seconds", "hz": "turns a second"}
"""Units by the last word of a key."""
NAMES_OF_TYPES = {float: "a number", int: "a whole number", str: "a text", bool: "true or false", tuple: "a list"}


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


def expectation_of(annotation: Any) -> str:
    """Describe in words what a value of this annotation looks like."""
    if choices := choices_of(annotation):
        return f"one of {', '.join(choices)}"
    if keys := known_keys(annotation):
        return f"a table with the keys {', '.join(keys)}"
    names = (NAMES_OF_TYPES.get(get_origin(option) or option) for option in _options(annotation))
    return " or ".join(name for name in names if name)


Model = TypeVar("Model", bound=BaseModel)


class TomlTable(BaseModel):
    """Base of the models of TOML tables.

    Unknown keys, nan, infinity and values of another type (``"60"`` or ``true`` for a number) are faults, and
    values do not change. Arrays arrive as tuples: annotate them ``tuple[float, ...]``.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, strict=True)

    def __eq__(self, other: object) -> bool:
        """Compare what the tables hold; pydantic would compare arrays that a table has computed of it, too."""
        if type(self) is not type(other):
            return NotImplemented
        return all(getattr(self, key) == getattr(other, key) for key in type(self).model_fields)

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """Copy the table with other values, without what was computed of the old ones.

        Args:
            update: values by their names; they are not validated.
            deep: whether the values are copied too.
        """
        copied = super().model_copy(update=update, deep=deep)
        for computed in copied.__dict__.keys() - type(self).model_fields.keys():
            del copied.__dict__[computed]
        return copied


class TomlSource:
    """A TOML file that was read, with the line of each of its keys; `file` is its name for messages.

    Raises:
        InputError: not there, or not TOML.
    """

    def __init__(self, path: Path) -> None:
        self.file, self._text = str(path), read_text(path)
        self.data = _parse(self.file, self._text)

    @cached_property
    def _lines(self) -> dict[Key, int]:
        return lines_of_keys(self._text)

    def where(self, key: Key) -> str:
        """Describe the place of a key for a message: ``"line 12, trial[2].role"``.

        An absent key has the line of the table it is missing from.
        """
        name = dotted(key)
        for length in range(len(key), 0, -1):
            if line := self._lines.get(key[:length]):
                return f"line {line}, {name}"
        return name

    def validate(self, model: type[Model], faults: FaultCollector) -> Model | None:
        """Validate the content as `model`; None, and a fault for each thing wrong, where it does not fit."""
        try:
            return model.model_validate(_as_tuples(self.data))
        except ValidationError as error:
            faulty = error.errors()
            # A list is called too short, too, because its items are faulty, which is reported item by item.
            own = [e for e in faulty if e["type"] != "too_short" or len(e["input"]) < e["ctx"]["min_length"]]
            faults.extend(fault_of(model, one, self.file, self.where(tuple(one["loc"]))) for one in own)
        except RecursionError:
            faults.add("", "nested too deeply", expected="the few levels of the documented form")
        return None


def fault_of(model: type[BaseModel], details: ErrorDetails, file: str, where: str) -> Fault:
    """Convert one error of pydantic's to a fault, at a place that the reader knows.

    Args:
        model: the model that was not met.
        details: the error.
        file: name of the file for the message.
        where: place in the file.
    """
    key: Key = tuple(details["loc"])
    context = details.get("ctx", {})
    annotation = annotation_at(model, key)
    found = _format_found(details["input"])
    choices: tuple[str, ...] = ()
    next_step = ""
    match details["type"]:
        case "swimcal":
            what, expected, next_step = context["what"], context["expected"], context["next_step"]
            found, choices = context["found"] or found, tuple(context["choices"])
        case "extra_forbidden":
            what, found, expected = "unknown key", shown(key[-1]), "a known key"
            choices = known_keys(annotation_at(model, key[:-1]))
            next_step = did_you_mean(str(key[-1]), choices)
        case "missing":
            what, found, expected = "key is missing", "", expectation_of(annotation)
        case "value_error" | "assertion_error":
            what, expected = str(context["error"]), ""
        case "too_short":
            what = f"too few {key[-1] if isinstance(key[-1], str) else 'of them'}"
            expected = f"at least {context['min_length']}"
        case _:
            what, choices = "wrong value", choices_of(annotation)
            expected = "one of the choices" if choices else re.sub(r"^\w+ should (be|have) ", "", details["msg"])
            next_step = did_you_mean(str(details["input"]), choices)
            if details["type"].startswith("less_than"):
                next_step = _unit_question(key)
    return Fault(file, where, what, found, expected, choices, next_step)


def _unit_question(key: Key) -> str:
    """Ask whether a large value is in the unit of its key, as in `length_m`; empty where it has none, or several."""
    names = [part for part in key if isinstance(part, str)]
    *_, before, unit = ("", "", *(names[-1] if names else "").split("_"))
    return f"Is it in {UNITS[unit]}?" if unit in UNITS and before not in (*UNITS, "n", "pa") else ""


def _format_found(value: Any) -> str:
    """Format a value as TOML would show it, a whole table by its name only."""
    if isinstance(value, dict):
        return "a table" if value else "an empty table"
    if isinstance(value, bool):
        return str(value).lower()
    return shown(list(value) if isinstance(value, tuple) else value)


def load_toml(path: Path, model: type[Model]) -> Model:
    """Read a TOML file as a pydantic model of the whole file, best derived from `TomlTable`.

    Raises:
        InputError: not there, not TOML, or every way in which it does not fit the model, at once.
    """
    source = TomlSource(path)
    faults = FaultCollector(source.file)
    content = source.validate(model, faults)
    faults.raise_if_any()
    assert content is not None
    return content


def key_error(
    what: str, *, expected: str, found: str = "", choices: Sequence[str] = (), next_step: str = ""
) -> PydanticCustomError:
    """Build the error for a validator of a model to raise, so that its fault has everything that a `Fault` can have.

    >>> raise key_error("no such tendon", found=name, expected="a tendon of the robot", choices=names)

    Args:
        what: what is wrong, without a full stop.
        expected: what would have been right.
        found: what is there; default: the value itself.
        choices: the valid values, where they can be listed.
        next_step: what to do about it.
    """
    context = {"what": what, "expected": expected, "found": found, "choices": list(choices), "next_step": next_step}
    return PydanticCustomError("swimcal", "{what}", context)


def _parse(file: str, text: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except RecursionError:
        fault = Fault(file, "", "nested too deeply", expected="TOML")
    except ValueError as error:  # tomllib.TOMLDecodeError, and numbers of thousands of digits
        message, _, place = str(error).partition(" (at ")
        line = re.match(r"line (\d+)", place)
        last = len(text.rstrip().split("\n"))
        where = f"line {line[1] if line else last}"
        found, step = message[:1].lower() + message[1:], ""
        if "\\" in message or "escape" in message.lower() or "hex value" in message.lower():
            step = "A backslash begins an escape: write paths with forward slashes, or in single quotes."
        fault = Fault(file, where, "not valid TOML", found, "TOML, https://toml.io", next_step=step)
    raise InputError([fault])


def _as_tuples(value: Any) -> Any:
    """Convert lists to tuples, the immutable form that the models hold."""
    if isinstance(value, dict):
        return {key: _as_tuples(item) for key, item in value.items()}
    return tuple(map(_as_tuples, value)) if isinstance(value, list) else value
