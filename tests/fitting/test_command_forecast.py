"""What is foretold of a trial from its command alone: exact where beats keep a ratio to commands, and flagged else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fitting import Calibration, CommandForecast, beat_to_command, forecast_from_command
from tests.reports.sample import made_calibration

HELD_OUT, SPEED_PER_HZ = "slow", 0.1
"""The only trial held out there, and the twin's sweep."""


def commanded(slow: float | None, medium: float | None = None, fast: float | None = None) -> Calibration:
    """Trials at 0.5 (held out), 0.8 and 1.3 Hz whose commands are these, Hz; the sweep is from 0.4 to 1.5 Hz."""
    made, told = made_calibration(), {"slow": slow, "medium": medium, "fast": fast}
    return replace(
        made,
        trials=tuple(
            replace(trial, measured=replace(trial.measured, commanded_hz=told[trial.measured.name]))
            for trial in made.trials
        ),
    )


def forecast(calibration: Calibration) -> CommandForecast:
    (name,) = (found := forecast_from_command(calibration))
    assert name == HELD_OUT
    return found[name]


def test_the_beat_is_the_command_times_the_mean_ratio() -> None:
    calibration = commanded(1.0, 0.8 / 0.7, 1.3 / 0.8)
    found = forecast(calibration)

    assert beat_to_command(calibration) == pytest.approx(0.75)
    assert found.frequency_hz == pytest.approx(0.75)
    assert found.speeds["twin"] == pytest.approx(SPEED_PER_HZ * 0.75)
    assert found.speeds["published, twin's tail"] == pytest.approx(0.12 * 0.75)
    assert found.flags == ()
    assert beat_to_command(commanded(1.0, None, 2.0)) == pytest.approx(0.65)


def test_nothing_measured_in_the_trial_enters() -> None:
    calibration = commanded(1.0, 1.0, 1.5)
    slow, *fitted = calibration.trials
    lost = replace(slow.measured, weight=0 * slow.measured.weight, frequency=fitted[0].measured.frequency)
    blind = replace(calibration, trials=(replace(slow, measured=lost, simulated_hz=np.nan, speeds={}), *fitted))

    assert forecast(blind) == forecast(calibration)


@pytest.mark.parametrize(
    ("calibration", "whose"),
    [(commanded(None, 1.0, 1.5), "its command"), (commanded(1.0), "the command of every fit trial")],
    ids=["trial", "fit trials"],
)
def test_without_a_command_there_is_no_forecast_and_that_is_said(calibration: Calibration, whose: str) -> None:
    found = forecast(calibration)

    assert np.isnan([found.frequency_hz, *found.speeds.values()]).all()
    assert [flag.kind for flag in found.flags] == ["no_command"]
    assert found.flags[0].message.startswith(f"{whose} is not known")


def test_beyond_the_sweep_there_is_no_forecast_and_that_is_said() -> None:
    found = forecast(commanded(3.0, 1.0, 1.3 / 0.8))

    assert found.frequency_hz == pytest.approx(2.4)
    assert np.isnan(list(found.speeds.values())).all()
    assert [flag.kind for flag in found.flags] == ["extrapolated"]
    assert "2.400 Hz, foretold from the command, lies outside the 0.400 to 1.500 Hz" in found.flags[0].message


def test_where_the_twin_diverged_beside_it_there_is_no_speed() -> None:
    calibration = commanded(0.75, 0.8, 1.3)
    speed = np.where(calibration.sweep.frequency_hz > 0.7, np.nan, calibration.sweep.speed_twin)

    found = forecast(replace(calibration, sweep=replace(calibration.sweep, speed_twin=speed)))
    assert np.isnan(found.speeds["twin"])
    assert found.speeds["large, twin's tail"] == pytest.approx(0.115 * 0.75)
