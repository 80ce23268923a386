"""The printing of numbers: millimetres at this edge, a true minus, and a dash for what is not known."""

import math
from collections.abc import Callable, Sequence

MISSING = "–"
MM = 1000.0  # millimetres in a metre


def shown(value: float | None, decimals: int = 1, *, signed: bool = False) -> str:
    """Format a number with this many decimals; a dash for None, nan and infinity."""
    if value is None or not math.isfinite(value):
        return MISSING
    text = f"{value:{'+' if signed else ''}.{decimals}f}"
    return text.lstrip("+-") if not float(text) else text.replace("-", "−")


def significant(value: float | None, digits: int = 3) -> str:
    """Format a number with this many significant digits; a dash for None, nan and infinity."""
    if value is None or not math.isfinite(value):
        return MISSING
    return f"{value:.{digits}g}".replace("-", "−")


def in_mm(value_m: float | None, decimals: int = 1, *, signed: bool = False) -> str:
    """Format metres, or metres a second, as millimetres."""
    return shown(None if value_m is None else value_m * MM, decimals, signed=signed)


def with_error(value: float, se: float, decimals: int = 1) -> str:
    """Format a value with its error, `0.650 ± 0.004`, both with as many decimals as the error needs.

    The value stands alone where the error is not known.
    """
    if not (math.isfinite(se) and se > 0):
        return shown(value, decimals)
    decimals = next((d for d in range(6) if se * 10**d >= 0.95), 6)
    return f"{shown(value, decimals)} ± {shown(se, decimals)}"


def percent(share: float | None) -> str:
    """Format a share as a percentage; 100 % only when nothing is left out."""
    if share is None or not math.isfinite(share):
        return MISSING
    return f"{share:.0%}".replace("%", " %") if share in (0.0, 1.0) else f"{min(100 * share, 99.9):.1f} %"


def whole_percent(share: float) -> str:
    """Format a share as a whole percentage, `89 %`; with one decimal where it would else be 0 or 1 %."""
    value = 100 * share
    return f"{shown(value, 1 if 0.05 <= abs(value) < 0.95 else 0)} %"


def of_its_size(value: float, *, signed: bool = False) -> str:
    """Format a number with two decimals, one from 10 on, none from 100 on."""
    return shown(value, 0 if abs(value) >= 100 else 1 if abs(value) >= 10 else 2, signed=signed)


def spanned(low: float, high: float, how: Callable[[float], str] = significant) -> str:
    """Format a range, `0.4 to 7.8`; a dash where an end is not known."""
    return f"{how(low)} to {how(high)}" if math.isfinite(low) and math.isfinite(high) else MISSING


def counted(count: int, noun: str, plural: str = "s") -> str:
    """Format a count with its noun: `1 trial`, `2 trials`."""
    return f"{count} {noun}{'' if count == 1 else plural}"


def listed(names: Sequence[str], most: int = 6) -> str:
    """Join names as `a, b and c`; of many the first few and how many more."""
    if len(names) > most:
        return f"{', '.join(names[:most])} and {len(names) - most} more"
    return " and ".join([", ".join(names[:-1]), names[-1]]) if len(names) > 1 else "".join(names)


def shortened(name: str, most: int = 14) -> str:
    """Shorten a name so that it fits into a figure."""
    return name if len(name) <= most else f"{name[: most - 1]}…"


def in_words(name: str) -> str:
    """Convert a name to words: `tendon slack` for `tendon_slack`, `Kutta lift` for `kutta_lift`."""
    words = name.replace("_", " ")
    return f"{words[:1].upper()}{words[1:]}" if name in ("kutta_lift", "magnus_lift") else words


def sentence(text: str) -> str:
    """Make a sentence of a text: a full stop and, unless it starts with a name such as `tail_1`, a capital letter."""
    text = text.strip()
    start = text[:1].upper() if text.split(" ")[0].isalpha() else text[:1]
    return start + text[1:] + ("" if text.endswith((".", "!", "?")) else ".")
