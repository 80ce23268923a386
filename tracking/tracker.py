"""The marker tracker: predict, find spots, assign them jointly, measure their centres, ask CSRT where there is none."""

from collections.abc import Mapping
from dataclasses import fields, replace

import numpy as np

from tracking.appearance import ENOUGH, LEAST_CONTRAST, Appearance, stands_out
from tracking.colours import MarkerColours
from tracking.csrt import Crop, FaintMarkers, SecondOpinion
from tracking.identities import NOWHERE_PX, MarkerMotion, Prediction, Spacing, assemble_markers
from tracking.sighting import Assignment, Search, Sighting, assign
from tracking.spots import Centres, Spots, Streaks, measure_centres
from tracking.start_look import look_in_boxes, move_onto_dots, with_answer

MISMATCH = 0.5
"""A place that looks so much like another marker, by its hue, is not believed."""
_SIZE_SPREAD = 0.25  # change of ln(size) that lowers the confidence by a factor exp(-1/2)
_CONTRAST_SPREAD = 0.35  # relative change of the contrast that does the same
_AGREES = 0.12  # diameters by which colour and brightness may put a marker apart
_CSRT_CONFIDENCE = 0.5  # largest confidence where only CSRT saw the marker
_FAINT = 15.0  # answers under so many steps of luma are faint
_CONFIDENT = 0.6  # confidence from which a sample teaches the look of the marker …
_DOUBTED = 0.3  # below it a marker may be another thing: distances do not follow it
_SETTLED = 5  # … and from so many frames on without a doubt which spot is its own
_SLACK_PX = 2.0  # distance of a box from its marker, beyond half the marker
_BORDER = 0.25  # diameters from the border of the picture within which a marker counts as gone
# A search in doubt reaches so many times the distance to the nearest marker, but no more than so many diameters.
_REACH, _FARTHEST = 1.25, 5.0
_OUT_OF_ORDER = 1.5  # times that a distance grows or shrinks, against most others, where names are in disorder
_FEWEST_PAIRS = 3  # distances that tell what most do
_ANEW = 10  # frames of a loss after which all markers are assembled as if the body had been moved
_WHOLE = 2.5  # times that such a search reaches farther
_SPREAD = 0.6  # share of that reach by which a doubtful marker usually is off its expected place
_SHUTTER = 0.25  # share of a frame with an open shutter, as assumed at first, …
_SHUTTERS = 0.01, 1.0  # … and its least and largest value
_KEEP_SHUTTER = 0.95  # … and what a frame leaves of what is known of that


class MarkerTracker:
    """Follows m markers from frame to frame; made by `begin` or `restored`; `csrt` is asked where no spot answers."""

    def __init__(self, start: Appearance, motion: MarkerMotion, spacing: Spacing, csrt: SecondOpinion | None) -> None:
        self.start = start
        self.look = start
        self.bright_start: Appearance | None = None  # the look in brightness, where markers are sought by colour
        self.bright: Appearance | None = None
        self.motion = motion
        self.spacing = spacing
        self.apart_px = spacing.lengths[0]  # (e,) distances of the pairs at the start
        self.csrt = csrt
        self.shutter = np.array([_SHUTTER**2, 1.0]) * np.mean(start.diameter_px) ** 2  # lengths and speeds, squared
        self.settled = np.zeros(len(start.sign), int)  # frames in a row in which its spot was beyond doubt
        self.faint: FaintMarkers | None = None
        self.colours: MarkerColours | None = None  # where some markers differ in it

    @classmethod
    def begin(
        cls,
        luma: np.ndarray,
        centre_px: np.ndarray,
        box_px: np.ndarray,
        use_csrt: bool = True,
        threads: int = 0,
        brightness: np.ndarray | None = None,
        yuv: np.ndarray | None = None,
    ) -> tuple["MarkerTracker", Sighting]:
        """Start in a frame in which every marker has a box.

        The frame is (h, w) uint8, as is its brightness where it shows colours; of `yuv` (h, w, 3) the colours of the
        markers are learnt. (m, 2) are the centres of the boxes and (m,) their mean sides. CSRT takes so many threads,
        0 for all cores.
        """
        centre_px = move_onto_dots(luma, centre_px, box_px)
        start, centres, widest = look_in_boxes(luma, centre_px, box_px)
        start = with_answer(luma, centres.position_px, start)
        csrt = SecondOpinion(threads) if use_csrt else None
        motion, loose = MarkerMotion.begin(centre_px, start.diameter_px), Spacing.begin(centre_px, one_body=False)
        tracker = cls(start, motion, loose, csrt)
        if brightness is not None:
            bright, *_ = look_in_boxes(brightness, centres.position_px, box_px)
            alike = np.abs(np.log(bright.diameter_px / start.diameter_px)) < _SIZE_SPREAD
            clear = alike & stands_out(brightness, centres.position_px, box_px)
            bright = replace(bright, contrast=np.where(clear, bright.contrast, LEAST_CONTRAST))
            tracker.bright = tracker.bright_start = bright
        near_px = np.minimum(start.diameter_px, widest) / 2 + _SLACK_PX
        still = np.zeros(centre_px.shape)
        first = tracker._see(luma, Prediction(centre_px.astype(float), near_px, still), frames=np.inf)
        faint = ~first.seen | (start.answer * start.contrast < _FAINT)
        place = np.where(faint[:, None], centre_px, first.position_px)
        if use_csrt and faint.any():
            tracker.faint = FaintMarkers(faint, [Crop.around(luma, here) for here in place[faint]], box_px, threads)
            first = first.with_csrt(dict(zip(np.flatnonzero(faint).tolist(), centre_px[faint], strict=True)))
        tracker.motion = MarkerMotion.begin(place, start.diameter_px)
        tracker.spacing = Spacing.begin(first.position_px)
        tracker.apart_px = tracker.spacing.lengths[0]
        tracker.colours = MarkerColours.of_markers(yuv, place, start.diameter_px)
        return tracker, first

    def step(
        self,
        luma: np.ndarray,
        taken_px: np.ndarray | None = None,
        frames: float = 1.0,
        brightness: np.ndarray | None = None,
        yuv: np.ndarray | None = None,
    ) -> Sighting:
        """Follow the markers into the next frame (h, w) uint8, `frames` frames of the usual rate after the one before.

        No marker is put where others are that this tracker does not follow, (o, 2). Where the frame shows colours, its
        brightness (h, w) uint8 says more sharply where a marker is; `yuv` (h, w, 3) tells markers of several colours
        apart.
        """
        return self._see(luma, self.motion.predict(self.look.diameter_px, frames), taken_px, frames, brightness, yuv)

    def state(self) -> dict[str, np.ndarray]:
        """Return all it knows, as arrays; `restored` makes a tracker of them that goes on the same."""
        state = {
            "start": self.start.as_array(),
            "look": self.look.as_array(),
            "shutter": self.shutter,
            "settled": self.settled,
            "apart_px": self.apart_px,
        }
        if self.bright is not None and self.bright_start is not None:
            state |= {"bright_start": self.bright_start.as_array(), "bright": self.bright.as_array()}
        if self.colours is not None:
            state["colours"] = self.colours.chroma
        return state | vars(self.motion) | vars(self.spacing) | ({} if self.csrt is None else self.csrt.state())

    @classmethod
    def restored(cls, state: Mapping[str, np.ndarray], threads: int = 0) -> "MarkerTracker":
        """Restore the tracker that had this `state`."""
        csrt = SecondOpinion(threads) if "crops" in state else None
        motion, spacing = (
            {field.name: state[field.name] for field in fields(part)} for part in (MarkerMotion, Spacing)
        )
        tracker = cls(Appearance(*state["start"]), MarkerMotion(**motion), Spacing(**spacing), csrt)
        tracker.look, tracker.shutter = Appearance(*state["look"]), state["shutter"]
        tracker.settled, tracker.apart_px = state["settled"], state["apart_px"]
        if "bright" in state:
            tracker.bright_start, tracker.bright = Appearance(*state["bright_start"]), Appearance(*state["bright"])
        if "colours" in state:
            tracker.colours = MarkerColours(state["colours"])
        if csrt is not None:
            csrt.restore(state)
        return tracker

    def out_of_order(self, sighting: Sighting) -> np.ndarray:
        """Return (m,) bool, the markers much farther from a neighbour, or nearer to it, than a bend of the body makes.

        The distances are those in the start boxes, at the scale that most have now.
        """
        wrong = np.zeros(len(sighting.seen), bool)
        pairs = self.spacing.pairs
        both = sighting.seen[pairs].all(axis=1)
        if np.count_nonzero(both) >= _FEWEST_PAIRS:
            pairs, ends = pairs[both], sighting.position_px[pairs[both]]
            share = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1) / self.apart_px[both]
            share /= np.median(share)
            wrong[pairs[(share < 1 / _OUT_OF_ORDER) | (share > _OUT_OF_ORDER)]] = True
        return wrong

    @property
    def can_be_kept(self) -> bool:
        """Return whether `state` says it all: not while CSRT runs, on a marker that was lost or on faint ones."""
        return self.faint is None and (self.csrt is None or not self.csrt.running)

    def _see(
        self,
        luma: np.ndarray,
        predicted: Prediction,
        taken_px: np.ndarray | None = None,
        frames: float = 1.0,
        brightness: np.ndarray | None = None,
        yuv: np.ndarray | None = None,
    ) -> Sighting:
        if self.faint is not None:  # no spot is theirs, and where they are is no other's
            predicted = replace(predicted, gate_px=np.where(self.faint.which, NOWHERE_PX, predicted.gate_px))
            faint_px = self.motion.past[0][self.faint.which]
            taken_px = faint_px if taken_px is None else np.vstack([taken_px, faint_px])
        streaks = self._streaks(predicted.velocity_px)
        search = Search(luma, self.look, streaks, taken_px, self.colours, yuv)
        found = self._assigned(search, predicted)
        predicted, (position, seen) = found.predicted, found.placed
        asked = seen if self.faint is None else seen | self.faint.which
        by_csrt = self._ask_csrt(search, position, asked)
        seen |= by_csrt
        others = found.others_px(position, taken_px)
        velocity = np.where(found.chosen[:, None] >= 0, self.motion.velocity(position, frames), predicted.velocity_px)
        streaks = self._streaks(velocity)
        centres = measure_centres(luma, position[seen], others, self.look.of(seen), streaks.some(seen))
        fast = np.isfinite(centres.streak_px2)
        if fast.any():  # the shutter: squared lengths of their streaks over squared velocities
            sums = [centres.streak_px2[fast].sum(), (velocity[seen][fast] ** 2).sum()]
            self.shutter = _KEEP_SHUTTER * self.shutter + sums
        if brightness is not None:
            centres = self._sharpened(brightness, centres, others, seen, streaks.some(seen))
        centres, kept = self._believable(luma, centres, position, seen)
        sighting = self._sighting(position, kept, by_csrt & kept, centres, found)
        if self.faint is not None:
            sighting = sighting.with_csrt(self.faint.step(luma))
        self.motion.update(predicted.position_px, sighting.position_px, sighting.seen, frames)
        self._remember(luma, sighting, found.doubtful)
        return sighting

    def _streaks(self, velocity_px: np.ndarray) -> Streaks:
        """Return the streaks of the markers at that velocity (m, 2), a frame."""
        open_for = np.sqrt(np.clip(self.shutter[0] / self.shutter[1], _SHUTTERS[0] ** 2, _SHUTTERS[1] ** 2))
        return Streaks.of(velocity_px, self.look.diameter_px, float(open_for))

    def _assigned(self, search: Search, predicted: Prediction) -> Assignment:
        """Find a spot for each marker: the nearest ones, or all markers at once where these leave a doubt.

        Who breaks away from its neighbours all the same is let go, to be sought where they put it.
        """
        spots = search.spots(predicted)
        chosen = assign(spots, predicted)
        doubtful = self._doubtful(spots, chosen, predicted)
        if doubtful.any():
            lost = (chosen < 0) & (self.motion.unseen == 0)
            spots, chosen = self._assembled(search, predicted, doubtful, lost)
            left = (chosen < 0) & (self.motion.unseen == 0) & ~lost
            if left.any():  # the spot it had was another's, or none
                spots, chosen = self._assembled(search, predicted, doubtful, lost | left)
        found = Assignment(spots, chosen, predicted, doubtful)
        if not (self.motion.seen > 2).any():  # right after the boxes little is known of how they move
            return found
        position, seen = found.placed
        strength = np.where(seen, np.append(spots.strength, 0.0)[chosen], 0.0)
        moved = predicted.position_px - self.motion.past[0]
        misplaced = self.spacing.misplaced(
            position, predicted.position_px, moved, seen, strength, self.look.diameter_px
        )
        if not misplaced.any():
            return found
        place = np.where(misplaced[:, None], self.spacing.expected(position), predicted.position_px)
        let_go = np.where(misplaced, -1, chosen)
        return Assignment(spots, let_go, replace(predicted, position_px=place), doubtful | misplaced)

    def _assembled(
        self, search: Search, predicted: Prediction, doubtful: np.ndarray, lost: np.ndarray
    ) -> tuple[Spots, np.ndarray]:
        """Search farther out, and give all markers their spots (m,) at once.

        Where most are `doubtful` (m,), the body may also have stayed, or moved as a whole. The same is tried when a
        marker gets `lost` (m,), and now and then while it is: all may sit one dot too far.
        """
        again = self.motion.unseen % _ANEW == _ANEW - 1
        moved = bool(((again | lost) & predicted.is_open).any())
        whole = moved or bool(2 * np.count_nonzero(doubtful) > len(doubtful))
        farther = _WHOLE if moved else 1.0
        anchors = [predicted]
        if whole:
            place = np.where(predicted.is_open[:, None], self.motion.past[0], predicted.position_px)
            anchors.append(replace(predicted, position_px=place))
        found = []
        for anchor in anchors:
            wide, spread = self._widened(anchor, doubtful, farther)
            spots = search.spots(wide)
            found.append((spots, assemble_markers(spots, wide, spread, self.spacing, whole)))
        spots, best = min(found, key=lambda each: each[1].cost)
        return spots, best.chosen

    def _doubtful(self, spots: Spots, chosen: np.ndarray, predicted: Prediction) -> np.ndarray:
        """Return (m,) bool, the markers that have no spot, share one within reach, or whose motion is not known yet."""
        if not len(self.spacing.pairs):
            return np.zeros(len(chosen), bool)
        distance = np.linalg.norm(predicted.position_px[:, None] - spots.position_px[None], axis=2)
        near = distance <= predicted.gate_px[:, None]  # (m, c)
        contested = (near & (near.sum(axis=0) > 1)).any(axis=1) | (predicted.gate_px > 0.5 * self._nearest_px())
        doubtful = (chosen < 0) | contested | (self.motion.seen < 2)
        return doubtful & predicted.is_open

    def _widened(self, predicted: Prediction, doubtful: np.ndarray, farther: float) -> tuple[Prediction, np.ndarray]:
        """Widen the search for doubtful markers (m,) and their neighbours; return it and its reach (m,), px.

        It reaches so many times `farther` where the whole body may have been moved: then all are sought.
        """
        joined = doubtful | (farther > 1)
        for pair in self.spacing.pairs[doubtful[self.spacing.pairs].any(axis=1)]:
            joined[pair] = True
        reach = np.minimum(farther * _REACH * self._nearest_px(), farther * _FARTHEST * self.look.diameter_px)
        gate = np.where(joined & predicted.is_open, np.maximum(predicted.gate_px, reach), predicted.gate_px)
        spread = np.where(doubtful, np.maximum(predicted.gate_px, _SPREAD * reach / farther), predicted.gate_px)
        return replace(predicted, gate_px=gate), spread

    def _nearest_px(self) -> np.ndarray:
        """Return (m,) distance of each marker to the nearest other one, as they were last."""
        apart = np.linalg.norm(self.motion.past[0][:, None] - self.motion.past[0][None], axis=2)
        return np.sort(apart, axis=1)[:, 1]

    def _sharpened(
        self, brightness: np.ndarray, centres: Centres, others: np.ndarray, seen: np.ndarray, streaks: Streaks
    ) -> Centres:
        """Put markers seen by colour (m,) where brightness has them, if both agree and it looks as it did.

        A glint or a bubble on a coloured marker draws its brightness, not its colour.
        """
        if self.bright is None or self.bright_start is None:
            return centres
        look = self.bright.of(seen)
        found = measure_centres(brightness, centres.position_px, others, look, streaks)
        apart = np.linalg.norm(found.position_px - centres.position_px, axis=1) / look.diameter_px
        wider = np.log(np.maximum(found.diameter_px, 1.0) / look.diameter_px)
        fainter = found.contrast / look.contrast
        good = (apart < _AGREES) & (np.abs(wider) < _SIZE_SPREAD) & (np.abs(fainter - 1) < _CONTRAST_SPREAD)
        good &= look.contrast >= ENOUGH
        diameter, contrast = self.bright.diameter_px.copy(), self.bright.contrast.copy()
        diameter[seen], contrast[seen] = found.diameter_px, found.contrast
        surely = seen.copy()
        surely[seen] = good
        self.bright = self.bright.seen(surely, diameter, contrast, self.bright_start)
        return replace(centres, position_px=np.where(good[:, None], found.position_px, centres.position_px))

    def _believable(
        self, luma: np.ndarray, centres: Centres, position: np.ndarray, seen: np.ndarray
    ) -> tuple[Centres, np.ndarray]:
        """Drop what is on the picture's border or wandered off its spot; return (m,) bool of the rest."""
        height, width = luma.shape
        margin = _BORDER * self.look.diameter_px[seen]
        place = centres.position_px
        inside = (place > margin[:, None]).all(axis=1) & (place < [width - 1, height - 1] - margin[:, None]).all(axis=1)
        wandered = np.linalg.norm(place - position[seen], axis=1) > np.maximum(0.5 * self.look.diameter_px[seen], 3.0)
        good = inside & ~wandered
        kept = seen.copy()
        kept[seen] = good
        return Centres(place[good], centres.diameter_px[good], centres.contrast[good], centres.streak_px2[good]), kept

    def _sighting(
        self,
        position: np.ndarray,
        seen: np.ndarray,
        by_csrt: np.ndarray,
        centres: Centres,
        found: Assignment,
    ) -> Sighting:
        spots, chosen = found.spots, found.chosen
        place, confidence = position.copy(), np.zeros(len(seen))
        diameter, contrast = np.full((2, len(seen)), np.nan)
        place[seen], diameter[seen], contrast[seen] = centres.position_px, centres.diameter_px, centres.contrast
        look = self.look.of(seen)
        size = np.log(np.maximum(centres.diameter_px, 1.0) / look.diameter_px) / _SIZE_SPREAD
        fade = np.clip(1 - centres.contrast / look.contrast, 0, None) / _CONTRAST_SPREAD
        confidence[seen] = np.exp(-0.5 * (size**2 + fade**2))
        spotted = seen & ~by_csrt & (chosen >= 0)
        confidence[spotted] *= np.clip(spots.strength[chosen[spotted]], 0, 1)
        if spots.mismatch is not None:
            confidence[spotted] *= 1 - spots.mismatch[spotted, chosen[spotted]]
        confidence[by_csrt] = np.minimum(confidence[by_csrt], _CSRT_CONFIDENCE)
        return Sighting(place, seen, confidence, diameter, contrast, by_csrt)

    def _remember(self, luma: np.ndarray, sighting: Sighting, doubtful: np.ndarray) -> None:
        """Learn the look of what was seen well, and keep its picture for CSRT."""
        sure = sighting.confidence > _CONFIDENT
        self.settled = np.where(sighting.seen & ~sighting.by_csrt & ~doubtful, self.settled + 1, 0)
        itself = sure | (self.settled > _SETTLED)  # whatever it looks like, it is where it should be
        self.look = self.look.seen(itself, sighting.diameter_px, sighting.contrast, self.start)
        self.spacing.learn(sighting.position_px, sure, sighting.seen & (sighting.confidence < _DOUBTED))
        if self.csrt is not None:
            self.csrt.forget(sighting.seen & ~sighting.by_csrt)
            self.csrt.remember(luma, sighting.position_px, sure)

    def _ask_csrt(self, search: Search, position: np.ndarray, seen: np.ndarray) -> np.ndarray:
        """Put CSRT's answers into `position` (m, 2) where they hold; return (m,) bool of where they do."""
        held = np.zeros_like(seen)
        if self.csrt is not None and not seen.all():
            answers = self.csrt.ask(search.luma, ~seen, self.look.diameter_px, position, search.taken_px)
            for marker, answer in answers.items():
                mismatch = search.mismatch(answer[None])
                if mismatch is None or mismatch[marker, 0] < MISMATCH:
                    position[marker], held[marker] = answer, True
        return held
