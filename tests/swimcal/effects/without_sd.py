"""A module of a user whose parameter lacks its prior: it cannot be imported."""

from swimcal.effects.effect import Parameter

Parameter("share", "1", 0.0, 1.0)  # type: ignore[call-arg]
