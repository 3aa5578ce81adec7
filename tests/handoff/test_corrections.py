"""The regional correction and the kernel mapping beside the defaults; what the ledger says about layers and peculiar
motion."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from fixtures import flows
from handoff import compare, correction, interpolation


def test_splines_are_a_partition_of_unity_and_blend_constants():
    rng = np.random.default_rng(2)
    place = rng.uniform(-3.0, 5.0, (4000, 3))
    mass = rng.uniform(0.5, 1.5, 4000)
    push = np.array([1.0, -2.0, 0.5])
    change = correction.regional_field(place, mass, mass[:, None] * push, place[:200], 2.0)
    np.testing.assert_allclose(change, np.tile(push, (200, 1)), rtol=1e-9)


def test_a_regional_lack_is_closed_where_it_is():
    rng = np.random.default_rng(3)
    place = rng.uniform(0.0, 20.0, (30_000, 3))
    mass = np.ones(30_000)
    lacking = np.where(place[:, :1] < 10.0, 1.0, -1.0) * np.array([[0.0, 0.3, 0.0]])
    change = correction.regional_field(place, mass, lacking, place, 4.0)
    left = lacking - mass[:, None] * change
    for here in (place[:, 0] < 8.0, place[:, 0] > 12.0):
        assert np.abs(left[here].sum(axis=0)).max() < 0.03 * np.abs(lacking[here].sum(axis=0)).max()
    assert np.abs(change).max() < 0.4  # no region pays for another


@pytest.fixture(scope="module", params=["vortices", "z_model"])
def ways(request, flat_bed):
    rules = {
        "nearest": {"mapping": "nearest"},
        "regional": {"mapping": "nearest", "correction": "regional"},
        "kernel": {"mapping": "kernel"},
        "linear": {},
    }
    return request.param, {name: flows.handed(request.param, 10.0, flat_bed, **rule) for name, rule in rules.items()}


def test_the_regional_correction_closes_locally_and_all_close_globally(ways, flat_bed):
    _, made = ways
    local = {}
    for name, (_, handoff, ledger) in made.items():
        assert (
            ledger["momentum_linear_rel_after"]["value"] < 1e-10
            and ledger["momentum_angular_rel_after"]["value"] < 1e-10
        )
        local[name] = ledger["momentum_local_after_rel"]["value"]
        assert "regional part of it: at most" in ledger["momentum_local_after_rel"]["note"]
        assert (np.abs(handoff.mapped.regional).max() > 0.0) == (name == "regional")
    assert local["regional"] < 0.75 * local["nearest"]  # measured: 0.69 (vortices), below 0.6 (Z model)
    assert local["linear"] < local["nearest"]


def test_kernel_interpolation_lies_between_nearest_and_linear(ways):
    name, made = ways
    error = {way: flows.against_the_truth(name, handoff) for way, (_, handoff, _) in made.items()}
    assert error["linear"] < error["kernel"] < 1.2 * error["nearest"]


def test_kernel_mean_is_exact_for_constants_only():
    rng = np.random.default_rng(1)
    points, volume = rng.random((500, 3)), rng.uniform(0.5, 2.0, 500)
    query = rng.uniform(0.2, 0.8, (40, 3))
    tree = cKDTree(points)
    constant = interpolation.kernel_mean(tree, np.tile([1.0, 2.0, 3.0], (500, 1)), volume, query, 30)
    np.testing.assert_allclose(constant, np.tile([1.0, 2.0, 3.0], (40, 1)), rtol=1e-12)
    linear = interpolation.kernel_mean(tree, points, volume, query, 30)
    assert 1e-3 < np.abs(linear - query).max() < 0.1


def test_peculiar_motion_is_split_off(flat_bed):
    """Random velocities on top of a translation: what the cells average away is found, within the noise of what they
    keep."""
    _, made, ledger = flows.handed("translation", 10.0, flat_bed)
    bulk, peculiar = ledger["kinetic_energy_bulk"]["value"], ledger["kinetic_energy_peculiar"]["value"]
    assert peculiar < 1e-9 * bulk
    fields, rng = made.mapped.fields, np.random.default_rng(4)
    count = len(made.compact.places)
    noise = rng.normal(size=(count, 3))
    noisy = compare.Fields(
        fields.samples,
        fields.mass_before,
        fields.mass_after,
        fields.velocity_before + noise[fields.samples.particle],
        fields.velocity_after,
    )
    bulk, peculiar = compare.energy_split(noisy, made.carving.receiver)
    inside = made.carving.receiver >= 0
    added = 0.5 * np.sum(fields.mass_before[inside] * np.sum(noise[fields.samples.particle[inside]] ** 2, axis=1))
    assert 0.1 * added < peculiar < added


def test_layers_keep_their_volumes(flat_bed):
    _, _, ledger = flows.handed("shear", 10.0, flat_bed)
    assert abs(ledger["layer_volume_rel_ice"]["value"]) < 0.01
    assert ledger["layer_volume_rel_ice"]["limit"] is None
