"""How many threads: what was wanted, else what the environment says, else all cores."""

import pytest

from swimcal.robot import load_robot
from swimcal.runs import workers_of
from swimcal.twin import Twin


@pytest.mark.parametrize(("wanted", "setting", "found"), [(3, "2", 3), (0, "2", 2), (0, None, 0), (2, None, 2)])
def test_what_was_wanted_wins(monkeypatch: pytest.MonkeyPatch, wanted: int, setting: str | None, found: int) -> None:
    monkeypatch.delenv("SWIMCAL_WORKERS", raising=False)
    if setting is not None:
        monkeypatch.setenv("SWIMCAL_WORKERS", setting)
    assert workers_of(wanted) == found
    assert Twin(load_robot(), workers=wanted).workers == found


def test_what_is_no_number_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SWIMCAL_WORKERS", "many")
    with pytest.raises(ValueError, match="SWIMCAL_WORKERS: found 'many', expected a number"):
        workers_of(0)
