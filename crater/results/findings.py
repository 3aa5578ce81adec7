"""What the stage found, in parts that do not change once they are there: impact and ground, shock stage, grains, and
what both are compared with."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from crater.bodies.body_findings import BodyStage
from crater.ejecta.ballistic import Ballistic
from crater.ejecta.catalogue import Catalogue
from crater.ejecta.size_classes import Sizes
from crater.ground.datum import Datum
from crater.measures import chain
from crater.measures.measure import Measures, Quantity
from crater.results import column_labels, series
from crater.results.measurement_config import MeasurementConfig
from crater.results.rest import UNKNOWN, Rest
from crater.scaling import crater_size as scaling
from crater.settings import ChainError, Settings
from matter.case import at_rest
from matter.files import archive, snapshot
from matter.solids.body_shape import Shape
from matter.wording.crater_measures import MAXIMA, MOMENTS

LATE_SHOCK = "all-SPH late stage"


@dataclass(frozen=True)
class Setting:
    """What was hit by what: the stage's ``settings``, the run folder ``inputs``, the ``datum`` of the undisturbed
    ground and its ``gravity`` [m/s^2].

    ``densities`` [kg/m^3]: of the projectile, and of the ground at its surface.
    """

    settings: Settings
    inputs: Path
    datum: Datum
    gravity: float
    densities: tuple[float, float]
    shape: Shape | None = None
    """The surface of before, of an ellipsoid or mesh."""
    patch: Mapping[str, Any] | None = None
    """What its bed says of itself, where that is a patch of its ground laid flat; such grains are flat ground."""

    @property
    def escape_known(self) -> bool:
        """Whether it is known how fast matter has to be to leave: of flat ground the case has to say it."""
        return self.datum.kind != "plane" or self.settings.escape_speed > 0.0

    @property
    def event(self) -> scaling.ImpactEvent:
        """The impact as the scaling laws take it."""
        impact = self.settings.impact
        return scaling.ImpactEvent(
            impact.projectile.radius, impact.speed, impact.angle_from_vertical, self.gravity, *self.densities
        )


@dataclass(frozen=True)
class LastCrater:
    """The crater in the last snapshot of a stage, ``origin`` in words."""

    measures: Measures
    time: float
    origin: str
    path: Path
    rest: Rest = UNKNOWN


@dataclass(frozen=True)
class Ejected:
    """What the crater threw out: what leaves the body, mass against speed, and speed and angle against the position of
    launch; the ``catalogue`` of single particles with their ``fates`` (masses), and where they came from
    (``excavation``), and their ``sizes``; each empty where unknown."""

    leaving: Mapping[str, float] = field(default_factory=dict)
    faster_than: Mapping[str, Any] = field(default_factory=dict)
    launch: Mapping[str, Any] = field(default_factory=dict)
    catalogue: Catalogue | None = None
    fates: Mapping[str, Any] = field(default_factory=dict)
    excavation: Mapping[str, Any] = field(default_factory=dict)
    sizes: Sizes | None = None


@dataclass(frozen=True)
class ShockFindings:
    """The shock stage in time: every snapshot measured, the ``transient`` crater by the maximum at which it is taken,
    those that are still ``growing`` at the end, the ``last`` snapshot (of ``end_time`` [s]; None where it could not be
    measured), ejecta, what the measuring stands on, ``reasons`` for what is missing, what is ``molten``
    (``crater.shock.phases``), the ``decay`` of the shock (``crater.shock.decay``), what melts and boils by the
    ``heat`` that it left (``crater.shock.release``), the ``melt`` of published laws (``crater.scaling.melt``), and the
    snapshot that was ``handed`` over (None where there is none)."""

    moments: tuple[series.Moment, ...]
    transient: Mapping[str, series.Moment]
    growing: tuple[str, ...]
    end_time: float
    end_path: Path
    last: LastCrater | None
    ejected: Ejected
    config: MeasurementConfig
    reasons: Mapping[str, str]
    molten: Mapping[str, Any] = field(default_factory=dict)
    decay: Mapping[str, Any] = field(default_factory=dict)
    heat: Sequence[Mapping[str, Any]] = ()
    melt: Mapping[str, Any] = field(default_factory=dict)
    handed: series.Moment | None = None


@dataclass(frozen=True)
class GrainFindings:
    """The settled grains: every snapshot measured, the ``last`` one (None where it could not be), the ``config``
    behind it, ``reasons`` for what is not, where the ``matter`` of the last one came from
    (``crater.shock.settled_matter``), and the grains as they ``began``, right after the handover."""

    moments: tuple[series.Moment, ...]
    last: LastCrater | None
    config: MeasurementConfig
    reasons: Mapping[str, str]
    matter: Mapping[str, Any] = field(default_factory=dict)
    began: series.Moment | None = None


@dataclass(frozen=True)
class Compared:
    """The crater beside others: the ``scaling`` laws, the published numbers (``reference``), the late stage in grains
    against that in SPH."""

    scaling: Mapping[str, Any] = field(default_factory=dict)
    reference: tuple[Mapping[str, Any], ...] = ()
    late_difference: Mapping[str, Any] | None = None
    reasons: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Findings:
    """Everything that the stage found, for its files, pictures and page. A stage that the run does not have is None.

    ``ballistic``: free flight of what was handed over, on flat ground under gravity. ``soundness``: resolution,
    pressures and cautions (``crater.results.soundness.facts``). ``flight_reasons``: why nothing was flown.
    """

    setting: Setting
    shock: ShockFindings | None
    grains: GrainFindings | None
    ballistic: Ballistic | None = None
    soundness: Mapping[str, Any] = field(default_factory=dict)
    compared: Compared = Compared()
    flight_reasons: Mapping[str, str] = field(default_factory=dict)
    body: tuple[BodyStage, ...] = ()
    """What became of an ellipsoid or mesh as a whole, the last stage at the end."""

    @property
    def settings(self) -> Settings:
        """The stage's settings."""
        return self.setting.settings

    @property
    def inputs(self) -> Path:
        """The run folder."""
        return self.setting.inputs

    @property
    def moments(self) -> tuple[series.Moment, ...]:
        """Every snapshot measured, those of the shock stage first."""
        return tuple(moment for stage in (self.shock, self.grains) if stage is not None for moment in stage.moments)

    @property
    def transient(self) -> Mapping[str, series.Moment]:
        """The transient crater by the maximum (volume, depth, diameter) at which it is taken."""
        return self.shock.transient if self.shock is not None else {}

    @property
    def growing(self) -> tuple[str, ...]:
        """Maxima that had not been passed when the shock stage ended."""
        return self.shock.growing if self.shock is not None else ()

    @property
    def ejected(self) -> Ejected:
        """What was thrown out in the shock stage."""
        return self.shock.ejected if self.shock is not None else Ejected()

    @property
    def late_sph(self) -> LastCrater | None:
        """The measured crater at the end of the shock stage."""
        return self.shock.last if self.shock is not None else None

    @property
    def settled_grains(self) -> LastCrater | None:
        """The measured crater in the last grains."""
        return self.grains.last if self.grains is not None else None

    @property
    def settled_matter(self) -> Mapping[str, Any]:
        """Where the matter of the last grains came from; empty where they do not say."""
        return self.grains.matter if self.grains is not None else {}

    @property
    def handed_over(self) -> tuple[series.Moment | None, series.Moment | None]:
        """The crater right before and right after the handover (``crater.results.handover``)."""
        shock, grains = self.shock, self.grains
        return None if shock is None else shock.handed, None if grains is None else grains.began

    @property
    def final(self) -> LastCrater | None:
        """The measured crater that the run ends with: that of the grains, else that at the end of the shock stage."""
        return self.settled_grains or self.late_sph

    def at_end_of_shock(self, moment: series.Moment | None) -> bool:
        """Whether ``moment`` is of the snapshot with which the shock stage ends: its crater is the all-SPH late stage
        too."""
        late = self.late_sph
        return late is not None and moment is not None and moment.stage == "sph" and moment.time == late.time

    @property
    def configs(self) -> dict[str, MeasurementConfig]:
        """The measurement configuration of each stage (sph, dem)."""
        return {name: stage.config for name, stage in (("sph", self.shock), ("dem", self.grains)) if stage is not None}

    @property
    def reasons(self) -> dict[str, str]:
        """Why something is missing, by what it is."""
        none = {} if self.shock is not None else {"transient": "no shock-stage snapshots in this run"}
        held = [stage.reasons for stage in (self.shock, self.grains) if stage is not None]
        return {
            name: reason
            for part in (none, *held, self.flight_reasons, self.compared.reasons)
            for name, reason in part.items()
        }


def densities(settings: Settings, inputs: Path, first: Path | None) -> tuple[float, float]:
    """Densities of projectile and ground [kg/m^3] as the shock stage began with them (pores, changed materials); of
    their materials where it left none, and where the crater lies below the uppermost layer."""
    ball = at_rest.of_file(settings.impact.projectile.material).bulk
    layer = settings.target.layer_of(settings.impact.expected_transient_diameter)
    ground = at_rest.of_file(layer.material).bulk
    path = inputs / "2_sph" / "target.json"
    if path.is_file() and layer is settings.target.layers[-1]:
        facts = archive.read_json(path)
        if facts.get("frame") == "solid":  # one density everywhere, and no profile
            ground = float(facts["mass_kg"]) / float(facts["volume_m3"])
        else:
            ground = facts.get("profile", {}).get("density_kg_m3", [ground])[-1]
    if first is not None:
        begun = snapshot.read(first)
        mine = begun.layer < 0 if {"layer", "density", "mass"} <= set(begun) else np.zeros(0, dtype=bool)
        if mine.any():
            ball = float(begun.mass[mine].sum() / (begun.mass[mine] / begun.density[mine]).sum())
    return ball, float(ground)


def with_chain_errors(findings: Findings, known: ChainError | None) -> Findings:
    """The measured craters of a run with their chain errors, where its settings carry them; the all-SPH late stage has
    none of its own: where the crater still grew at the end it is that crater."""
    if known is None:
        return findings
    shock, grains = findings.shock, findings.grains
    if shock is not None:
        transient = {
            key: replace(
                moment,
                measures=chain.with_chain(
                    moment.measures, known.transient_at_maximum_depth if key == "depth" else known.transient
                ),
            )
            if moment.measures is not None
            else moment
            for key, moment in shock.transient.items()
        }
        same = [m.measures for m in transient.values() if findings.at_end_of_shock(m) and m.measures is not None]
        last = replace(shock.last, measures=same[0]) if shock.last and same and grains is not None else shock.last
        shock = replace(shock, transient=transient, last=last)
    if grains is not None and grains.last is not None:
        grains = replace(
            grains, last=replace(grains.last, measures=chain.with_chain(grains.last.measures, known.final))
        )
    return replace(findings, shock=shock, grains=grains)


def missing_errors(findings: Findings) -> str:
    """Which parts of the chain error the errors of a run leave out, in words; empty where none."""
    known = findings.settings.chain
    return chain.missing(known.holds if known is not None else (), findings.grains is not None)


def judged(findings: Findings, facts: Mapping[str, Any]) -> Findings:
    """The findings with their ``soundness``; the craters of a run that is not resolved lose their errors."""
    findings = replace(findings, soundness=facts)
    if "not_resolved" not in facts:
        return findings

    def last(crater: LastCrater | None) -> LastCrater | None:
        return None if crater is None else replace(crater, measures=chain.without_errors(crater.measures))

    def bare(moment: series.Moment) -> series.Moment:
        found = moment.measures
        return moment if found is None else replace(moment, measures=chain.without_errors(found))

    shock, grains, ballistic = findings.shock, findings.grains, findings.ballistic
    if shock is not None:
        transient = {key: bare(moment) for key, moment in shock.transient.items()}
        shock = replace(shock, transient=transient, last=last(shock.last), handed=shock.handed and bare(shock.handed))
    if grains is not None:
        grains = replace(grains, last=last(grains.last), began=grains.began and bare(grains.began))
    if ballistic is not None:
        without = {name: chain.without_error(quantity) for name, quantity in ballistic.measures.items()}
        ballistic = replace(ballistic, measures=without)
    return replace(findings, shock=shock, grains=grains, ballistic=ballistic)


def time_of(findings: Findings, moment: series.Moment) -> Quantity:
    """Time of a moment, with half the interval between snapshots as its error."""
    times = np.array([m.time for m in findings.moments if m.stage == moment.stage])
    step = float(np.median(np.diff(times))) if len(times) > 1 else 0.0
    return Quantity(moment.time, 0.5 * step, "s", parts={"interval between snapshots": 0.5 * step})


def final_entry(last: LastCrater) -> dict[str, Any]:
    """When and from what the last column is, and whether its crater is at rest, as ``measures.json`` says it."""
    return {"time_s": Quantity(last.time, 0.0, "s").as_dict(), "from": last.origin, **last.rest.as_dict()}


def columns(findings: Findings) -> list[tuple[column_labels.ColumnLabel, Measures]]:
    """Every crater that was measured under its label: transient, the shock stage's own end (where no transient crater
    is of that snapshot), final."""
    # after the collapse a wide trough may look widest: measured closely it has no diameter, and no maximum of it
    seen = [
        (key, findings.transient[key])
        for key in MOMENTS
        if key in findings.transient and findings.transient[key].value(MAXIMA[key]) > 0.0
    ]
    seen = [(key, m) for key, m in seen if m.measures is not None]
    shots = [column_labels.Moment(key, m.time, m.stage, key in findings.growing, m.measures) for key, m in seen]
    final, late = findings.final, findings.late_sph
    result = column_labels.arranged(shots, final.time if final is not None else None)
    if late is not None and late is not final and not any(findings.at_end_of_shock(m) for _, m in seen):
        result.append(
            (
                column_labels.ColumnLabel("late_sph", "final", LATE_SHOCK, column_labels.when(late.time, "SPH")),
                late.measures,
            )
        )
    if final is not None:
        result.append((column_labels.final(final_entry(final)), final.measures))
    return result
