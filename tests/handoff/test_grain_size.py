"""A bed whose grains grow outwards is judged by the grains that carry its crater."""

import numpy as np
import pytest

from fixtures import clouds
from fixtures.clouds import ARC_FLAT
from handoff.ledger_rows import account
from handoff.source import cloud_surface, grain_size
from handoff.transfer import transfer
from matter.errors import InputError


def said(bed, **grading):
    told = bed.select(np.ones(len(bed), dtype=bool))
    told.tables = bed.tables
    told.attributes["grading"] = grading
    return told


def test_the_size_is_that_at_the_impact_where_the_bed_says_it(flat_bed):
    assert grain_size.at_impact(flat_bed) == pytest.approx(flat_bed.radius.mean())
    assert grain_size.at_impact(said(flat_bed, radius_m=0.7)) == 0.7
    for wrong in ({}, {"radius_m": 0.0}, {"radius_m": float("nan")}):
        with pytest.raises(InputError, match="'grading' says a radius_m"):
            grain_size.at_impact(said(flat_bed, **wrong))


def test_the_ledger_counts_in_grains_at_the_impact_and_says_how_far_the_bed_reaches(flat_bed, ground):
    source = clouds.bowl_source()
    bed = said(flat_bed, radius_m=0.8)
    handed = transfer.hand_over(source, bed, cloud_surface.Rules(), ground)
    ledger, hole = account.ledger_of(handed, source, bed, ground, {}), handed.carving.size.radius
    assert ledger["cavity_radius_over_r_DEM_min"]["value"] == pytest.approx(hole / 0.8)
    assert ledger["bed_radii"]["value"] == pytest.approx(ARC_FLAT / hole)
