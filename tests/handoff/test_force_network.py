import numpy as np
import pytest

from handoff.transfer import force_network
from matter.errors import InputError
from matter.particles import Particles


def row_of_spheres(**more) -> Particles:
    fields = {
        "position": [[0, 0, 0], [1.9, 0, 0], [3.7, 0, 0], [9, 0, 0]],
        "radius": np.ones(4),
        "stiffness": [10.0, 20.0, 30.0, 30.0],
    }
    return Particles(fields | more)


def test_forces_are_the_softer_stiffness_times_the_overlap():
    net = force_network.measure(row_of_spheres())
    order = np.argsort(net.force)
    np.testing.assert_allclose(net.force[order], [10.0 * 0.1, 20.0 * 0.2])
    assert {frozenset(pair) for pair in zip(net.one.tolist(), net.other.tolist())} == {
        frozenset((0, 1)),
        frozenset((1, 2)),
    }
    assert net.mean == pytest.approx(2.5) and net.contacts_per_grain == pytest.approx(1.0)
    assert 1.0 < net.spread <= 4.0 / 2.5


def test_only_grains_in_contact_search_count():
    net = force_network.measure(row_of_spheres(state=[0, 0, 1, 0]))
    assert len(net.force) == 1 and net.grains == 3 and set((net.one[0], net.other[0])) == {0, 1}
    alone = force_network.measure(row_of_spheres(state=[0, 1, 1, 0]))
    assert alone.mean == alone.spread == 0.0
    with pytest.raises(InputError, match="stiffness"):
        force_network.measure(Particles({"position": np.eye(3), "radius": np.ones(3)}))


def test_offsets_of_contacts_count():
    """A bed that settled in springs of 10 N/m and was stiffened a hundredfold: the same forces, a hundredth of each
    overlap."""
    soft = row_of_spheres(identity=[7, 3, 9, 1])
    stiff = row_of_spheres(identity=[7, 3, 9, 1], stiffness=[1000.0, 2000.0, 3000.0, 3000.0])
    pair = np.array([[3, 7], [3, 9]])
    history = np.zeros((2, 8))
    history[:, 7] = [0.1 / 100.0 - 0.1, 0.2 / 100.0 - 0.2]
    stiff.tables.update({"contacts/pair": pair, "contacts/history": history})
    np.testing.assert_allclose(np.sort(force_network.measure(stiff).force), np.sort(force_network.measure(soft).force))
    # an offset beyond the overlap: no force; a history without the column: the bare overlaps
    history[1, 7] = -0.3
    assert len(force_network.measure(stiff).force) == 1
    stiff.tables["contacts/history"] = history[:, :7]
    assert force_network.measure(stiff).mean == pytest.approx(250.0)
