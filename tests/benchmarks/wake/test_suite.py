import numpy as np
import pytest

from benchmarks import wake
from benchmarks.effects.filming import film_together
from benchmarks.effects.suite import SIZES
from benchmarks.wake.suite import FASTEST_HZ, SLOWEST_HZ, draw_wake_world, plan_wake_suite

PLANS = plan_wake_suite(3, SIZES["wake"])


def test_a_third_holds_nothing_and_the_rest_one_effect_each():
    kinds = [plan.kind for plan in PLANS]
    assert len(PLANS) == 40
    assert (kinds.count("null"), kinds.count("single")) == (14, 26)
    assert len({plan.effects for plan in PLANS if plan.kind == "single"}) == 26


def test_every_session_has_five_or_six_swims_and_two_of_them_held_out():
    for recorded in (plan.recorded for plan in PLANS):
        speeds = (*recorded.fit_hz, *recorded.holdout_hz)
        assert len(speeds) in (5, 6)
        assert len(recorded.holdout_hz) == 2
        assert min(speeds) >= SLOWEST_HZ
        assert max(speeds) <= FASTEST_HZ


def test_a_seed_gives_one_suite_and_another_gives_another():
    assert plan_wake_suite(3, SIZES["wake"]) == PLANS
    assert plan_wake_suite(4, SIZES["wake"]) != PLANS


@pytest.mark.long
def test_what_is_drawn_swims_forward_inside_the_picture():
    plan = min(PLANS, key=lambda each: 1 / min(*each.recorded.fit_hz, *each.recorded.holdout_hz))
    films = []

    def simulate(*asked, **options):
        films.append(wake.simulate(*asked, **options))
        return films[-1]

    (drawn,) = film_together([draw_wake_world(plan)], None, simulate)
    assert len({each.trial.heading_rad for each in drawn.trials}) == len(drawn.trials)
    assert len({each.trial.trim_rad for each in drawn.trials}) == len(drawn.trials)
    for each, film in zip(drawn.trials, films[-1], strict=True):
        beats = (each.trial.duration_s - 1.0) * each.trial.frequency_hz
        assert 1.3 < beats < 4.2
        px = film.position_px
        assert np.isfinite(px).all()
        assert (px > 0).all()
        assert (px < [3840, 2160]).all()
