"""Draws of a posterior as ``results/posterior.nc`` (ArviZ)."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import xarray

from fitting.model.features import HARMONICS, SPEED, of_markers
from fitting.objective import COEFFICIENT_BOUNDS
from fitting.posterior.posterior import Posterior
from fitting.posterior.quiet_arviz import arviz
from fitting.posterior.sampling import VARIABLES

PRIOR = (
    f"uniform from {COEFFICIENT_BOUNDS[0]:g} to {COEFFICIENT_BOUNDS[1]:g} in each coefficient, lognormal in the "
    "twin's relative discrepancies of wave and speed; normal in the nuisances, the robot's hinges and crank arm among "
    "them, which are integrated out; other variance components as at the mode"
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
        observed_data=_features(posterior),
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
    draws, surrogate = posterior.draws, posterior.surrogate
    scalars: dict[str, float | int] = {
        "acceptance_rate": draws.acceptance,
        "autocorrelation_steps": draws.autocorrelation,
        "steps": draws.steps,
        "simulations_of_each_trial": surrogate.simulations,
        **{f"{name}_sd": size for name, size in posterior.mode.sizes.items()},
        "emulator_error_ln_likelihood": surrogate.error,
        "misfit_p": posterior.misfit_p,
    }
    arrays = {"ess_bulk": ("variable", draws.ess_bulk), "r_hat": ("variable", draws.r_hat)}
    return xarray.Dataset({**scalars, **arrays}, {"variable": list(VARIABLES)})


def _features(posterior: Posterior) -> xarray.Dataset:
    """Forward speed, and mean and harmonics of each marker along and across the fish, of each trial."""
    models = posterior.mode.model.trials
    features = np.array([model.measured for model in models])
    return xarray.Dataset(
        {
            "forward_speed_m_s": ("trial", features[:, SPEED]),
            "beat_m": (("trial", "marker", "axis", "term"), of_markers(features)),
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
