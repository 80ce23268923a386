"""A posterior made by hand: four coefficients that are known, one that is not."""

from typing import Any

import numpy as np

from fitting.coefficient_fit import Marginal
from fitting.forecast import Scatter
from fitting.posterior.posterior import Identifiability, RobotPart
from fitting.posterior.prediction import PredictedSweep, PredictedTrial
from fitting.posterior.summary import PosteriorSummary
from fitting.posterior.whiteness import Whiteness
from fitting.session_forecast import Forecast, ForecastTrial, SessionForecast
from swimcal.flags import Flag
from swimcal.mjcf import FluidCoefficients
from tests.reports.sample import BEST, MARKERS, ROLES

SPREAD = np.array([0.02, 0.3, 0.2, 0.1, 2.0])
_STEPS = np.array([-0.02, -0.008, 0.0, 0.008, 0.02])[:, None]  # relative steps of quantiles


def made_summary(**changes: Any) -> PosteriorSummary:
    """Draws about the fit; Magnus lift spreads over half its range."""
    random = np.random.default_rng(0)
    middle = np.array(BEST._replace(magnus_lift=3.0))
    draws = np.clip(middle + SPREAD * random.standard_normal((16, 60, 5)), 0.0, 10.0)
    low, high = np.quantile(draws.reshape(-1, 5), [0.05, 0.95], axis=0)
    marginals = {
        name: Marginal(
            float(middle[i]), float(SPREAD[i]), float(low[i]), float(high[i]), 500.0 + i, 1.002, i not in (1, 4)
        )
        for i, name in enumerate(FluidCoefficients._fields)
    }
    values: dict[str, Any] = {
        "marginals": marginals,
        "chains": np.concatenate([draws, -4 + 0.1 * random.standard_normal((16, 60, 2))], axis=-1),
        "ess_bulk": np.append(500.0 + np.arange(5), [450.0, 460.0]),
        "r_hat": np.full(7, 1.002),
        "acceptance": 0.31,
        "autocorrelation": 42.0,
        "steps": 4000,
        "simulations": 640,
        "emulator_error": 0.21,
        "misfit_p": 0.4,
        "discrepancy": np.array([0.012, 0.008]),
        "robot": (
            RobotPart("hinge_stiffness", True, 0.012, 0.003, 0.011),
            RobotPart("hinge_damping", True, 0.05, 0.0, 0.05),
            RobotPart("crank_arm", False, 0.02, -0.021, 0.008),
        ),
        "identifiability": made_identifiability(),
        "sweep": PredictedSweep(
            hz := np.array([0.5, 0.9, 1.4]),
            0.1 * hz * (1 + _STEPS),
            0.1 * hz * (1 + 2 * _STEPS),
            np.outer([0.5, 0.8, 0.7], SPREAD),
            SPREAD,
        ),
        "trials": tuple(map(_trial, ROLES)),
        "forecasts": _forecasts(),
        "whiteness": tuple(_whiteness(name) for name in ROLES if ROLES[name][0] == "fit"),
        "flags": (
            Flag("markers_off", message="markers sit some 7 mm from where the robot's description has them"),
            Flag("unidentifiable", message="magnus_lift is not determined: 90 % interval 0.1 to 6"),
        ),
    }
    return PosteriorSummary(**values | changes)


def made_identifiability() -> Identifiability:
    return Identifiability(
        determined=np.array([True, False, True, True, False]),
        at_bound=np.array([False, True, False, False, False]),
        narrowed=SPREAD / 2.887,
        correlation=np.eye(5) + 0.3 * (1 - np.eye(5)),
        directions=np.eye(5),
        direction_narrowed=SPREAD / 2.887,
    )


def _trial(name: str) -> PredictedTrial:
    """The slow trial swims faster than predicted."""
    role, hz = ROLES[name]
    speed, swing = 0.1 * hz, np.linspace(0.01, 0.06, len(MARKERS))
    return PredictedTrial(
        name=name,
        role=role,
        speed=speed * (1.1 if name == "slow" else 1.0),
        inner=speed * (1 + _STEPS[:, 0]),
        outer=speed * (1 + 2 * _STEPS[:, 0]),
        place_m=np.linspace(0.0, 0.55, len(MARKERS)),
        swing_m=swing,
        swing_inner=swing * (1 + _STEPS),
        swing_outer=swing * (1 + 2 * _STEPS),
        forecast=Forecast(speed, (0.9 * speed, 1.1 * speed), 3.0, 2.0, 0.875),
    )


def _forecasts() -> SessionForecast:
    """The line is off by 5 mm/s; the draws are by less."""
    found = {}
    for name, (role, hz) in ROLES.items():
        drawn = _trial(name)
        line = {"line": Forecast(drawn.speed + 0.005)} if role == "holdout" else {}
        found[name] = ForecastTrial(role, hz, drawn.speed, {"posterior": drawn.forecast, **line})
    return SessionForecast(Scatter(), found)


def _whiteness(name: str) -> Whiteness:
    lag_s = np.arange(1, 11) / 30
    lasting = np.exp(-lag_s / 0.1)
    left = np.where(np.arange(10) % 2, 0.01, -0.01)
    beside = np.full((2, len(MARKERS) - 1), 0.5), np.full((2, len(MARKERS) - 1), 0.04), np.array([0.07, 0.2])
    sd_m = np.full(len(MARKERS), 0.0008)
    return Whiteness(name, lag_s, lasting, left, 0.03, *beside, 150, 21.0, 0.1, 0.1, sd_m)
