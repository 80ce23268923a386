"""Draws from the posterior, as many as are needed, and whether to believe them."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import emcee
import numpy as np
import xarray

from fitting.coefficient_fit import NAMES
from fitting.posterior.ensemble import sampler
from fitting.posterior.exploration import Exploration
from fitting.posterior.quiet_arviz import arviz
from session import Flag

R_HAT = 1.01
_CHUNK, _LONGEST = 1000, 40_000  # steps
_BURN_IN = 0.2
VARIABLES = (*NAMES, "ln_wave_discrepancy", "ln_speed_discrepancy")

Progress = Callable[[str, float | None], None]


@dataclass(frozen=True, eq=False)
class Draws:
    """Draws of an ensemble.

    Attributes:
        chains: (w, d, 7) walkers, draws, coefficients and ln discrepancies; the burn-in left out, thinned.
        ess_bulk, r_hat: (7,) effective draws and rank-normalised split R-hat (Vehtari et al. 2021), a walker a chain.
        acceptance: share of moves accepted.
        autocorrelation: steps, the longest of the seven.
        steps: of each walker.
        enough: whether effective draws and R-hat were reached.
        flags: why not.
    """

    chains: np.ndarray
    ess_bulk: np.ndarray
    r_hat: np.ndarray
    acceptance: float
    autocorrelation: float
    steps: int
    enough: bool
    flags: tuple[Flag, ...]

    @property
    def flat(self) -> np.ndarray:
        """(w d, 7)."""
        return self.chains.reshape(-1, self.chains.shape[-1])


def sample(
    found: Exploration,
    effective: int = 400,
    seed: int = 0,
    backend: Path | None = None,
    tell: Progress | None = None,
) -> Draws:
    """Samples until every coefficient has so many effective draws and an R-hat of 1.01 at most.

    Args:
        found: where the posterior lies.
        effective: draws wanted.
        seed: of the moves.
        backend: an HDF5 file that keeps every step; sampling goes on from what it holds.
        tell: of the progress.
    """
    store = None if backend is None else emcee.backends.HDFBackend(str(backend), name="posterior")
    ensemble = sampler(found.likelihood, store)
    resumed = store is not None and store.initialized and store.iteration > 0
    state = None if resumed else emcee.State(found.walkers, random_state=np.random.RandomState(seed).get_state())
    while True:
        done = ensemble.iteration if not resumed else store.iteration  # type: ignore[union-attr]
        if done:
            draws = _judged(ensemble, effective)
            if tell is not None:
                tell(_told(draws), min(float(draws.ess_bulk[:5].min()) / effective, 0.99))
            if draws.enough or done >= _LONGEST:
                return draws
        resumed = False
        ensemble.run_mcmc(state, _CHUNK, skip_initial_state_check=True)
        state = None


def _told(draws: Draws) -> str:
    return (
        f"sampling: {draws.ess_bulk[:5].min():.0f} effective draws, R-hat {draws.r_hat[:5].max():.3f}, acceptance "
        f"{draws.acceptance:.2f}, autocorrelation {draws.autocorrelation:.0f} steps"
    )


def _judged(ensemble: emcee.EnsembleSampler, effective: int) -> Draws:
    steps = ensemble.iteration
    longest = float(np.max(ensemble.get_autocorr_time(tol=0, discard=int(_BURN_IN * steps))))
    thin = max(int(longest / 4), 1)
    chains = ensemble.get_chain(discard=int(_BURN_IN * steps), thin=thin).transpose(1, 0, 2)  # (w, d, 7)
    data = xarray.Dataset({name: (("chain", "draw"), chains[..., i]) for i, name in enumerate(VARIABLES)})
    ess, r_hat = (np.array([float(told[name]) for name in VARIABLES]) for told in (arviz.ess(data), arviz.rhat(data)))
    enough = bool((ess[:5] >= effective).all() and (r_hat[:5] <= R_HAT).all())
    flags = () if enough else (_not_sampled(ess, r_hat, effective),)
    return Draws(chains, ess, r_hat, float(ensemble.acceptance_fraction.mean()), longest, steps, enough, flags)


def _not_sampled(ess: np.ndarray, r_hat: np.ndarray, effective: int) -> Flag:
    message = (
        f"sampled too little: {ess[:5].min():.0f} effective draws (wanted {effective}) and R-hat {r_hat[:5].max():.3f} "
        f"(wanted {R_HAT:g} at most) after the longest run; do not report these intervals"
    )
    return Flag("not_converged", message=message)
