from calib.capture.motor import Freshness

TOOK_S = 0.002


def started() -> tuple[Freshness, float]:
    """Ten seconds of good readings, over a wrap of the tick; the host's time at the last."""
    fresh = Freshness()
    for k in range(1001):
        assert fresh.is_fresh(tick(k / 100), 5 + k / 100, TOOK_S)
    return fresh, 15.0


def tick(since_s: float) -> int:
    return round(30000 + 1000 * since_s) % 32768


def test_an_answer_to_an_earlier_question_is_stale_and_the_next_is_fresh() -> None:
    fresh, now = started()
    assert not fresh.is_fresh(tick(10.0), now + 0.01, TOOK_S)
    assert fresh.is_fresh(tick(10.02), now + 0.02, TOOK_S)


def test_a_first_reading_that_was_stale_spoils_none_after_it() -> None:
    fresh = Freshness()
    fresh.is_fresh(tick(0.0), 5.1, TOOK_S)
    assert all(fresh.is_fresh(tick(k / 100), 5 + k / 100, TOOK_S) for k in range(20, 120))
