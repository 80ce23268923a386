"""TOML files, validated by a pydantic model; every fault has its key, its line and the choices."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic_core import ErrorDetails, PydanticCustomError

from session.annotations import annotation_at, choices_of, expectation_of, known_keys
from session.errors import Fault, FaultCollector, did_you_mean, shown
from session.tables import read_text
from session.toml_lines import Key, dotted, lines_of_keys

Model = TypeVar("Model", bound=BaseModel)


class Table(BaseModel):
    """Base of the models of TOML tables.

    Unknown keys, nan, infinity and values of another type (``"60"`` or ``true`` for a number) are faults, and
    values do not change. Arrays arrive as tuples: annotate them ``tuple[float, ...]``.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, strict=True)


class TomlSource:
    """A TOML file that was read, with the line of each of its keys; `file` is its name for messages."""

    def __init__(self, file: str, text: str) -> None:
        self.file = file
        self.data: dict[str, Any] = _parse(file, text)
        self._text = text
        self._lines: dict[Key, int] | None = None

    def where(self, key: Key) -> str:
        """Describe the place of a key for a message: ``"line 12, trial[2].role"``.

        An absent key has the line of the table it is missing from.
        """
        if self._lines is None:
            self._lines = lines_of_keys(self._text)
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
            own = [details for details in error.errors() if not _only_follows(details)]
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
            what, expected = (
                f"too few {key[-1] if isinstance(key[-1], str) else 'of them'}",
                f"at least {context['min_length']}",
            )
        case _:
            what, choices = "wrong value", choices_of(annotation)
            expected = "one of the choices" if choices else re.sub(r"^\w+ should (be|have) ", "", details["msg"])
            next_step = did_you_mean(str(details["input"]), choices)
    return Fault(file, where, what, found, expected, choices, next_step)


def _only_follows(details: ErrorDetails) -> bool:
    """Return whether a list is called too short only because its items are faulty, which is reported item by item."""
    return details["type"] == "too_short" and len(details["input"]) >= details["ctx"]["min_length"]


def _format_found(value: Any) -> str:
    """Format a value as TOML would show it, a whole table by its name only."""
    if isinstance(value, dict):
        return "a table" if value else "an empty table"
    if isinstance(value, bool):
        return str(value).lower()
    return shown(list(value) if isinstance(value, tuple) else value)


def load_toml(path: Path, model: type[Model]) -> Model:
    """Read a TOML file as a pydantic model of the whole file, best derived from `Table`.

    Raises:
        InputError: not there, not TOML, or every way in which it does not fit the model, at once.
    """
    source = read_toml(path)
    faults = FaultCollector(source.file)
    content = source.validate(model, faults)
    faults.raise_if_any()
    assert content is not None
    return content


def read_toml(path: Path) -> TomlSource:
    """Read a TOML file, for validation in several steps.

    Raises:
        InputError: not there, or not TOML.
    """
    return TomlSource(str(path), read_text(path))


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
    faults = FaultCollector(file)
    try:
        return tomllib.loads(text)
    except RecursionError:
        faults.add("", "nested too deeply", expected="TOML")
    except ValueError as error:  # tomllib.TOMLDecodeError, and numbers of thousands of digits
        message, _, place = str(error).partition(" (at ")
        line = re.match(r"line (\d+)", place)
        last = len(text.rstrip().split("\n"))
        where = f"line {line[1] if line else last}"
        found, step = message[:1].lower() + message[1:], ""
        if "\\" in message or "escape" in message.lower() or "hex value" in message.lower():
            step = "A backslash begins an escape: write paths with forward slashes, or in single quotes."
        faults.add(where, "not valid TOML", found=found, expected="TOML, https://toml.io", next_step=step)
    faults.raise_if_any()
    raise AssertionError("unreachable")


def _as_tuples(value: Any) -> Any:
    """Convert lists to tuples, the immutable form that the models hold."""
    if isinstance(value, dict):
        return {key: _as_tuples(item) for key, item in value.items()}
    return tuple(map(_as_tuples, value)) if isinstance(value, list) else value
