"""How far effects are from each other, as these data would have them."""

from collections.abc import Sequence

import numpy as np

from diagnosis.evidence import Explanations


def separations(explanations: Explanations, chosen: Sequence[int]) -> np.ndarray:
    """(c, c) whitened distance from each effect (rows), as strong as it comes nearest to what is left, to the others.

    The effect of the column is refitted with the coefficients; two-way error Phi(-d / 2).
    """
    forms = [explanations.best[i] for i in chosen]
    columns = [None if form is None else explanations.row.turn @ form.columns for form in forms]
    strengths = [
        None if c is None or f is None else f.nearest(explanations.row.left, c)
        for c, f in zip(columns, forms, strict=True)
    ]
    found = np.full((len(chosen), len(chosen)), np.nan)
    for i, (own, strength) in enumerate(zip(columns, strengths, strict=True)):
        if own is None or strength is None:
            continue
        change = own @ strength
        for j, (other, form) in enumerate(zip(columns, forms, strict=True)):
            if other is not None and form is not None:
                found[i, j] = 0.0 if i == j else float(np.linalg.norm(change - other @ form.nearest(change, other)))
    return found
