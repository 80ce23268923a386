"""What an effect gives back, held to the shape that it should have."""

from __future__ import annotations

import numpy as np

from session import InputError
from session.errors import Fault, shown
from swimmer.effects.effect import Effect


def of_shape(shape: tuple[int, ...], effect: Effect, way: str, given: np.ndarray) -> np.ndarray:
    """The array that an effect gave.

    Args:
        shape: that it should have.
        effect: that gave it.
        way: the method that gave it.
        given: the array.

    Raises:
        InputError: it is of another shape, or no array.
    """
    if isinstance(given, np.ndarray) and given.shape == shape:
        return given
    own = type(effect)
    fault = Fault(
        file=f"effect {effect.name} ({own.__module__}.{own.__qualname__})",
        where=way,
        what="it gives the wrong shape" if isinstance(given, np.ndarray) else "it gives no array",
        found=str(given.shape) if isinstance(given, np.ndarray) else shown(given),
        expected=f"an array of shape {shape}",
        next_step=f"Mend {own.__qualname__}.{way}; swimmer/effects/effect.py says what each number of the shape is.",
    )
    raise InputError([fault])
