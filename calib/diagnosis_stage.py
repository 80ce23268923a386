"""From measured swims to a diagnosis: ``results/diagnosis.json``, and the twin with what it names.

The diagnosis takes a second to load: it is imported where it is needed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from calib.options import Options
from fitting import MeasuredTrial
from fitting.out_of_water import NOTHING, OutOfWater
from session import (
    FaultCollector,
    InputError,
    NotEnoughData,
    Provenance,
    Session,
    fingerprint_of,
    is_current,
    mark_current,
    read_result_json,
    write_result_json,
    writing_whole,
)
from swimmer import RobotSpec, Twin
from swimmer.effects import Effect, catalogue

if TYPE_CHECKING:
    from diagnosis import Diagnosis, Discrepancy

Found = TypeVar("Found")
FORM = 16  # of the files and of what they rest on


class DiagnosisStage:
    """``results/diagnosis.json`` with its arrays in ``diagnosis.npz``, and ``calibrated+<effects>.xml``.

    Beside that ``calibrated+everything.xml``, where all effects at once are called for.

    Args:
        session: as read.
        robot: as described.
        options: effort, threads, progress.
        stamp: what results are stamped with.
        recordings: fingerprint of what was recorded.
        without: names that the catalogue is to lack.

    Raises:
        InputError: the catalogue has no such effect.
    """

    def __init__(
        self,
        session: Session,
        robot: RobotSpec,
        options: Options,
        stamp: Provenance,
        recordings: str,
        without: frozenset[str] = frozenset(),
    ) -> None:
        self._session, self._robot, self._options, self._stamp = session, robot, options, stamp
        self._recordings, self._without = recordings, without
        self.made: list[Path] = []
        _check_names("--without", sorted(without), catalogue())

    @property
    def file(self) -> Path:
        """``results/diagnosis.json``."""
        return self._session.results / "diagnosis.json"

    @property
    def arrays_file(self) -> Path:
        """``results/diagnosis.npz``: what figures are drawn from."""
        return self.file.with_suffix(".npz")

    @cached_property
    def effects(self) -> dict[str, Effect]:
        """The catalogue without what it is to lack."""
        return {name: effect for name, effect in catalogue().items() if name not in self._without}

    @cached_property
    def fingerprint(self) -> str:
        """Of the recordings, of the catalogue and of how it is diagnosed."""
        effects = {name: [list(parameter) for parameter in effect.parameters] for name, effect in self.effects.items()}
        told = {"form": FORM, "effort": self._options.effort, "effects": effects, "seed": self._session.seed}
        return fingerprint_of({}, told, [self._recordings])

    @property
    def withheld(self) -> frozenset[str]:
        """What the catalogue lacked of the diagnosis that stands; nothing where that cannot be read."""
        with suppress(InputError):
            return frozenset(self.read().get("withheld_from_catalogue") or ()) & set(catalogue())
        return frozenset()

    @property
    def is_current(self) -> bool:
        """Whether it belongs to these recordings."""
        return is_current(self.file, self.fingerprint)

    def make(
        self,
        trials: list[MeasuredTrial],
        discrepancy: Discrepancy | None = None,
        dry: OutOfWater = NOTHING,
    ) -> Diagnosis:
        """Diagnoses and writes.

        Args:
            trials: all swims.
            discrepancy: what a refitted twin leaves of gaits where nothing is wrong; default: what it leaves of the
                toolkit's second simulator.
            dry: what was measured out of the water.

        Raises:
            NotEnoughData: no swim has the role "fit".
            SimulationDiverged: the plain twin, from every start.
        """
        from calib.affected_mjcf import write_affected_twin
        from diagnosis import diagnose
        from diagnosis.arrays import save_arrays
        from diagnosis.diagnosis_file import diagnosis_payload

        found = self._asked(diagnose, self.effects, trials, dry, discrepancy)
        self._remove_models()
        twins = {} if found.refit is None else {"+".join(effect.name for effect in found.refit.effects): found.refit}
        if found.everything is not None:
            twins["everything"] = found.everything[0].refit
        results, robot_file = self._session.results, self._session.robot_file
        written = [write_affected_twin(results, found.ground, twin, name, robot_file) for name, twin in twins.items()]
        models = [path for paths in written for path in paths]
        with writing_whole(self.arrays_file) as part:
            save_arrays(part, found)
        payload = diagnosis_payload(found) | {"withheld_from_catalogue": sorted(self._without)}
        write_result_json(self.file, self._stamp, payload | {"models": [path.name for path in models]})
        mark_current(self.file, self.fingerprint, [self.arrays_file, *models])
        self.made += [self.file, self.arrays_file, *models]
        return found

    def check_supposed(self, names: Sequence[str]) -> None:
        """That the catalogue has these effects.

        Raises:
            InputError: it has not.
        """
        _check_names("--suppose", names, self.effects)

    def suppose(self, names: Sequence[str], trials: list[MeasuredTrial], dry: OutOfWater = NOTHING) -> Path:
        """Asks what the swims say of effects that a user names; ``results/supposed.json``, made anew every time.

        Args:
            names: of effects of the catalogue.
            trials: all swims.
            dry: what was measured out of the water.

        Raises:
            NotEnoughData: no swim has the role "fit", or an effect does nothing in these.
            SimulationDiverged: the plain twin, from every start.
        """
        from diagnosis import suppose
        from diagnosis.diagnosis_file import supposition_payload

        effects = [self.effects[name] for name in dict.fromkeys(names)]
        found = self._asked(suppose, effects, trials, dry)
        path = self.file.with_name("supposed.json")
        write_result_json(path, self._stamp, supposition_payload(found))
        return path

    def read(self) -> dict[str, Any]:
        """The content of ``diagnosis.json``."""
        return read_result_json(self.file)

    def _asked(
        self,
        question: Callable[..., Found],
        effects: Mapping[str, Effect] | Sequence[Effect],
        trials: list[MeasuredTrial],
        dry: OutOfWater,
        discrepancy: Discrepancy | None = None,
    ) -> Found:
        """What `diagnose` or `suppose` says of this session."""
        from diagnosis import Settings, discrepancy_for

        if not any(trial.role == "fit" for trial in trials):
            raise NotEnoughData(f'{self._session.name}: no swim of role "fit"; a diagnosis needs at least one')
        markers = trials[0].markers
        return question(
            trials,
            Twin(self._robot, markers, workers=self._options.workers),
            self._session.camera,
            effects,
            discrepancy_for(markers, self._robot) if discrepancy is None else discrepancy,
            Settings(self._options.effort, seed=self._session.seed),
            self._options.tell,
            dry,
        )

    def _remove_models(self) -> None:
        for path in self._session.results.glob("calibrated+*"):
            path.unlink()


def _check_names(option: str, names: Iterable[str], known: Mapping[str, Effect]) -> None:
    faults = FaultCollector(option)
    for name in names:
        if name not in known:
            faults.add(
                name,
                "no effect of the catalogue",
                found=repr(name),
                expected="names of the catalogue",
                choices=tuple(known),
                next_step="Mend the name; docs/effects.md has the table.",
            )
    faults.raise_if_any()
