"""What a snapshot records of the region that its grains fill, and what is refused of it."""

import pytest

from matter.errors import InputError
from matter.geometry.ground_region import Cone, Upright

CONE = Cone(5.0, 9.0, 10.0, 0.3, 0.8, 2.0, 1)
BOX = Upright("box", 9.0, -6.0, 1.5, 0.0, 0.7, 3.0, 0, 1)


@pytest.mark.parametrize("region", [CONE, BOX, Upright("bowl", 9.0, -9.0, 1.5)])
def test_a_region_is_read_as_it_was_written(region):
    assert type(region).of_attribute(region.as_attribute()) == region


def test_the_keys_of_files_stay():
    assert CONE.as_attribute() == {
        "core_radius_m": 5.0, "datum_radius_m": 9.0, "top_radius_m": 10.0, "cone_half_angle_rad": 0.3,
        "damped_width_m": 0.8, "damping_rate_1_s": 2.0, "core_species": 1, "arc_radius_m": 0.3 * 9.0,
    }  # fmt: skip
    assert BOX.as_attribute() == {
        "shape": "box", "radius_m": 9.0, "floor_m": -6.0, "top_m": 1.5, "datum_m": 0.0, "damped_width_m": 0.7,
        "damping_rate_1_s": 3.0, "floor_species": 0, "side_species": 1,
    }  # fmt: skip


@pytest.mark.parametrize("region", [CONE, BOX])
def test_a_bed_made_elsewhere_need_only_say_where_it_ends(region):
    table = region.as_attribute()
    bare = {key: table[key] for key in ("shape", *region.GEOMETRY) if key in table}
    read = type(region).of_attribute(bare, region.GEOMETRY)
    assert (read.volume, read.damping_rate, read.floor_species) == (region.volume, 0.0, -1)
    with pytest.raises(InputError, match="lacks damped_width_m, damping_rate_1_s"):
        type(region).of_attribute(bare)


@pytest.mark.parametrize(
    "region,wrong",
    [
        (CONE, {"core_radius_m": 9.0}), (CONE, {"top_radius_m": 8.9}), (CONE, {"cone_half_angle_rad": 3.2}),
        (CONE, {"cone_half_angle_rad": 0.0}), (BOX, {"radius_m": 0.0}), (BOX, {"floor_m": 0.0}),
    ],
)  # fmt: skip
def test_numbers_that_bound_no_volume_are_refused(region, wrong):
    with pytest.raises(InputError, match="bounds no volume"):
        type(region).of_attribute(region.as_attribute() | wrong)
