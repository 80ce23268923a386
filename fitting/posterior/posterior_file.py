"""Draws of a posterior as ``results/posterior.nc`` (ArviZ)."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import xarray

from fitting.model.features import HARMONICS, OF_A_MARKER, SPEED
from fitting.objective import COEFFICIENT_BOUNDS
from fitting.posterior.likelihood import LEAST_DISCREPANCY, MOST_SPEED, MOST_WAVE
from fitting.posterior.posterior import Posterior
from fitting.posterior.quiet_arviz import arviz
from fitting.posterior.sampling import VARIABLES

PRIOR = (
    f"uniform from {COEFFICIENT_BOUNDS[0]:g} to {COEFFICIENT_BOUNDS[1]:g} in each coefficient, uniform in the "
    f"logarithms of the twin's relative discrepancies, {LEAST_DISCREPANCY:g} to {MOST_WAVE:g} of the wave and to "
    f"{MOST_SPEED:g} of the speed; normal in the nuisances, the robot's hinges and crank arm among them, "
    "which are integrated out"
)
_TERMS = ("mean", *(f"{wave}_{h}" for h in range(1, HARMONICS + 1) for wave in ("cos", "sin")))


def save_draws(path: Path, posterior: Posterior, stamp: Mapping[str, str | int]) -> None:
    """Writes an ArviZ `InferenceData` as netCDF, with the groups posterior, sample_stats and observed_data.

    A walker of the ensemble is a chain. The logarithms of the relative discrepancies are variables as well.

    Args:
        path: to write, at once; give a temporary one.
        posterior: with its draws.
        stamp: what it was made with, by name.
    """
    data = arviz.InferenceData(
        attrs={**stamp, "prior": PRIOR},
        posterior=_draws(posterior.draws.chains),
        sample_stats=_statistics(posterior),
        observed_data=_gaits(posterior),
    )
    data.to_netcdf(str(path), engine="h5netcdf")


def load_chains(path: Path) -> np.ndarray:
    """(w, d, 7) walkers, draws, coefficients and ln discrepancies that `save_draws` wrote."""
    with xarray.open_dataset(path, group="posterior", engine="h5netcdf") as draws:
        return np.stack([draws[name].to_numpy() for name in VARIABLES], axis=-1)


def _draws(chains: np.ndarray) -> xarray.Dataset:
    places = {"chain": np.arange(chains.shape[0]), "draw": np.arange(chains.shape[1])}
    return xarray.Dataset({name: (("chain", "draw"), chains[..., i]) for i, name in enumerate(VARIABLES)}, places)


def _statistics(posterior: Posterior) -> xarray.Dataset:
    draws, found = posterior.draws, posterior.found
    scalars: dict[str, float | int] = {
        "acceptance_rate": draws.acceptance,
        "autocorrelation_steps": draws.autocorrelation,
        "steps": draws.steps,
        "simulations_of_each_trial": found.simulations,
        "box_sd_m": found.off.box_m,
        "marker_sd_m": found.off.marker_m,
        "emulator_error_ln_likelihood": found.emulator_error,
        "misfit_p": posterior.misfit_p,
    }
    arrays = {"ess_bulk": ("variable", draws.ess_bulk), "r_hat": ("variable", draws.r_hat)}
    return xarray.Dataset({**scalars, **arrays}, {"variable": list(VARIABLES)})


def _gaits(posterior: Posterior) -> xarray.Dataset:
    """Forward speed, and mean and harmonics of each marker along and across the fish, of each trial."""
    models = posterior.model.trials
    gaits = np.array([model.measured for model in models])
    beats = np.delete(gaits, SPEED, axis=1).reshape(len(gaits), -1, 2, OF_A_MARKER)
    return xarray.Dataset(
        {
            "forward_speed_m_s": ("trial", gaits[:, SPEED]),
            "beat_m": (("trial", "marker", "axis", "term"), beats),
            "frequency_hz": ("trial", np.array([model.trial.frequency.hz for model in models])),
            "noise_lasts_s": ("trial", np.array([model.noise.lasts_s for model in models])),
            "noise_sd_m": (("trial", "marker"), np.array([model.noise.sd_m for model in models])),
        },
        {
            "trial": [model.trial.name for model in models],
            "marker": list(models[0].trial.markers),
            "axis": ["along", "across"],
            "term": list(_TERMS),
        },
    )
