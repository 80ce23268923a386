"""Names of what `calib benchmark posterior --effect` may put in; no more, for the command line waits for them."""

from typing import Literal, get_args

Effect = Literal[
    "none",
    "hinge_stiffness",
    "hinge_damping",
    "crank_arm",
    "current",
    "entrained_water",
    "tendon_compliance",
    "segment_coefficients",
    "any",
]
"""At full strength: hinges 15 % stiffer, or damped twice as much; a crank arm 5 % shorter; a current; effects of the
catalogue, two standard deviations strong, that no nuisance stands for; any of these, in turn by seed."""
EFFECTS: tuple[Effect, ...] = get_args(Effect)[1:-1]
