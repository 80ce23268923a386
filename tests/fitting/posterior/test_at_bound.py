"""What the posterior says of a coefficient at a bound of its prior."""

from types import SimpleNamespace

import numpy as np
import pytest

from fitting.coefficient_fit import Marginal
from fitting.posterior.posterior import _flags


@pytest.mark.parametrize(
    ("name", "interval", "words"),
    [
        (
            "blunt_drag",
            (0.01, 0.4),
            "blunt_drag is at its physical limit 0: the trials allow that there is no such drag",
        ),
        ("angular_drag", (0.01, 0.4), "angular_drag is at its physical limit 0"),
        ("magnus_lift", (0.01, 0.4), "magnus_lift is at its bound 0: the prior, not the trials, limits"),
        ("slender_drag", (7.0, 9.95), "slender_drag is at its bound 10: the prior, not the trials, limits"),
        ("slender_drag", (0.05, 9.95), "slender_drag is at its bound 0 and 10: the prior, not the trials, limits"),
    ],
)
def test_a_drag_at_0_is_not_cut_off_by_the_prior(name: str, interval: tuple[float, float], words: str) -> None:
    marginal = Marginal(float(np.mean(interval)), 1.0, *interval, 400.0, 1.0, False)
    posterior = SimpleNamespace(
        surrogate=SimpleNamespace(settled=True),
        discrepancy=np.zeros((3, 2)),
        misfit_p=0.5,
        mode=SimpleNamespace(sizes={"marker_placement": 0.0}),
        outside=(),
        marginals={name: marginal},
    )
    (message,) = [flag.message for flag in _flags(posterior) if flag.kind == "at_bound"]  # type: ignore[arg-type]
    assert message.startswith(words)
    assert f"90 % interval {interval[0]:.2g} to {interval[1]:.2g}" in message
