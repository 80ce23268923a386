"""What the twin leaves out, effect by effect: whether the trials ask for it, and what it would do to coefficients.

A misfit in no particular direction is judged by all numbers at once, among which one effect may hide that moves
coefficients by much. So each effect is also tested alone, by a score test at the mode (Rao 1948).
"""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from scipy.stats import norm

from fitting.coefficient_fit import NAMES
from fitting.model import Mode
from fitting.model.mode import Progress
from fitting.signatures.affected_session import with_picture
from fitting.signatures.session_row import PRIOR_SD, Whitened
from fitting.signatures.signature import Signature, signature_of
from session import CameraSpec, Flag
from swimmer.effects import Effect

LEFT_OUT_P = 0.01  # family-wise; below, the most significant effect gets a flag
LEFT_OUT_SD = 1.0  # standard deviations by which a coefficient has to be off with it
_AS_LIKELY = 2.0  # difference of squares, twice that of ln likelihoods, within which another is named as well
_MOST = 3  # names
_ONE_SD = (-1.0, 1.0)
_SILENT = 1e-6  # whitened length below which an effect does nothing that coefficients do not
_MISSED = 0.05  # of the sessions with an effect that counts as seen


class LeftOut(NamedTuple):
    """One parameter of an effect that the twin leaves out.

    Attributes:
        effect, parameter, unit: which.
        alone: whether the effect has no other parameter.
        allowed: whether the intervals allow for it to some extent; then all else is of what goes beyond that.
        prior_sd: how large it is on robots as they are built, in that unit.
        value: that the trials ask for within its bounds, in that unit, all else as the posterior has it.
        z: of that, in standard deviations; negative where they ask for the other way, which it cannot go.
        chance: nominal probability that noise alone would ask for any of all that were tried by as much (Bonferroni).
        shows: by how many standard deviations of all that disturbs the trials `prior_sd` would move them,
            coefficients refitted.
        moves: (5,) by how many of their standard deviations coefficients are too high if it is `prior_sd` large.
        hides: whether it may be that large, move a coefficient by more than a standard deviation, and raise no flag.
    """

    effect: str
    parameter: str
    unit: str
    alone: bool
    allowed: bool
    prior_sd: float
    value: float
    z: float
    chance: float
    shows: float
    moves: np.ndarray
    hides: bool

    @property
    def name(self) -> str:
        """Of the effect, and of its parameter where it has one of several."""
        return self.effect if self.alone else f"{self.effect} ({self.parameter})"

    @property
    def asked(self) -> bool:
        """Whether the trials ask for it by more than chance."""
        return self.chance < LEFT_OUT_P

    @property
    def moved(self) -> np.ndarray:
        """(5,) by how many of their standard deviations coefficients are too high if it is as large as asked for."""
        return self.moves * self.value / self.prior_sd

    @property
    def most(self) -> int:
        """Which coefficient it moves most."""
        return int(np.argmax(np.abs(self.moves)))


class EffectsLeftOut(NamedTuple):
    """What the trials say of all effects that the twin leaves out.

    Attributes:
        tried: each parameter of each, the most significant first.
        seen_from: standard deviations by which an effect has to move the trials to be flagged in 19 of 20 sessions.
        silent: effects that change no features.
        diverged: effects that could not be tested, since every twin with them diverged.
    """

    tried: tuple[LeftOut, ...] = ()
    seen_from: float = 0.0
    silent: tuple[str, ...] = ()
    diverged: tuple[str, ...] = ()

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of those that were tested."""
        return tuple(dict.fromkeys(each.effect for each in self.tried))

    @property
    def hidden(self) -> tuple[str, ...]:
        """Names of those that may be there unseen and move a coefficient."""
        return tuple(dict.fromkeys(each.effect for each in self.tried if each.hides and not each.asked))

    @property
    def flags(self) -> tuple[Flag, ...]:
        """That the trials ask for an effect with which a coefficient is off by more than a standard deviation."""
        if not self.tried or not self.tried[0].asked:
            return ()
        best = self.tried[0]
        close = [each for each in self.tried if best.z**2 - max(each.z, 0.0) ** 2 < _AS_LIKELY]
        if max(np.abs(each.moved).max() for each in close) <= LEFT_OUT_SD:
            return ()
        names = " or ".join(each.name.replace("_", " ") for each in close[:_MOST])
        more = f" or {len(close) - _MOST} more" if len(close) > _MOST else ""
        moved = float(best.moved[best.most])
        way = "lower" if moved > 0 else "higher"
        message = (
            f"the trials support an effect that the twin leaves out: {names}{more} ({best.z:.1f} standard deviations, "
            f"nominal p {max(best.chance, 1e-16):.1g} for any of {len(self.tried)} that were tried). With "
            f"{best.name.replace('_', ' ')} of {with_unit(best.value, best.unit)}"
            f"{', beyond what the intervals allow for,' if best.allowed else ''} "
            f"{NAMES[best.most].replace('_', ' ')} would be {abs(moved):.1f} of its standard deviations {way}; "
            "calib diagnose weighs all effects together"
        )
        return (Flag("effect_left_out", message=message),)


def with_unit(value: float, unit: str) -> str:
    """`0.0045 m`; `0.3 per m` for the unit `1/m`."""
    return f"{value:.2g} {unit.replace('1/', 'per ')}" if unit != "1" else f"{value:.2g}"


def score_tests(
    mode: Mode,
    camera: CameraSpec,
    effects: Iterable[Effect],
    tell: Progress = lambda _message, _share: None,
) -> EffectsLeftOut:
    """What each parameter of each effect says, linear about the mode.

    Of features alone: what frequencies say of an effect is for a diagnosis.
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
