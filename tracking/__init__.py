"""From videos and tracks to marker positions one can trust.

A marker on its way: a frame is read (`video`), a start box says where the marker is (`boxes`), it is followed from
frame to frame (`tracker`: predicted, its spot found and assigned, its centre measured, CSRT asked where no spot
answers), kept and corrected as a track (`tracked`, `edits`), believed or not (`quality`), laid on the pool (`camera`,
`lens`) and turned into the frame of the head (`head_frame`).
"""
