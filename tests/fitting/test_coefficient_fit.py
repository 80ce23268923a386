"""A fit of the coefficients is honest about what is doubtful, and the order of trials does not matter."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import norm, truncnorm

from fitting import descent, search
from fitting.coefficient_fit import Marginal, TimeStepError, _flags, fit_coefficients
from fitting.features import SPEED
from fitting.forecast import NORMAL_90
from fitting.mode import SearchEnd
from swimcal.create_session import FISHSIM_MARKERS
from swimcal.mjcf import FluidCoefficients
from swimcal.robot import RobotSpec
from swimcal.twin import Twin
from tests.cases import later
from tests.fitting.exact_swims import ROBOT, exact_swims, exact_twin

GOOD = np.array([0.4, 2.0, 6.0, 4.0, 1.0])
NARROW = 0.05


def end(
    coefficients: np.ndarray = GOOD, log_density: float = 0.0, *, converged: bool = True, forward: bool = True
) -> SearchEnd:
    return SearchEnd(coefficients, coefficients, log_density, converged, forward)


def kinds(*ends: SearchEnd, disagree: tuple[SearchEnd, ...] = (), width: float = NARROW) -> list[str]:
    return [flag.kind for flag in flags(*ends, disagree=disagree, width=width)]


def flags(*ends: SearchEnd, disagree: tuple[SearchEnd, ...] = (), width: float = NARROW) -> tuple:
    found = ends[0].coefficients
    likeliest = SimpleNamespace(ends=ends, coefficients=found, disagree=disagree)
    interval = np.clip(np.column_stack([found * (1 - width), found * (1 + width)]), 0, 10)
    return _flags(likeliest, interval)  # type: ignore[arg-type]


@pytest.mark.parametrize(("place", "value", "bound"), [(3, 0.0, "0"), (2, 9.995, "10"), (4, 10.0, "10")])
def test_a_coefficient_at_its_bound_is_flagged_by_name(place: int, value: float, bound: str) -> None:
    values = GOOD.copy()
    values[place] = value
    (flag,) = flags(end(values))

    assert flag.kind == "at_bound"
    assert flag.message.startswith(FluidCoefficients._fields[place])
    assert f"at its bound {bound}:" in flag.message


@pytest.mark.parametrize("place", [0, 1, 2])
def test_a_drag_of_0_is_a_force_that_the_trials_do_not_show(place: int) -> None:
    values = GOOD.copy()
    values[place] = 1e-4
    (flag,) = flags(end(values))

    assert flag.kind == "at_bound"
    assert flag.message.startswith(FluidCoefficients._fields[place])
    assert "at its physical limit 0: the trials show no such drag, and none is below 0" in flag.message
    assert "beyond" not in flag.message


def test_what_is_wrong_with_the_best_alone_is_flagged() -> None:
    assert kinds(end(), end(log_density=-5.0)) == []
    assert kinds(end(converged=False), end(log_density=-5.0)) == ["not_converged"]
    assert kinds(end(), end(log_density=-5.0, converged=False)) == []
    assert kinds(end(forward=False)) == ["swims_backward"]
    assert kinds(end(), end(log_density=3.0, forward=False)) == ["rejected_restart"]
    assert kinds(end()._replace(refused=True)) == ["rejected_restart"]
    assert kinds(end(), disagree=(end(2 * GOOD),)) == ["restarts_disagree"]


def test_coefficients_with_wide_intervals_are_not_determined() -> None:
    assert kinds(end(), width=0.6) == ["unidentifiable"] * 4  # but the smallest, whose interval is less than 0.5 wide


@pytest.mark.long
def test_the_order_of_trials_does_not_change_a_bit(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (search, descent):
        monkeypatch.setattr(module, "ROUNDS", 2)  # each begins where the last one ended
    trials = exact_swims(hz=(0.7, 1.2), seconds=4.5, noise_m=5e-4)
    one, other = (fit_coefficients(each, exact_twin(), (), starts=1)[0] for each in (trials, trials[::-1]))

    assert one.coefficients == other.coefficients
    np.testing.assert_array_equal(one.interval, other.interval)


@pytest.mark.parametrize("beyond_sd", [-1.0, 0.0, 1.0, 1.5, 2.5, 4.0])
@pytest.mark.parametrize("sd", [0.5, 1.5])
def test_an_interval_that_a_bound_shortens_says_so(beyond_sd: float, sd: float) -> None:
    """Of a normal distribution with its mean so many standard deviations below the bound."""
    mean, bound = 10.0 - beyond_sd * sd, 10.0
    share = norm.cdf(beyond_sd)
    low, high = mean + sd * norm.ppf(share * np.array([0.05, 0.95]))
    spread = sd * truncnorm.std(-np.inf, beyond_sd)
    found = Marginal(mean=mean, sd=spread, q05=low, q95=high, ess_bulk=1e3, r_hat=1.0, determined=True)
    shortened = (mean + NORMAL_90 * sd - high) / (high - low) > 0.1
    assert (found.at_bounds == (bound,)) == shortened


@pytest.mark.parametrize(
    ("lacks", "told", "step_s"),
    [(-0.012, "12 % too fast in b", 0.0011), (0.02, "20 % too slow in b", 0.00064), (0.004, "", None)],
)
def test_a_time_step_that_changes_the_speed_is_flagged(lacks: float, told: str, step_s: float | None) -> None:
    """The speed is the twin's: the fish of trial b stays where it is, and the twin of trial c does."""

    def block(name: str, time_step: float, measured: float) -> SimpleNamespace:
        trial = SimpleNamespace(trial=SimpleNamespace(name=name), twin=exact_twin())
        return SimpleNamespace(model=trial, time_step=np.array([time_step]), features=np.array([measured]))

    blocks, twin = (block("a", 0.001, 0.1), block("b", lacks, 1e-4), block("c", 0.0003, 0.1)), (0.1, 0.1, 1e-5)
    mode = SimpleNamespace(
        blocks=blocks,
        model=SimpleNamespace(trials=[each.model for each in blocks]),
        simulated=lambda number: np.array([twin[number]]),
    )
    found = TimeStepError.of(mode).flags  # type: ignore[arg-type]
    assert [flag.kind for flag in found] == (["time_step"] if told else [])
    assert all(told in flag.message and f"time_step_s = {step_s:g} " in flag.message for flag in found)


SLOW = FluidCoefficients(8.0, 0.9, 3.5, 5.0, 8.4)  # with the usual step this twin is some 15 % too fast


@pytest.mark.parametrize("named", [False, *later(True)])
def test_a_twin_whose_step_changes_its_speed_is_fitted_with_a_finer_one_unless_the_robot_names_its_own(
    named: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(search, "_SCREENED", 32)
    monkeypatch.setattr(search, "_HOPS", 0)
    trials = exact_swims(SLOW, hz=(1.34,), seconds=3.0, robot=ROBOT.with_time_step(0.0005))
    robot = RobotSpec.model_validate(ROBOT.model_dump()) if named else ROBOT
    fit, mode = fit_coefficients(trials, Twin(robot, FISHSIM_MARKERS), (), starts=1)

    assert robot.names_time_step == named
    assert [flag.kind for flag in fit.flags if flag.kind == "time_step"] == ["time_step"] * named
    if named:
        assert fit.time_step_s == ROBOT.time_step_s
        return
    assert fit.time_step_s <= ROBOT.time_step_s / 3
    assert mode.model.trials[0].twin.robot.time_step_s == fit.time_step_s
    swum = mode.model.trials[0].simulated(np.array([fit.coefficients]))[0, SPEED]
    assert swum == pytest.approx(trials[0].speed, rel=0.01)
    assert np.array(fit.coefficients[:3]) == pytest.approx(SLOW[:3], rel=0.1)
