import pytest

from calib.capture.trials import TrialPlan
from swimsynth.disturbances import schedule


@pytest.mark.parametrize(("hz", "seconds"), [(0.6, 6.0), (1.1, 20.0)])
def test_the_schedule_is_that_of_a_capture(hz: float, seconds: float) -> None:
    assert list(schedule(hz, seconds)) == list(TrialPlan("x", hz, seconds).steps())
