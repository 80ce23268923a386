"""The coded wiggle at the start and the end of a trial, which video and motor log both see.

The motor turns to and fro by an irregular code: 16 chips of a quarter second at plus or minus a quarter turn a second.
Its autocorrelation has no side lobe above 3 (of 16), so that it fits in one place only; it is balanced, so that the
crank ends where it began, within 0.19 turn on the way. The end plays the code backwards, which agrees with the start
code in no place by more than 6 of 16: the two cannot be taken for each other. Correlating the crank's motion in the
log (`velocity_rad_s`) with that in the video gives the offset at either end, and the rate between the clocks from
both. When each chip was commanded stands in ``trials/<name>.commands.csv``, so that nothing else needs this definition.
"""

from __future__ import annotations

START_CODE = (1, 1, 1, -1, 1, -1, 1, -1, -1, 1, -1, -1, 1, 1, -1, -1)
END_CODE = START_CODE[::-1]

CHIP_S = 0.25
CHIP_TURNS_PER_S = 0.25
