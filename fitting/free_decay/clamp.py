"""Whether the clamp holds the head: one that yields softens the tail, so that its hinges look softer than they are."""

import numpy as np

from session import Flag

HEAD_MOVES_M = 0.003  # rms motion of nose or neck in the decay from which a head is not well clamped
LEAST_SHARE = 0.0075  # of the fin's swing: a springy clamp lowers the stiffness by 0.6 to 1.35 times the share
SURE_SE = 2.5  # standard errors from which a share is no tracking error


def measure_yield(head_m: np.ndarray, fin_m: np.ndarray, reach: float) -> tuple[float, float]:
    """The part of the fin's swing that is the head's, as a share of the whole, and its standard error.

    The line through nose and neck is carried on to the fin and regressed on the fin's motion. Errors of the tracks
    last, as the fin's motion does: the standard error is widened for both (Bartlett 1935).

    Args:
        head_m: (n, 2) lateral motion of nose and neck, m; nan where a sample does not count.
        fin_m: (n,) of the fin, m.
        reach: from nose to fin in lengths from nose to neck.
    """
    carried = head_m[:, 0] + reach * (head_m[:, 1] - head_m[:, 0])
    good = np.isfinite(carried) & np.isfinite(fin_m)
    if good.sum() < 4:
        return 0.0, np.inf
    carried, fin = carried[good] - carried[good].mean(), fin_m[good] - fin_m[good].mean()
    power = max(float(fin @ fin), 1e-300)
    share = float(carried @ fin) / power
    left = carried - share * fin
    lasting = max(_lag_one(left) * _lag_one(fin), 0.0)
    variance = left @ left / (len(fin) - 2) / power * (1 + lasting) / max(1 - lasting, 1e-3)
    return share, float(np.sqrt(variance))


def clamp_flags(position_m: np.ndarray, markers: tuple[str, ...], fin: int, reach: float) -> tuple[Flag, ...]:
    """Doubts about the clamp.

    Args:
        position_m: (n, m, 2) of all markers from the release on, in the robot frame, m; nan where they do not count.
        markers: the m, nose and neck among them.
        fin: index of the rearmost one.
        reach: from nose to that one in lengths from nose to neck.
    """
    head = [markers.index("nose"), markers.index("neck")]
    flags = []
    for i in head:
        spread = float(np.sqrt(np.nanvar(position_m[:, i], axis=0).sum())) if np.isfinite(position_m[:, i]).any() else 0
        if spread > HEAD_MOVES_M:
            message = f"{markers[i]} moves by {1000 * spread:.1f} mm (rms): the head is not clamped"
            flags.append(Flag("head_moves", (markers[i],), message=f"{message}, and its motion is not fitted"))
    share, se = measure_yield(position_m[:, head, 1], position_m[:, fin, 1], reach)
    if abs(share) > max(LEAST_SHARE, SURE_SE * se) and not flags:
        message = (
            f"{100 * share:.1f} ± {100 * se:.1f} % of the fin's swing are the head's: the clamp yields; "
            f"the stiffness comes out low by up to {135 * abs(share):.0f} %"
        )
        flags.append(Flag("head_moves", ("nose", "neck"), message=message))
    return tuple(flags)


def _lag_one(series: np.ndarray) -> float:
    """Correlation of a series (n,) about 0 with itself one sample later."""
    return float(series[1:] @ series[:-1]) / max(float(series @ series), 1e-300)
