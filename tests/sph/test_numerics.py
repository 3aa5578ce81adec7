"""The named sets of numerics: what each chooses, and what goes before it."""

import json

import pytest

from matter.case.body import Impact, Target
from pipeline.case import keys
from sph import cost_prediction
from sph.settings import Settings
from sph.stepping.numerics import SETS, Numerics

MONAGHAN = {
    "alpha": 2.0, "beta": 10.0, "courant": 0.3, "kernel": "cubic_spline", "support": 2.0, "gradients": "plain",
    "conductivity": 0.0,
}  # fmt: skip
"""What results kept under this name were made with: it never changes."""


def test_monaghan_is_what_kept_results_stand_on():
    got = Numerics(numerics="monaghan")
    assert {key: getattr(got, key) for key in MONAGHAN} == MONAGHAN
    assert not got.scheme.reconstructed and got.limits_of_length is None and got.gradient_scale == 1.0


def test_reconstructed_is_compiled_for_its_viscosity_and_first_volumes():
    got = Numerics(numerics="reconstructed")
    assert got.scheme.reconstructed and got.limits_of_length == (0.7, 2.0)
    assert got.gradient_scale == pytest.approx(1.006, abs=0.002)


def test_the_prediction_knows_what_a_set_costs():
    """V05 at 20,085 particles: 862 steps, some 45 s of one core; a step costs 3.5 times that of the former set, and
    there are 0.39 times as many."""
    layer = {"name": "sphere", "material": "basalt", "thickness": 0.03}
    target = Target.model_validate({"start": "literal", "self_gravity": False, "layers": [layer]})
    ball = {
        "speed": 3200.0,
        "angle_from_vertical": 0.5,
        "expected_transient_diameter": 0.03,
        "projectile": {"material": "nylon", "radius": 3.43e-3},
    }
    size = {"spacing_at_impact": 1.78e-3, "spacing_far": 1.78e-3, "end_time": 60e-6, "contact_refinement": 1.0}
    former, new = (
        Settings(target=target, impact=Impact.model_validate(ball), numerics=name, **size)
        for name in ("monaghan", "reconstructed")
    )
    assert cost_prediction.per_step(new) / cost_prediction.per_step(former) == pytest.approx(3.5, rel=0.02)
    assert cost_prediction.steps(new)[1] == pytest.approx(862, rel=0.25)
    assert cost_prediction.step(new) / cost_prediction.step(former) == pytest.approx(2.595, rel=0.01)


@pytest.mark.parametrize("name", SETS)
def test_single_keys_go_before_the_set(name):
    got = Numerics(numerics=name, alpha=1.25, gradients="corrected")
    assert (got.alpha, got.gradients) == (1.25, "corrected") and got.beta == SETS[name]["beta"]


@pytest.mark.parametrize("other", [{"viscosity_switch": "morris_monaghan"}, {"gradients": "corrected"}])
def test_conductivity_goes_with_the_viscosity_that_knows_the_smooth_flow(other):
    assert Numerics(numerics="reconstructed").conductivity == 8.0
    got = Numerics(numerics="reconstructed", **other)
    assert got.conductivity == 0.0 and not got.scheme.conducting


def test_the_description_of_the_key_says_what_the_sets_choose():
    said = keys.text_of(Settings.model_fields["numerics"].description)
    for name, chosen in SETS.items():
        part = said.split(f"`{name}`: ")[1]
        assert part.startswith(
            ", ".join(
                f"{key} = "
                f"{json.dumps(value if not isinstance(value, float) else float(f'{value:g}')).removesuffix('.0')}"
                for key, value in chosen.items()
            )
        )
