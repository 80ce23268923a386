"""Whether the trials of a posterior ask for an effect that its twin leaves out: a score test of each (Rao 1948)."""

from collections.abc import Callable, Iterable

import numpy as np
from scipy.stats import norm

from fitting.posterior.left_out import LeftOut
from fitting.posterior.posterior import Posterior
from fitting.signatures.separation import Whitened
from fitting.signatures.session_row import PRIOR_SD
from fitting.signatures.signature import Signature, signature_of
from fitting.signatures.view_of import with_picture
from session import CameraSpec
from swimmer.effects import Effect

_STEP_SD = 0.5  # of the posterior, either way, for the slopes of its emulator
_ONE_SD = (-1.0, 1.0)
_UNSEEN = 1e-6  # whitened length below which an effect does nothing that coefficients do not


def score_tests(
    posterior: Posterior,
    camera: CameraSpec,
    effects: Iterable[Effect],
    tell: Callable[[str, float | None], None] = lambda _message, _share: None,
) -> tuple[LeftOut, ...]:
    """What each parameter of each effect says, the likeliest first; linear about the posterior median.

    Args:
        posterior: with its draws.
        camera: that filmed the trials.
        effects: of the catalogue.
        tell: of the progress.
    """
    trials = [each.trial for each in posterior.model.trials]
    camera, effects = with_picture(camera, trials), tuple(effects)
    at, sd = np.median(posterior.coefficients, axis=0), posterior.coefficients.std(axis=0, ddof=1)
    space = _space(posterior, at, sd)
    left = space.freed(posterior.model.measured - posterior.found.likelihood.emulator(at[None])[0])
    found = []
    for number, effect in enumerate(effects):
        tell(f"whether {effect.name.replace('_', ' ')} is missing", number / len(effects))
        signature = signature_of(effect, posterior.model, camera, at, sizes=_ONE_SD)
        found += [_asked(signature, row, space, left, sd) for row in _telling(signature, space)]
    ways = [each._replace(chance=min(1.0, len(found) * each.chance)) for each in found]
    return tuple(sorted(_stronger(ways), key=lambda each: -each.z))


def _space(posterior: Posterior, at: np.ndarray, sd: np.ndarray) -> Whitened:
    """In which the posterior's noise, nuisances and error of the twin have unit size and coefficients are free."""
    likelihood, steps = posterior.found.likelihood, _STEP_SD * np.diag(sd)
    covariance = likelihood.covariance(np.median(posterior.discrepancy, axis=0))
    slopes = (likelihood.emulator(at + steps) - likelihood.emulator(at - steps)) / (2 * np.diag(steps))[:, None]
    return Whitened.of(covariance, slopes.T, PRIOR_SD)


def _telling(signature: Signature, space: Whitened) -> list[int]:
    """Rows that show, and of which no twin diverged."""
    finite = np.flatnonzero(np.isfinite(signature.gaits).all(axis=1))
    return [int(row) for row in finite if space.length(signature.gaits[row]) > _UNSEEN]


def _asked(signature: Signature, row: int, space: Whitened, left: np.ndarray, sd: np.ndarray) -> LeftOut:
    """One parameter, one way; its `chance` is that of this way alone."""
    number = int(np.argmax(np.abs(signature.values[row])))
    parameter, size = signature.effect.parameters[number], signature.values[row, number]
    moved = signature.gaits[row] * parameter.sd / abs(size)  # as one standard deviation this way would
    shows = space.freed(moved)
    length = float(np.linalg.norm(shows))
    z = float(shows @ left) / length
    return LeftOut(
        effect=signature.effect.name,
        parameter=parameter.name,
        alone=len(signature.effect.parameters) == 1,
        unit=parameter.unit,
        prior_sd=parameter.sd,
        value=float(np.sign(size) * parameter.sd * z / length),
        z=z,
        chance=float(norm.sf(z)),
        shows=length,
        moves=np.sign(size) * space.coefficients(moved) / sd,
    )


def _stronger(ways: list[LeftOut]) -> list[LeftOut]:
    """Of the two ways of each parameter the one that the trials ask for."""
    best: dict[tuple[str, str], LeftOut] = {}
    for each in ways:
        key = each.effect, each.parameter
        if key not in best or each.z > best[key].z:
            best[key] = each
    return list(best.values())
