"""Whether fitted trials ask for an effect that the twin leaves out: a score test of each at the mode (Rao 1948)."""

from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np
from scipy.stats import norm

from fitting.left_out import LEFT_OUT_P, LEFT_OUT_SD, EffectsLeftOut, LeftOut
from fitting.model import Mode
from fitting.signatures.separation import Whitened
from fitting.signatures.session_row import PRIOR_SD
from fitting.signatures.signature import Signature, signature_of
from fitting.signatures.view_of import with_picture
from session import CameraSpec
from swimmer.effects import Effect

_ONE_SD = (-1.0, 1.0)
_SILENT = 1e-6  # whitened length below which an effect does nothing that coefficients do not
_MISSED = 0.05  # of the sessions with an effect that counts as seen


def score_tests(
    mode: Mode,
    camera: CameraSpec,
    effects: Iterable[Effect],
    tell: Callable[[str, float | None], None] = lambda _message, _share: None,
) -> EffectsLeftOut:
    """What each parameter of each effect says, linear about the mode.

    Of features alone: what frequencies say of an effect is for a diagnosis.

    Args:
        mode: of the fitted trials.
        camera: that filmed the trials.
        effects: of the catalogue.
        tell: of the progress.
    """
    camera, effects = with_picture(camera, [each.trial for each in mode.model.trials]), tuple(effects)
    signatures = []
    for number, effect in enumerate(effects):
        tell(f"whether {effect.name.replace('_', ' ')} is missing", number / len(effects))
        signatures.append(signature_of(effect, mode.model, camera, mode.coefficients, sizes=_ONE_SD))
    return _asked(mode, signatures)


def _asked(mode: Mode, signatures: list[Signature]) -> EffectsLeftOut:
    sd = np.sqrt(np.diag(mode.coefficient_covariance))
    space = Whitened.of(mode.total, mode.jacobian, PRIOR_SD)
    residual = space.projected(mode.residual)
    ways = [way for signature in signatures for way in _ways(signature, space)]
    seen_from = float(norm.isf(LEFT_OUT_P / max(len(ways), 1)) + norm.isf(_MISSED))
    found = [_of_way(way, space, residual, sd, len(ways), seen_from) for way in ways]
    shown = {each.effect for each in found}
    others = {
        each.effect.name: np.isfinite(each.features).any() for each in signatures if each.effect.name not in shown
    }
    return EffectsLeftOut(
        tried=tuple(sorted(_stronger(found), key=lambda each: -each.z)),
        seen_from=seen_from,
        silent=tuple(name for name, finite in others.items() if finite),
        diverged=tuple(name for name, finite in others.items() if not finite),
    )


class _Way(NamedTuple):
    """One parameter of an effect, one way: (k,) how features move with one standard deviation of its prior."""

    effect: Effect
    number: int
    sign: float
    moved: np.ndarray


def _ways(signature: Signature, space: Whitened) -> list[_Way]:
    """Those that show, and with which the twin stands."""
    found = []
    for values, features in zip(signature.values, signature.features, strict=True):
        number = int(np.argmax(np.abs(values)))
        sd, size = signature.effect.parameters[number].sd, values[number]
        moved = features * sd / abs(size)
        if np.isfinite(moved).all() and space.length(moved) > _SILENT:
            found.append(_Way(signature.effect, number, float(np.sign(size)), moved))
    return found


def _of_way(way: _Way, space: Whitened, residual: np.ndarray, sd: np.ndarray, tried: int, seen_from: float) -> LeftOut:
    parameter, shows = way.effect.parameters[way.number], space.projected(way.moved)
    length = float(np.linalg.norm(shows))
    reach = max(parameter.high, 0.0) if way.sign > 0 else max(-parameter.low, 0.0)
    z = float(shows @ residual) / length
    size = float(np.clip(z / length, 0.0, reach / parameter.sd))  # in standard deviations of the prior
    z = z if z <= 0 else float(np.sqrt(2 * size * length * z - (size * length) ** 2))
    moves = way.sign * space.coefficients(way.moved) / sd
    allowed = way.effect.in_fit
    return LeftOut(
        effect=way.effect.name,
        parameter=parameter.name,
        unit=parameter.unit,
        alone=len(way.effect.parameters) == 1,
        allowed=allowed,
        prior_sd=parameter.sd,
        value=way.sign * parameter.sd * size,
        z=z,
        chance=min(1.0, tried * float(norm.sf(z))),
        shows=length,
        moves=moves,
        hides=not allowed and length < seen_from and float(np.abs(moves).max()) > LEFT_OUT_SD,
    )


def _stronger(ways: list[LeftOut]) -> list[LeftOut]:
    """Of the two ways of each parameter the one that the trials ask for; it hides if either may."""
    best: dict[tuple[str, str], LeftOut] = {}
    for each in ways:
        other = best.get((each.effect, each.parameter), each)
        stronger = max(each, other, key=lambda way: way.z)
        best[each.effect, each.parameter] = stronger._replace(hides=each.hides or other.hides)
    return list(best.values())
