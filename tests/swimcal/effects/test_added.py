"""Effects of users: what is wrong with one is said with its entry point, and all of it at once."""

import sys
from collections.abc import Callable, Iterator, Mapping
from importlib.metadata import EntryPoint

import pytest

from swimcal.effects.catalogue import catalogue
from swimcal.effects.effect import Effect, Parameter
from swimcal.effects.tendons import CrankArmError
from swimcal.errors import InputError
from tests.swimcal.effects.swims import ROBOT

Catalogue = Callable[..., Mapping[str, Effect]]
"""The catalogue with entry points of these values, named e0, e1 and so on."""


@pytest.fixture
def catalogue_with(monkeypatch: pytest.MonkeyPatch) -> Iterator[Catalogue]:
    def found(*values: str) -> Mapping[str, Effect]:
        points = [EntryPoint(f"e{k}", value, "swimcal.effects") for k, value in enumerate(values)]
        monkeypatch.setattr(sys.modules["swimcal.effects.catalogue"], "entry_points", lambda **_: points)
        catalogue.cache_clear()
        return catalogue()

    yield found
    catalogue.cache_clear()


class Mine(CrankArmError):
    name = "my_own"


class Empty(Effect):
    name = "empty"


class OutOfOrder(CrankArmError):
    name = "out_of_order"
    family = "gremlins"  # type: ignore[assignment]
    seen_in = frozenset({"swimm"})  # type: ignore[arg-type]
    parameters = (Parameter("share", "1", 0.1, 1.0, 0.0),)


class Idle(Effect):
    name, family, stage = "idle", "tendons", "tail"
    physics = source = "Nothing at all."
    seen_in = frozenset({"swim"})
    parameters = (Parameter("share", "1", 0.0, 1.0, 0.1),)


def test_a_user_adds_one_through_an_entry_point(catalogue_with: Catalogue) -> None:
    assert isinstance(catalogue_with(f"{__name__}:Mine")["my_own"], Mine)


@pytest.mark.parametrize(
    ("value", "parts"),
    [
        (
            ":Nobody",
            (
                "it cannot be loaded",
                "AttributeError",
                "'Nobody'",
                "install the package again, or remove it. docs/effects.md",
            ),
        ),
        ("no_such_module:Mine", ("it cannot be loaded", "ModuleNotFoundError: No module named 'no_such_module'")),
        ("tests.swimcal.effects.without_sd:Mine", ("it cannot be loaded", "TypeError", "'sd'")),
        (":ROBOT", ("not an effect", "a class derived from calib.Effect")),
        (":Effect", ("not an effect; found <class 'swimcal.effects.effect.Effect'>",)),
        (
            ":Empty",
            (
                "family: key is missing; expected one of measurement, drive",
                "parameters: key is missing; expected a list",
                "docs/effects.md",
                "the effect does nothing; expected at least one method of its own; choices: in_trial, robot, mjcf",
            ),
        ),
        (
            ":OutOfOrder",
            (
                "3 faults",
                "family: wrong value; found 'gremlins'; expected one of the choices; choices: measurement, drive",
                "seen_in[0]: wrong value; found 'swimm'",
                "parameters: share: bounds or prior out of order; found low 0.1, high 1.0, sd 0.0; expected",
            ),
        ),
        (":Idle", ("the effect does nothing",)),
        (":CrankArmError", ("an effect of this name is there already; found 'crank_arm_error'", "Rename")),
    ],
)
def test_one_that_is_wrong_is_reported_with_its_entry_point(
    catalogue_with: Catalogue, value: str, parts: tuple[str, ...]
) -> None:
    value = f"{__name__}{value}" if value.startswith(":") else value
    with pytest.raises(InputError) as caught:
        catalogue_with(value)
    assert str(caught.value).startswith(f'entry point e0 = "{value}" (swimcal.effects): ')
    for part in parts:
        assert part in str(caught.value)


def test_all_entry_points_that_are_wrong_are_reported_at_once(catalogue_with: Catalogue) -> None:
    with pytest.raises(InputError) as caught:
        catalogue_with("no_such_module:Mine", f"{__name__}:Mine", f"{__name__}:Empty", f"{__name__}:Mine")
    assert [line[:14] for line in str(caught.value).splitlines() if line.startswith("entry")] == [
        "entry point e0",
        "entry point e2",
        "entry point e3",
    ]


assert ROBOT.hinges  # loaded above: what an entry point that is no effect points at
