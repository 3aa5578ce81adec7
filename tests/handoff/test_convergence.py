"""What the handoff must show on known flows and shapes, against resolution (minutes: ``pytest -m validation
tests/handoff/test_convergence.py``)."""

import pytest

from fixtures import flows, shapes

COUNTS = (5.0, 7.0, 10.0, 14.0)


@pytest.fixture(scope="module")
def table():
    rows = {name: [] for name in flows.FIELDS}
    for count in COUNTS:
        grains = flows.bed(count)
        for name, kept in rows.items():
            kept.append(flows.measured(name, count, grains))
    return rows


@pytest.mark.validation
@pytest.mark.parametrize("name", flows.FIELDS)
def test_the_limits_hold_at_ten_grains_per_radius(table, name):
    row = table[name][COUNTS.index(10.0)]
    for key, limit in {"p_raw": 1e-2, "L_raw": 2e-2, "field_L2": 0.05, "p_after": 1e-10, "L_after": 1e-10}.items():
        assert row[key] < limit, (key, row[key])


@pytest.mark.validation
@pytest.mark.parametrize("name", ["z_model", "vortices"])
def test_fields_converge_with_first_order(table, name):
    """Linear flows come out exactly up to the correction: only curved ones have an order."""
    for key in ("truth", "field_L2"):
        assert flows.order(COUNTS, [row[key] for row in table[name]]) >= 1.0, key


@pytest.mark.validation
@pytest.mark.parametrize("kind", shapes.KINDS)
@pytest.mark.parametrize("shape", shapes.SHAPES)
def test_shapes_at_twenty_grains_per_radius(shape, kind):
    row = shapes.measured(shape, kind, 20.0, shapes.bed(20.0))
    assert abs(row["bed_volume_rel"]) < 0.02 and row["bed_against_source"] < 0.02 and row["hausdorff_over_r"] < 1.5
    assert row["watertight"] and row["mass_raw"] < 1e-2
    assert (row["ejecta"] >= 400) == (shape == "rim and curtain")
