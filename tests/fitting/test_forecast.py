"""What frozen coefficients say of a trial that they were not fitted to, and what is forecast from its command alone."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

from fitting.calibration import Calibration
from fitting.calibration_file import CommandForecast, beat_to_command, forecast_from_command
from fitting.forecast import set_off
from fitting.phase import _lowest as lowest
from fitting.phase import fit_phase, forecast, score
from fitting.published import Swims
from fitting.trial import MeasuredTrial
from swimsynth.session import Truth
from tests.reports.sample import made_calibration


def apart(one: float, other: float) -> float:
    """Angle between two phases, rad."""
    return abs(float(np.angle(np.exp(1j * (one - other)))))


@pytest.mark.parametrize("name", ["slow", "fast", "new"])
def test_the_phase_is_found(name: str, swims: Swims, trials: dict[str, MeasuredTrial], truth: Truth) -> None:
    found = fit_phase(swims.twin, trials[name], truth.plan.coefficients)

    assert apart(found, truth.trials[name].phase_rad) < 0.03


@pytest.mark.parametrize("share", [0.3, 0.7])
def test_the_phase_is_found_where_the_first_seconds_are_not_seen(
    share: float, swims: Swims, trials: dict[str, MeasuredTrial], truth: Truth
) -> None:
    trial = trials["new"].with_role("fit")
    unseen = trial.time_s < share * trial.time_s[-1]
    late = trial.seen_as(weight=np.where(unseen[:, None], 0.0, trial.own_weight))
    found = fit_phase(swims.twin, late, truth.plan.coefficients)

    assert apart(found, truth.trials["new"].phase_rad) < 0.1


def test_between_tries_the_phase_is_that_of_a_parabola() -> None:
    tries = np.array([0.0, 0.1, 0.2, 0.3])
    assert lowest(tries, 2.0 * (tries - 0.13) ** 2 + 1.0) == pytest.approx(0.13)
    assert lowest(tries, 2.0 * (tries - 0.29) ** 2) == pytest.approx(0.29)
    assert lowest(tries, tries) == 0.0
    assert lowest(tries, np.array([np.inf, 1.0, 2.0, np.inf])) == 0.1
    assert lowest(tries, np.full(4, np.inf)) == 0.0


def test_a_held_out_swim_is_foretold_by_the_true_coefficients(
    swims: Swims, trials: dict[str, MeasuredTrial], truth: Truth
) -> None:
    trial = trials["new"]
    phase = fit_phase(swims.twin, trial, truth.plan.coefficients)
    simulated = forecast(swims.twin, trial, truth.plan.coefficients, phase)

    assert simulated.position_m.shape == trial.head.position_m.shape
    assert score(trial, simulated).marker_error_m < 5e-3


HELD_OUT, SPEED_PER_HZ = "slow", 0.1
"""The only trial held out there, and the twin's sweep."""


def commanded(slow: float | None, medium: float | None = None, fast: float | None = None) -> Calibration:
    """Trials at 0.5 (held out), 0.8 and 1.3 Hz whose commands are these, Hz; the sweep is from 0.4 to 1.5 Hz."""
    made, commands = made_calibration(), {"slow": slow, "medium": medium, "fast": fast}
    return replace(
        made,
        trials=tuple(
            replace(trial, measured=replace(trial.measured, commanded_hz=commands[trial.measured.name]))
            for trial in made.trials
        ),
    )


def of_command(calibration: Calibration) -> CommandForecast:
    (name,) = (found := forecast_from_command(calibration))
    assert name == HELD_OUT
    return found[name]


def test_the_beat_is_the_command_times_the_mean_ratio() -> None:
    calibration = commanded(1.0, 0.8 / 0.7, 1.3 / 0.8)
    found = of_command(calibration)

    assert beat_to_command(calibration) == pytest.approx(0.75)
    assert found.frequency_hz == pytest.approx(0.75)
    assert found.speeds["twin"] == pytest.approx(SPEED_PER_HZ * 0.75)
    assert found.speeds["published, twin's tail"] == pytest.approx(0.12 * 0.75)
    assert found.flags == ()
    assert beat_to_command(commanded(1.0, None, 2.0)) == pytest.approx(0.65)


def test_nothing_measured_in_the_trial_enters() -> None:
    calibration = commanded(1.0, 1.0, 1.5)
    slow, *fitted = calibration.trials
    lost = replace(slow.measured.seen_as(weight=0 * slow.measured.weight), frequency=fitted[0].measured.frequency)
    blind = replace(calibration, trials=(replace(slow, measured=lost, simulated_hz=np.nan, speeds={}), *fitted))

    assert of_command(blind) == of_command(calibration)


@pytest.mark.parametrize(
    ("calibration", "whose"),
    [(commanded(None, 1.0, 1.5), "its command"), (commanded(1.0), "the command of every fit trial")],
    ids=["trial", "fit trials"],
)
def test_without_a_command_there_is_no_forecast_and_that_is_reported(calibration: Calibration, whose: str) -> None:
    found = of_command(calibration)

    assert np.isnan([found.frequency_hz, *found.speeds.values()]).all()
    assert [flag.kind for flag in found.flags] == ["no_command"]
    assert found.flags[0].message.startswith(f"{whose} is not known")


def test_beyond_the_sweep_there_is_no_forecast_and_that_is_reported() -> None:
    found = of_command(commanded(3.0, 1.0, 1.3 / 0.8))

    assert found.frequency_hz == pytest.approx(2.4)
    assert np.isnan(list(found.speeds.values())).all()
    assert [flag.kind for flag in found.flags] == ["extrapolated"]
    assert "2.400 Hz, forecast from the command, is outside the 0.400 to 1.500 Hz" in found.flags[0].message


@dataclass(frozen=True)
class TwoWays:
    """A twin that swims forward if its crank begins beyond an angle, and diverges if it begins below another."""

    trial: SimpleNamespace
    from_rad: float
    phase_rad: float = 1.0
    stands_from_rad: float = 0.0

    def simulated(self, coefficients: np.ndarray) -> np.ndarray:
        if self.phase_rad < self.stands_from_rad:
            return np.full((len(coefficients), 5), np.nan)
        return np.full((len(coefficients), 5), 0.1 if self.phase_rad >= self.from_rad else -0.1)


@pytest.mark.parametrize(
    ("from_rad", "forward", "later"), [(0.0, True, False), (2.0, True, True), (2.0, False, False), (9.0, True, False)]
)
def test_of_two_steady_swims_the_forecast_takes_that_of_the_trial(from_rad: float, forward: bool, later: bool) -> None:
    mode = SimpleNamespace(coefficients=np.ones(5))
    trial = SimpleNamespace(start_velocity=np.array([-0.1 if forward else 0.1, 0.0, 0.0]))
    window = set_off(mode, TwoWays(trial, from_rad))  # type: ignore[arg-type]
    assert (window.phase_rad > 1.0) == later


def test_a_twin_that_diverges_at_one_angle_starts_from_the_other() -> None:
    mode, trial = SimpleNamespace(coefficients=np.ones(5)), SimpleNamespace(start_velocity=np.array([-0.1, 0.0, 0.0]))
    for from_rad in (0.0, 9.0):  # swimming forward or not
        window = set_off(mode, TwoWays(trial, from_rad, stands_from_rad=2.0))  # type: ignore[arg-type]
        assert window.phase_rad > 2.0
    assert set_off(mode, TwoWays(trial, 9.0, stands_from_rad=9.0)).phase_rad == 1.0  # type: ignore[arg-type]
