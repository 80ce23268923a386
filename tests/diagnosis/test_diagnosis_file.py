"""What a diagnosis keeps: the errors that a user compares are those of the twin that the fit exports."""

import pytest

from diagnosis.diagnosis_file import beside_exported_twin
from fitting.forecast import EVEN
from fitting.session_forecast import TWIN, Forecast, ForecastTrial, SessionForecast
from tests.reports.diagnoses import made_diagnosed

SPEED, TWIN_SPEED, TWIN_MM = 0.05, 0.056, 11.0


def made_forecasts(*names: str) -> SessionForecast:
    trial = ForecastTrial("holdout", 0.5, SPEED, {TWIN: Forecast(TWIN_SPEED, None, TWIN_MM)})
    return SessionForecast(EVEN, dict.fromkeys(names, trial))


@pytest.mark.parametrize("verdict", ["named", "no_gap"])
def test_the_errors_before_are_those_of_the_exported_twin(verdict: str) -> None:
    found = made_diagnosed(verdict)
    gap = beside_exported_twin(found, made_forecasts("slow")).gap
    assert gap.baseline_mm == pytest.approx(TWIN_MM)
    assert gap.speed_mae_before == pytest.approx(TWIN_SPEED - SPEED)
    assert gap.shrinkage == pytest.approx(found.gap.shrinkage, nan_ok=True)
    after = (gap.with_effects_mm, gap.speed_mae_after)
    of_effects = found.gap.with_effects_mm, found.gap.speed_mae_after
    assert after == pytest.approx(of_effects if verdict == "named" else (gap.baseline_mm, gap.speed_mae_before))


def test_without_a_forecast_of_every_trial_the_gap_stays_as_it_is() -> None:
    found = made_diagnosed("named")
    assert beside_exported_twin(found, made_forecasts("another")).gap == found.gap
