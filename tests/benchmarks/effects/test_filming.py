"""Work on several sessions sees what it would see alone, in fewer simulations."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.effects import filming
from benchmarks.effects.filming import Filming, film_together
from benchmarks.reality import Mechanism, Recording, Trial, World, simulate
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.errors import SimulationDiverged

WORLD = World(coefficients=(0.5, 2.0, 6.0, 4.0, 1.0))
SWIM = Trial("swim", 0.2, 1.0, run_in_s=0.1, start_speed_m_s=0.1)
FASTER = replace(SWIM, frequency_hz=1.3)
BLOWN_UP = replace(SWIM, frequency_hz=1e4)


class Early(Mechanism):
    """Frames exposed before reality begins."""

    def expose(self, time_s: np.ndarray) -> np.ndarray:
        return time_s - 100.0


def seen(*rounds: Sequence[tuple[World, Trial]]) -> Filming[list[Recording] | str]:
    """Work that wants to see trials round by round, and ends with the last ones or with what went wrong."""
    recordings: list[Recording] = []
    try:
        for wanted in rounds:
            recordings = yield wanted
    except (SimulationDiverged, ValueError) as error:
        return str(error)
    return recordings


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How many trials each simulation held."""
    counts: list[int] = []
    true = filming.simulate

    def counted(trials: Sequence[tuple[World, Trial]], *arguments: object, **named: object) -> list[Recording]:
        counts.append(len(trials))
        return true(trials, *arguments, **named)  # type: ignore[arg-type]

    monkeypatch.setattr(filming, "simulate", counted)
    return counts


@pytest.mark.long
def test_each_sees_its_own_and_all_are_simulated_at_once(asked: list[int]) -> None:
    both = film_together([seen([(WORLD, SWIM)], [(WORLD, FASTER), (WORLD, SWIM)]), seen([(WORLD, FASTER)])])
    assert asked == [2, 2]  # the second ended after the first round
    alone = simulate([(WORLD, FASTER), (WORLD, SWIM)], FISHSIM_MARKERS)
    for own, expected in zip((*both[0], both[1][0]), (*alone, alone[0]), strict=True):
        assert isinstance(own, Recording)
        assert own.trial == expected.trial
        assert np.abs(own.position_px - expected.position_px).max() < 1e-7


@pytest.mark.long
def test_where_one_ends_the_next_begins(asked: list[int]) -> None:
    """And not before: works are begun as there is room for them, and reported in their order."""
    begun: list[int] = []

    def work(number: int, rounds: int) -> Filming[int]:
        begun.append(number)
        for _ in range(rounds):
            yield [(WORLD, SWIM)]
        return number

    def works() -> Iterator[Filming[int]]:
        for number, rounds in enumerate((3, 1, 0, 1)):
            asked.append(-number)
            yield work(number, rounds)

    assert film_together(works(), at_once=2) == [0, 1, 2, 3]
    assert asked == [0, -1, 2, -2, -3, 2, 1]
    assert begun == [0, 1, 2, 3]


def test_what_diverges_is_raised_in_the_work_that_asked_for_it() -> None:
    well, ill = film_together([seen([(WORLD, SWIM)]), seen([(WORLD, SWIM), (WORLD, BLOWN_UP)])])
    assert "1 of 2 reference simulations diverged; the first a swim at 10000 Hz" in ill
    assert isinstance(well[0], Recording)


def test_what_is_impossible_is_raised_in_the_work_that_asked_for_it() -> None:
    early = replace(WORLD, mechanisms=(Early(),))
    well, ill = film_together([seen([(WORLD, SWIM)]), seen([(early, SWIM)])])
    assert "found a frame exposed at" in ill
    assert isinstance(well[0], Recording)


def test_an_error_of_the_work_itself_is_its_own() -> None:
    def broken() -> Filming[None]:
        yield [(WORLD, SWIM)]
        raise ArithmeticError("of the work")

    with pytest.raises(ArithmeticError, match="of the work"):
        film_together([broken()])
    assert film_together([]) == []
