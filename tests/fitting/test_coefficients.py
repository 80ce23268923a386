"""A fit of the coefficients is honest about what is doubtful."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fitting.coefficient_fit import Restart, flags_of
from swimmer import FluidCoefficients


def restart(coefficients: tuple[float, ...], objective_m: float = 0.01, **changes: bool) -> Restart:
    values = np.array(coefficients)
    made = Restart(values, values, np.zeros(1), objective_m, np.array([objective_m]), converged=True)
    return replace(made, **changes)  # type: ignore[arg-type]


GOOD = (0.4, 2.0, 6.0, 4.0, 1.0)


def kinds(*restarts: Restart) -> list[str]:
    return [flag.kind for flag in flags_of(list(restarts))]


@pytest.mark.parametrize(("place", "value", "bound"), [(0, 0.0, "0"), (2, 9.995, "10"), (4, 10.0, "10")])
def test_a_coefficient_at_its_bound_is_flagged_by_name(place: int, value: float, bound: str) -> None:
    values = list(GOOD)
    values[place] = value
    (flag,) = flags_of([restart(tuple(values))])

    assert flag.kind == "at_bound"
    assert flag.message.startswith(FluidCoefficients._fields[place])
    assert f"at its bound {bound}:" in flag.message


def test_what_is_wrong_with_the_best_alone_is_flagged() -> None:
    assert kinds(restart(GOOD), restart(GOOD, 0.02)) == []
    assert kinds(restart(GOOD, converged=False), restart(GOOD, 0.02)) == ["not_converged"]
    assert kinds(restart(GOOD), restart(GOOD, 0.02, converged=False)) == []
    assert kinds(restart(GOOD, swims_forward=False)) == ["swims_backward"]


def test_equally_good_restarts_are_flagged_with_what_differs() -> None:
    other = (0.4, 2.2, 7.5, 4.0, 1.0)
    (flag,) = flags_of([restart(GOOD), restart(other, 0.01005), restart((9.0, 9.0, 9.0, 9.0, 9.0), 0.02)])

    assert flag.kind == "restarts_disagree"
    assert "2 restarts" in flag.message
    assert "angular_drag (by 1.5)" in flag.message
    assert "slender_drag" not in flag.message


def test_a_closer_twin_that_swims_backward_is_rejected_aloud() -> None:
    backward = restart((0.0, 3.5, 9.0, 1.1, 0.1), 0.008, swims_forward=False)
    (flag,) = flags_of([restart(GOOD), backward])

    assert flag.kind == "rejected_restart"
    assert "20 % closer" in flag.message
