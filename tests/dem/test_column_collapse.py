"""Columns that collapse: their measures against closed forms, verdicts on columns that obey the laws, and the friction
that the map gives, and what the floor does. That grains run out is told by ``test_bulk.py``."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from studies import column_collapse as study
from studies.granular import collapsed_column
from studies.granular.collapsed_column import Column

MAP = Path(study.__file__).parents[1] / "docs" / "results" / "dem_friction_angle" / "map.json"


def lawful(plan: study.Plan) -> Column:
    """A column that does what the experiments say."""
    height = min(plan.aspect, 0.74) if plan.material == "beads" else 0.88 * plan.aspect ** (1.0 / 6.0)
    return Column(
        plan.aspect, collapsed_column.runout_by_law(plan.aspect), collapsed_column.runout_by_law(plan.aspect), height,
        height, 1.0, 16_000, plan.radius, 0.6, height / plan.aspect, 59.0, 5.0, 3.0, 0.0, 0.0,
        [0.5, 1.5], [plan.radius * height, 0.5],
    )  # fmt: skip


def test_a_cone_is_known_by_what_it_holds():
    """A whole cone holds a third of its cylinder; a cut one of half the top radius 7/12 of a frustum's cylinder."""
    assert collapsed_column.of_cone(2.0, 2.0) == pytest.approx(1.0 / 3.0)
    assert collapsed_column.of_cone(2.0, 1.0) == pytest.approx(7.0 / 12.0)
    assert collapsed_column.of_cone(1.0, 2.0) == pytest.approx(1.0 / 6.0)
    for aspect in (0.5, 2.0, 4.0):
        for slope in (0.6, 1.7, 5.0):
            assert collapsed_column.cone(collapsed_column.of_cone(slope, aspect), aspect) == pytest.approx(
                math.degrees(math.atan(slope))
            )
    assert collapsed_column.cone(0.0, 1.0) == 0.0 and collapsed_column.cone(1.0, 1.0) == 90.0


def test_the_front_arrives_when_its_way_is_nearly_done():
    times = list(np.arange(0.0, 10.0, 0.25))
    reach = [10.0 + 5.0 * min(1.0, t / 4.0) for t in times]
    assert collapsed_column.arrival(times, reach) == pytest.approx(3.92, abs=1e-6)


def test_the_friction_is_that_of_the_map():
    """mu_s of the beads by the straight line between the map's points, the sand at its steepest point."""
    rows = [row for row in json.loads(MAP.read_text()) if row["shape"] == 0.4 and row["friction"] > 0.0]
    low, high = sorted(rows, key=lambda row: row["friction"])[:2]
    friction = np.interp(22.0, [low["angle_deg"], high["angle_deg"]], [low["friction"], high["friction"]])
    assert study.CONTACTS["beads"].shell.friction == pytest.approx(friction, abs=0.001)
    assert study.CONTACTS["beads"].shell.shape == 0.4
    steepest = max(json.loads(MAP.read_text()), key=lambda row: row["angle_deg"])
    sand = study.CONTACTS["sand"].shell
    assert (sand.friction, sand.shape) == (steepest["friction"], steepest["shape"])


def test_columns_that_obey_the_laws_are_met(tmp_path):
    """Each verdict is turned by what it is about, and no other."""
    made = {plan: lawful(plan) for plan in study.PLAN}
    names = set(study.CLAIMS)

    def met(columns: study.Columns) -> set[str]:
        return {name for name, found in study.judged(columns).items() if found.met}

    assert met(made) == names
    for plan, changed, lost in (
        (study.BEADS[0.5], {"kept": 0.94}, {"V37"}),
        (study.BEADS[1.0], {"runout": 0.8}, {"V32", "V34", "V36"}),
        (study.BEADS[4.0], {"runout": 2.4}, {"V33", "V35", "V36", "V43"}),
        (study.BEADS[4.0], {"height": 1.0}, {"V38"}),
        (study.SAND[4.0], {"height": 1.4}, {"V39"}),
        (study.BEADS[2.0], {"cone_deg": 40.0}, {"V40"}),
        (study.BEADS[2.0], {"arrival": 6.0}, {"V41"}),
        (study.BEADS[4.0], {"foot_deg": 8.0}, {"V42"}),
        (study.SAND[2.0], {"runout": 1.7}, {"V43"}),
    ):
        assert names - met(made | {plan: made[plan]._replace(**changed)}) == lost
    study.draw_columns(made, tmp_path / "columns.png")
    assert (tmp_path / "columns.png").stat().st_size > 10_000


def test_of_claims_without_their_columns_there_is_none():
    some = {plan: lawful(plan) for plan in study.PLAN[:2]}
    assert set(study.judged(some)) == {"V32", "V34", "V37"}
    assert all(math.isnan(found.error) for found in study.judged(some).values())
    twice = {plan: lawful(plan) for plan in study.PLAN}
    twice[study.SEEDS[1]] = twice[study.SEEDS[1]]._replace(runout=1.1 * 1.24)
    scatter = 0.1 / math.sqrt(2.0) / 1.05
    assert study.judged(twice)["V33"].error == pytest.approx(scatter / math.sqrt(2.0))
    assert study.judged(twice)["V35"].error == pytest.approx(scatter / (math.log(2.0) / math.sqrt(2.0)))


def test_a_rough_floor_holds_what_a_smooth_one_lets_slide():
    """Beads on a plane with their own mu_s of 0.188 slide off before they yield among themselves."""
    smooth, rough = (
        collapsed_column.column(0.6, 7.0, study.CONTACTS["beads"], floor=floor)
        for floor in (None, collapsed_column.ROUGH)
    )
    assert rough.runout < 0.7 * smooth.runout
    assert rough.cone_deg > smooth.cone_deg + 10.0
