"""The nearest plain twin is looked for from several starts, but where the first leaves nothing to look for."""

from __future__ import annotations

import pytest

from diagnosis.discrepancy import discrepancy_for
from diagnosis.ground import Ground
from session import FISHSIM_MARKERS
from swimmer import Twin
from synthetic import PLAUSIBLE_COEFFICIENTS
from tests.diagnosis.grounds import CAMERA, shorter, trials
from tests.fitting.exact_swims import ROBOT

STARTS = (PLAUSIBLE_COEFFICIENTS, (1.2, 1.5, 4.0, 3.0, 0.5))


@pytest.mark.parametrize("same", [True, False])
def test_a_twin_that_leaves_no_more_than_noise_is_not_looked_for_again(
    same: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked, inner = [], Ground._from.__func__  # type: ignore[attr-defined]

    def counted(cls: type[Ground], *args: object) -> Ground | None:
        asked.append(args[2])
        return inner(cls, *args)  # type: ignore[no-any-return]

    monkeypatch.setattr(Ground, "_from", classmethod(counted))
    twin = Twin(ROBOT if same else shorter(0.2), FISHSIM_MARKERS, workers=1)
    found = Ground.fitted(trials(), twin, CAMERA, discrepancy_for(FISHSIM_MARKERS, ROBOT), starts=STARTS)
    assert found.is_noise == same
    assert (len(asked) == 1) == same
