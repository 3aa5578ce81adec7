"""Variants of shipped cases: where their runs lie, what is made again, and that every one of the example scripts
composes."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path

import pytest

from matter.errors import InputError
from pipeline.settings.compose import compose
from studies.winter_2017 import variants as sweep

ROOT = Path(__file__).resolve().parents[2]


def script(name: str):
    spec = importlib.util.spec_from_file_location(name, ROOT / "studies" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def all_variants() -> list:
    claims, convergence = script("valhalla_claims"), script("valhalla_convergence")
    return [*claims.matrix("quick"), *claims.matrix("thesis"), *convergence.variants()]


@pytest.mark.parametrize("variant", all_variants(), ids=lambda v: f"{v.preset}-{v.name}")
def test_every_variant_composes(variant):
    assert compose(variant.read())["sph"].end_time > 0


def test_the_matrix_holds_every_run_that_a_claim_needs():
    from studies.winter_2017 import valhalla

    variants = script("valhalla_claims").matrix("quick")
    assert {name for claim in valhalla.CLAIMS for name in claim.needs} <= {v.name for v in variants}
    assert len({v.run_folder(Path("runs")) for v in variants}) == len(variants)


def test_equal_energy_holds_in_the_matrix():
    variants = {v.name: v for v in script("valhalla_claims").matrix("quick")}
    for case in ("350", "980"):
        energy = {}
        for name in ("base", "v1", "v3", "v4"):
            impact = compose(variants[f"{case}_{name}"].read())["sph"].impact
            energy[name] = impact.projectile.radius**3 * impact.speed**2
        assert [energy[n] / energy["base"] for n in energy] == pytest.approx([1.0] * 4, rel=2e-3)


def test_names_are_chosen_in_their_own_order_and_misspelt_ones_are_told():
    variants = script("valhalla_claims").matrix("quick")
    assert [v.name for v in sweep.chosen(variants, ["980_base", "350_base"])] == ["350_base", "980_base"]
    assert len(sweep.chosen(variants, None)) == len(variants)
    with pytest.raises(InputError, match="did you mean '350_base'"):
        sweep.chosen(variants, ["350_bse"])


def test_an_unfinished_run_is_not_measured_and_a_finished_one_once(tmp_path, monkeypatch):
    from crater import stage
    from studies.winter_2017 import follow_run

    variant = sweep.Variant("350_base", ROOT / "cases" / "valhalla_350km", "quick")
    assert sweep.measure(variant, tmp_path) is None
    place = variant.run_folder(tmp_path) / "2_sph"
    place.mkdir(parents=True)
    (place / "done.json").write_text(json.dumps({"inputs_sha256": "abc"}))
    asked: list[float] = []
    monkeypatch.setattr(
        stage, "run", lambda settings, inputs, out: (out / "measures.json").write_text('{"transient": {}}')
    )
    monkeypatch.setattr(follow_run, "write", lambda run, radius, time, out: asked.append(radius))
    assert sweep.measure(variant, tmp_path) == tmp_path / "measured" / "350_base"
    sweep.measure(variant, tmp_path)
    assert asked == [175e3]  # half of the expected diameter, once
    assert (tmp_path / "measured" / "350_base" / "run" / "2_sph").resolve() == place.resolve()
    (place / "done.json").write_text(json.dumps({"inputs_sha256": "other"}))
    sweep.measure(variant, tmp_path)
    assert len(asked) == 2
