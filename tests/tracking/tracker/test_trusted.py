"""What of a tracked trial counts: CSRT alone is believed for a while, not for long."""

from dataclasses import replace

import numpy as np
import pytest

from swimmer import load_robot
from tests.tracking.tracker.test_judgement import NINE, swum, trial_of
from tracking.records import only_csrt_flags
from tracking.records.only_csrt import BELIEVED_FOR
from tracking.tracker import trusted

FIN = NINE.index("caudal_fin")


@pytest.mark.parametrize(("frames", "counts"), [(BELIEVED_FOR, True), (BELIEVED_FOR + 1, False)])
def test_csrt_alone_counts_for_a_while_and_not_for_long(frames: int, counts: bool) -> None:
    trial = trial_of(swum())
    by_csrt = np.zeros(trial.state.shape, bool)
    by_csrt[40 : 40 + frames, FIN] = True
    flags = only_csrt_flags(by_csrt, NINE)

    judged = trusted(replace(trial, flags=flags), load_robot())

    assert ((judged.weight[by_csrt] > 0) == counts).all()
    assert (judged.weight[~by_csrt] > 0).all()
    assert flags[0].message.endswith("for too long to count") != counts
