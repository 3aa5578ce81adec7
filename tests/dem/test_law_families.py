"""Every contact law of every family: listed once, complete, and physically what a law of its family must be."""

import importlib
import pkgutil
import typing

import numpy as np
import pytest
from pydantic import TypeAdapter, ValidationError
from scipy.integrate import quad

from dem import laws
from dem.contact.columns import COHESION, NORMAL, PAIR_COLUMNS
from dem.contact.contact import Bodies, at_rest
from dem.contact.settings import Contact, GrainLaw
from dem.grains.assembly import Assembly
from dem.laws import dispatch
from dem.laws.dispatch import FAMILIES, between
from matter.compilation.law_family import Family
from pipeline.case import bibliography
from tests.dem.scenes import grains

LISTED = [(family, number) for family in FAMILIES for number in range(family.first, len(family.names))]
GRAIN = {"friction": 0.0, "restitution_tangential": 1.0}
BODIES = Bodies(1e4, 0.5, 0.4, 1.0, 2.0 / 3.0, 0.0)


def title(case):
    return Family.title(case[0].module(case[1])) if isinstance(case, tuple) else None


def contact_of(normal: str, cohesion: str = "none", restitution: float = 1.0, **changes) -> Contact:
    """A contact of these laws, with the values that their files give as an example."""
    taken = [
        dispatch.NORMAL.module(dispatch.NORMAL.kind(normal)),
        dispatch.COHESION.module(dispatch.COHESION.kind(cohesion)),
    ]
    example = {key: value for law in taken for key, value in getattr(law, "EXAMPLE", {}).items()}
    grain = GrainLaw(**{**example, **GRAIN, "restitution": restitution})
    return Contact(shell=grain, normal=normal, cohesion=cohesion, overlap_stop=1.5, **changes)


def test_every_file_of_the_folder_is_listed_in_the_family_that_its_name_begins_with():
    files = {info.name for info in pkgutil.iter_modules(laws.__path__)} - {"dispatch"}
    # nothing in a case chooses it: the shock stage's choice goes on (tests/dem/test_vibration.py)
    assert files == {title(case) for case in LISTED} | {"shaken_friction"}
    assert all(title((family, number)).startswith(family.prefix) for family, number in LISTED)


def test_a_case_can_name_every_law_of_a_family_that_has_several():
    for family in FAMILIES:
        if len(family.names) > 1 and family is not dispatch.TANGENTIAL:
            assert typing.get_args(Contact.model_fields[family.key].annotation) == family.names
    assert {law.TANGENTIAL for law in dispatch.NORMAL.laws} == set(dispatch.TANGENTIAL.names)


@pytest.mark.parametrize("case", LISTED, ids=title)
def test_a_law_file_has_a_source_the_words_of_other_codes_and_bounded_values(case):
    module = case[0].module(case[1])
    assert all(word in module.__doc__ for word in ("Source:", "LIGGGHTS", "LAMMPS"))
    assert module.SOURCES and set(module.SOURCES) <= set(bibliography.entries())
    adapter = TypeAdapter(module.Parameters)
    adapter.validate_python({})
    with pytest.raises(ValidationError):
        adapter.validate_python({module.Parameters._fields[0]: -1.0})


@pytest.mark.parametrize("law", dispatch.TANGENTIAL.laws, ids=Family.title)
def test_a_tangential_law_whose_springs_follow_the_contact_says_what_stays(law):
    goes_with = {one.TANGENTIAL: name for name, one in zip(dispatch.NORMAL.names, dispatch.NORMAL.laws)}
    contact = contact_of(goes_with[Family.title(law).removeprefix("tangential_")])
    assert (contact.scheme().rescale > 0) == hasattr(law, "retained_fraction") == (not contact.linear)


def test_the_keys_of_a_grain_are_those_of_the_laws_and_mean_one_thing():
    kinds, defaults = {}, {}
    for family, number in LISTED:
        law = family.module(number).Parameters
        assert set(law._field_defaults) == set(law._fields), "a key of a grain needs a default"
        for key, kind in typing.get_type_hints(law, include_extras=True).items():
            ranges = {str(part.metadata) for part in typing.get_args(kind) if hasattr(part, "metadata")}
            assert (
                kinds.setdefault(key, ranges) == ranges
                and defaults.setdefault(key, law._field_defaults[key]) == law._field_defaults[key]
            )
    assert set(GrainLaw.model_fields) == set(kinds)
    assert GrainLaw().model_dump() == defaults
    assert all(field.description for field in GrainLaw.model_fields.values())


@pytest.mark.parametrize("normal", dispatch.NORMAL.names)
def test_a_normal_spring_holds_the_work_that_was_done_on_it(normal):
    contact = contact_of(normal)
    row, kind = contact.pair_table()[0, 0, NORMAL], contact.kind(dispatch.NORMAL)
    force = lambda x: dispatch.elastic_force(kind, x, dispatch.stiffness(kind, row, x, BODIES))  # noqa: E731
    for x in (1e-4, 0.01, 0.1):
        held = dispatch.elastic_energy(kind, x, dispatch.stiffness(kind, row, x, BODIES))
        assert held == pytest.approx(quad(force, 0.0, x, epsabs=0.0)[0], rel=1e-8) and held > 0.0
        rate = (force(x * (1 + 1e-6)) - force(x * (1 - 1e-6))) / (2e-6 * x)
        assert dispatch.stiffness(kind, row, x, BODIES) == pytest.approx(rate, rel=1e-6)
        assert dispatch.normal_force(kind, x, 0.0, dispatch.stiffness(kind, row, x, BODIES), 1.0) == pytest.approx(
            force(x), rel=1e-14
        )


@pytest.mark.parametrize("cohesion", dispatch.COHESION.names[1:])
@pytest.mark.parametrize("second", [2.0 / 3.0, 0.0], ids=["two spheres", "a wall"])
def test_what_binds_a_contact_is_the_work_of_its_pull(cohesion, second):
    contact = contact_of("hooke", cohesion)
    row, kind = contact.pair_table()[0, 0, COHESION], contact.kind(dispatch.COHESION)
    bodies = BODIES._replace(second=second)
    for x in (1e-4, 0.01, 0.1):
        work = quad(lambda s: dispatch.pull(kind, row, s, bodies), 0.0, x, epsabs=0.0)[0]
        assert dispatch.binding_energy(kind, row, x, bodies) == pytest.approx(work, rel=1e-6) and work > 0.0
        assert dispatch.pull(kind, np.zeros_like(row), x, bodies) == 0.0  # a frictionless wall, whose numbers are zero
    constant = hasattr(contact.law(dispatch.COHESION), "constant_pull")
    assert constant == (dispatch.pull(kind, row, 1e-4, bodies) == dispatch.pull(kind, row, 0.1, bodies))
    if constant and second:
        equal = BODIES._replace(radius=0.5, first=1.0, second=1.0)
        assert contact.constant_pull(np.array([1.0]))[0] == pytest.approx(dispatch.pull(kind, row, 0.01, equal))


def _elastic_pairs():
    """Every normal law without cohesion; the rest with the slow tests (``test_cohesion`` has clusters that stick)."""
    for cohesion in dispatch.COHESION.names:
        for normal in dispatch.NORMAL.names:
            first = cohesion == dispatch.COHESION.names[0]
            yield pytest.param(cohesion, normal, marks=() if first else pytest.mark.validation)


@pytest.mark.parametrize("cohesion,normal", list(_elastic_pairs()))
def test_an_elastic_pair_keeps_its_energy(cohesion, normal):
    contact = contact_of(normal, cohesion, steps_per_contact=200)
    scene = grains(
        [[0, 0, 0], [2.001, 0, 0]],
        mass=[100.0, 100.0],
        stiffness=[1e6, 1e6],
        velocity=np.array([[0.0, 0, 0], [-3.0, 0, 0]]),
    )
    pair = Assembly(scene, contact)
    start, deepest = sum(pair.energies().values()), 0.0
    while pair.time < 3.0 and (pair.contacts or pair.velocity[1, 0] < pair.velocity[0, 0]):
        pair.step()
        deepest = max(deepest, pair.worst)
        assert sum(pair.energies().values()) == pytest.approx(start, rel=2e-3)
    assert deepest > 0.01 and not pair.contacts
    assert np.linalg.norm(pair.velocity[1] - pair.velocity[0]) == pytest.approx(3.0, rel=2e-3)


@pytest.mark.parametrize("normal", dispatch.NORMAL.names)
@pytest.mark.parametrize("restitution", [0.3, 0.7])
def test_a_pair_rebounds_with_the_restitution_that_was_asked_for(normal, restitution):
    contact = contact_of(normal, restitution=restitution, steps_per_contact=200)
    scene = grains(
        [[0, 0, 0], [2.001, 0, 0]],
        mass=[100.0, 100.0],
        stiffness=[1e6, 1e6],
        velocity=np.array([[0.0, 0, 0], [-1.0, 0, 0]]),
    )
    pair = Assembly(scene, contact)
    while pair.time < 3.0 and (pair.contacts or pair.velocity[1, 0] < pair.velocity[0, 0]):
        pair.step()
    assert pair.velocity[1, 0] - pair.velocity[0, 0] == pytest.approx(restitution, rel=0.01)


@pytest.mark.parametrize("normal", dispatch.NORMAL.names)
@pytest.mark.parametrize("cohesion", dispatch.COHESION.names)
def test_the_table_of_pairs_holds_the_rows_of_the_laws(normal, cohesion):
    contact = contact_of(normal, cohesion)
    table = contact.pair_table()
    assert table.shape == (2, 2, PAIR_COLUMNS) and PAIR_COLUMNS == COHESION.stop
    for family, columns in ((dispatch.NORMAL, NORMAL), (dispatch.COHESION, COHESION)):
        numbers = between(contact.law(family), *(contact.values(family, 0),) * 2) if contact.law(family) else ()
        assert (
            tuple(table[0, 0, columns][: len(numbers)]) == numbers and not table[0, 0, columns][len(numbers) :].any()
        )


def test_a_contact_at_rest_pushes_with_its_spring_less_its_pull():
    for normal in dispatch.NORMAL.names:
        for cohesion in dispatch.COHESION.names:
            contact = contact_of(normal, cohesion)
            row, scheme = contact.pair_table()[0, 0], contact.scheme()
            k, push = at_rest(np.array([0.01]), np.array([[1.0, 2.0 / 3.0]]), np.array([1e4]), row[None], scheme)
            assert k[0] == dispatch.stiffness(scheme.normal, row[NORMAL], 0.01, BODIES)
            held = dispatch.elastic_force(scheme.normal, 0.01, k[0]) - dispatch.pull(
                scheme.cohesion, row[COHESION], 0.01, BODIES
            )
            assert push[0] == pytest.approx(held, rel=1e-12)


def test_a_strength_and_a_law_of_cohesion_come_together():
    for name in dispatch.COHESION.names[1:]:
        with pytest.raises(ValueError, match=rf'cohesion = "{name}" needs shell\.(\w+) or ocean\.\1 above zero'):
            Contact(cohesion=name)
    with pytest.raises(ValueError, match='shell: cohesion is given, but cohesion = "none" names no law for it'):
        Contact(shell=GrainLaw(cohesion=1.0))


def test_every_law_that_is_not_taken_is_idle(tmp_path):
    from dem.used_contact_laws import _laws

    for family, number in LISTED:
        if family.key in ("normal", "cohesion"):
            contact = contact_of(
                family.names[number] if family.key == "normal" else "hooke",
                family.names[number] if family.key == "cohesion" else "none",
            )
            idle = {path.stem for path in _laws(contact)}
            assert title((family, number)) not in idle
            assert {title((family, k)) for k in range(family.first, len(family.names)) if k != number} <= idle


def test_the_files_are_importable_by_their_names():
    for case in LISTED:
        assert importlib.import_module(f"dem.laws.{title(case)}") is case[0].module(case[1])
