"""Strength at which an effect is as detectable as is asked, every rival refitted, the plain twin first of all.

The effect's own form in the catalogue is refitted too, and does not follow it exactly either: a form that stays o away
from the truth is separated from a rival that stays r away as if they were sqrt(r^2 - o^2) apart (their expected log
likelihood ratio is half the square of that).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.effects.drawn import DrawnWorld
from benchmarks.effects.filming import Filming
from benchmarks.effects.rows import SessionRows, closest_fit
from benchmarks.reality import Mechanism
from fitting.signatures import Signature
from swimcal.errors import NotEnoughData, SimulationDiverged

SEPARATE = 3.3  # From this distance on two effects are confused in at most 5 % of cases.
# Effects below this share of it cannot be separated: 3.3 itself is asked for, and reached to 5 %.
_ALIKE_SHARE = 0.9
Strong = Callable[[float], tuple[Mechanism, ...]]
_START_STRENGTH = 1.0  # The search for a strength starts here.
_MAX_STRENGTH = 30.0
_ROUNDS = 6  # At most this many strengths are tried.
_MAX_GROWTH = 4.0  # A strength changes by at most this factor from one try to the next.
_TOLERANCE = 0.05  # A distance counts as reached within this share of it.
_FALL_FACTOR = 1.1  # The distance has fallen where a weaker effect reached more than this many times as much.


@dataclass(frozen=True, eq=False)
class Strength:
    """Effect in a session, at one strength."""

    value: float  # strength that its mechanism is made with
    mechanisms: tuple[Mechanism, ...]  # mechanisms at that strength
    detectability: float  # margin by which its own form is nearer than the nearest rival, the plain twin among them
    rivals: Mapping[str, float]  # margin by which it is nearer than each other one, by name, the nearest first

    @property
    def alike(self) -> tuple[str, ...]:
        """Rivals that these data cannot separate from the effect."""
        return tuple(name for name, distance in self.rivals.items() if distance < _ALIKE_SHARE * SEPARATE)


def strength_for(
    asked: float, strong: Strong, own: str | None, drawn: DrawnWorld, rows: SessionRows, signatures: Sequence[Signature]
) -> Filming[Strength]:
    """Find the strength at which the nearest rival is as far as asked, as near as it gets; of several alike the least.

    Some effects never get there: a rival follows them however strong they are, or the effect's own form fails first.
    Rivals are all signatures but the effect's own, by its name; one outside the catalogue has none.

    Raises:
        SimulationDiverged: at every strength that was tried.
    """
    rivals = [signature for signature in signatures if signature.effect.name != own]
    itself = next((signature for signature in signatures if signature.effect.name == own), None)
    tries: dict[float, Strength] = {}
    value = _START_STRENGTH
    for _ in range(_ROUNDS):
        found = yield from _try_strength(value, strong(value), drawn, rows, rivals, itself)
        if found is not None:
            tries[value] = found
        if found is not None and abs(found.detectability / asked - 1) < _TOLERANCE:
            break
        following = _choose_next(asked, value, tries)
        if following in tries:
            break
        value = following
    if not tries:
        raise SimulationDiverged(f"{own or 'an effect'}: no strength could be simulated, down to {value:g}")
    return min(tries.values(), key=lambda found: (abs(found.detectability - asked), found.value))


def _choose_next(asked: float, value: float, tries: Mapping[float, Strength]) -> float:
    """Return the strength to try after the last one, which could not be simulated if it is not among the tries.

    Up to some strength the distance grows. Beyond, where there is such a strength, the effect's own form fails before
    a rival does, and the distance falls, down to 0.
    """
    if value not in tries:
        return value / 2
    found = tries[value].detectability
    weaker = [each for each in tries if each < value]
    fallen = found == 0.0 or any(tries[each].detectability > _FALL_FACTOR * found for each in weaker)
    if found < asked and fallen:
        return float(np.sqrt(value * max(weaker))) if weaker else value / _MAX_GROWTH
    grown = float(np.clip(value * asked / max(found, asked / _MAX_GROWTH), value / 10, _MAX_STRENGTH))
    beyond = [each for each in tries if each > value]
    return min(grown, float(np.sqrt(value * min(beyond)))) if beyond and grown > value else grown


def _try_strength(
    value: float,
    mechanisms: tuple[Mechanism, ...],
    drawn: DrawnWorld,
    rows: SessionRows,
    rivals: Sequence[Signature],
    itself: Signature | None,
) -> Filming[Strength | None]:
    """Measure what the mechanisms do to the fitted swims; None where they cannot be simulated or measured."""
    try:
        changes = rows.changes((yield from drawn.recorded(mechanisms, drawn.swims(rows.role))))
    except (SimulationDiverged, NotEnoughData):
        return None
    if not np.isfinite(changes[0].row).all():
        return None

    own = 0.0 if itself is None else closest_fit(changes, [itself])[1].distance
    apart = sorted(
        (_compute_separation(closest_fit(changes, [each])[1].distance, own), each.effect.name) for each in rivals
    )
    plain = _compute_separation(closest_fit(changes, [])[1].distance, own)
    return Strength(value, mechanisms, min([plain, *(d for d, _ in apart)]), {name: d for d, name in apart})


def _compute_separation(rival: float, own: float) -> float:
    """Return the separation of a rival at one distance from a form at another; 0 where it is nearer."""
    return float(np.sqrt(max(rival**2 - own**2, 0.0)))
