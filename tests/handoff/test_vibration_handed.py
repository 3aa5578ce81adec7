"""The vibration that grains take over from a cloud, and its energy."""

from __future__ import annotations

import numpy as np
import pytest

from fixtures import clouds
from fixtures.clouds import ARC_FLAT as ARC
from fixtures.clouds import DEPTH
from fixtures.flows import FIELDS, hemisphere
from handoff.ledger_rows import account
from handoff.source import cloud_surface
from handoff.transfer import direct, shaken_matter, transfer
from matter.files import snapshot

DECAY = {"ice": {"decay_time_s": 12.0, "sound_m_s": 3000.0}}
SPACING = 1.3


def speed_at(position):
    """50 m/s at the middle, half of that at every further 8 m."""
    return 50.0 * 0.5 ** (np.linalg.norm(position, axis=1) / 8.0)


def shaken(shaking: bool = True):
    """Ice under a bowl that shakes, broken but for what lies on one side."""
    source = clouds.flat_source(SPACING, ARC, DEPTH, hemisphere, FIELDS["translation"], density=1100.0)
    source["damage"] = np.where(source.position[:, 0] > -12.0, 1.0, 0.5)
    source["velocity"][:40] = [0.0, 0.0, 900.0]  # 40 particles of ejecta
    if shaking:
        source["vibration"] = speed_at(source.position)
        source.attributes["block_model"] = DECAY
    return source


@pytest.fixture(scope="module")
def handed(flat_bed, ground):
    source = shaken()
    made = transfer.hand_over(source, flat_bed, cloud_surface.Rules(), ground)
    return source, made, account.ledger_of(made, source, flat_bed, ground, {})


def test_a_grain_shakes_as_the_matter_around_it_does(handed):
    """Broken matter as it is; of matter half broken D^2 = 1/4 acts, and that is what grains, all broken, are given."""
    _, made, _ = handed
    grains = made.start.select(np.arange(len(made.start) - len(made.ejecta.mass)))
    x = grains.position[:, 0]
    broken, half = x > -12.0 + 2.0 * SPACING, x < -12.0 - 2.0 * SPACING
    assert broken.sum() > 500 and half.sum() > 50
    of_place = grains.vibration / speed_at(grains.position)
    assert np.median(of_place[broken]) == pytest.approx(1.0, abs=0.02) and np.std(of_place[broken]) < 0.1
    assert np.median(of_place[half]) == pytest.approx(0.25, abs=0.01)


def test_ejecta_keep_the_vibration_of_their_particle(handed):
    source, made, _ = handed
    tail = made.start.vibration[-len(made.ejecta.mass) :]
    assert len(tail) >= 40
    np.testing.assert_allclose(tail, shaken_matter.acting(source)[made.ejecta.source], rtol=1e-12)


def test_the_ledger_holds_the_energy_before_and_after(handed):
    source, made, ledger = handed
    weight = np.zeros(len(source))
    weight[made.compact.indices] = source.mass[made.compact.indices] * made.compact.fraction
    weight[made.ejecta.source] += source.mass[made.ejecta.source]
    before = 0.5 * float(weight @ (source.damage**2 * source.vibration) ** 2)
    after = 0.5 * float(made.start.mass @ made.start.vibration**2)
    row = ledger["vibration_energy_rel"]
    assert row["value"] == pytest.approx(after / before - 1.0, rel=1e-9) and abs(row["value"]) < 5e-3
    assert f"{before:.6e} J" in row["note"] and f"{after:.6e} J" in row["note"] and row["limit"] is None


def test_the_start_on_disk_says_how_it_dies_away(handed, tmp_path):
    _, made, _ = handed
    snapshot.write(made.start, tmp_path / "start.vtkhdf")
    start = snapshot.read(tmp_path / "start.vtkhdf")
    assert start.attributes["block_model"] == DECAY
    assert np.array_equal(start.vibration, made.start.vibration)


def test_grains_one_to_one_keep_it_to_the_last_bit(handed, flat_bed, ground):
    source, made, _ = handed
    straight = direct.hand_over(made, source, flat_bed, ground)
    np.testing.assert_allclose(straight.start.vibration, shaken_matter.acting(source)[straight.source], rtol=1e-15)
    assert straight.start.attributes["block_model"] == DECAY


def test_ground_that_does_not_shake_gives_grains_without_the_field(flat_bed, ground):
    source = shaken(shaking=False)
    made = transfer.hand_over(source, flat_bed, cloud_surface.Rules(), ground)
    assert "vibration" not in made.start and "block_model" not in made.start.attributes
    rows = account.ledger_of(made, source, flat_bed, ground, {}).rows
    assert not [row for row in rows if row["name"].startswith("vibration")]
