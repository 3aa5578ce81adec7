"""The last word of a run on the terminal: stage, time and definition with every number."""

from __future__ import annotations

import json

import pytest

from crater.measures import chain
from pipeline.running import result


def q(value, sigma, unit="m", **parts):
    return {"value": value, "sigma": sigma, "unit": unit, "sigma_parts": {"azimuth": 0.8 * (sigma or 0.0), **parts}}


def entry(diameter, depth, time, chain=None, **more):
    parts = {"chain": chain} if chain else {}
    sizes = {
        "diameter_apparent_m": q(diameter, 7e3, **parts),
        "depth_m": q(depth, 8e3),
        "depth_over_diameter": q(depth / diameter, 0.01, "1"),
    }
    return {**sizes, "volume_m3": q(0.39 * diameter**2 * depth, 7e14, "m^3"), "time_s": q(time, 30.0, "s"), **more}


def table(tmp_path, **changes):
    transient = {
        "at_maximum_volume": entry(492.6e3, 235.3e3, 420.0, stage="sph"),
        "at_maximum_depth": entry(475.5e3, 236.6e3, 360.0, stage="sph"),
    }
    content = {
        "transient": {**transient["at_maximum_volume"], **transient},
        "final": entry(569e3, 74e3, 3840.0, settled=True, **{"from": "settled grains"}),
        "reference": [{"name": "transient depth_m", "at": "first maximum of depth, 6.0 min, SPH", "value": 300e3,
        "plus": 51e3, "minus": 51e3, "unit": "m",
                       "source": "Winter 2017", "ours": q(236.6e3, 6.2e3), "met": False}],
    }  # fmt: skip
    (tmp_path / "6_crater").mkdir(parents=True, exist_ok=True)
    (tmp_path / "6_crater" / "measures.json").write_text(json.dumps({**content, **changes}))
    return result.table(tmp_path)


def test_each_column_says_its_stage_and_time(tmp_path):
    lines = table(tmp_path).splitlines()
    assert lines[0].split("  ")[-1].strip() == "final" and lines[0].index("maximum volume") < lines[0].index(
        "maximum depth"
    )
    assert [word in lines[1] for word in ("7.0 min, SPH", "6.0 min, SPH", "64.0 min, settled grains")] == [True] * 3
    depth = next(line for line in lines if line.startswith("depth below the datum"))
    assert [value in depth for value in ("235.3 +- 8.0 km", "236.6 +- 8.0 km", "74.0 +- 8.0 km")] == [True] * 3
    ratio = next(line for line in lines if line.startswith("depth / apparent diameter"))
    assert "0.478" in ratio and "0.130" in ratio


def test_the_published_line_says_at_which_moment_ours_is_taken(tmp_path):
    text = table(tmp_path)
    assert (
        "published transient depth_m: 300 +51 -51 km (Winter 2017); here (first maximum of depth, 6.0 min, SPH) 236.6 "
        "+- 6.2 km: not met" in text
    )


def test_a_crater_that_still_grows_has_no_column_final(tmp_path):
    last = entry(
        1.75e3,
        400.0,
        6.0,
        settled=False,
        state="still growing",
        settled_reason="volume +9%",
        **{"from": "all-SPH late stage"},
    )
    grows = {f"at_maximum_{of}": entry(1.75e3, 400.0, 6.0, stage="sph", growing=True) for of in ("volume", "depth")}
    text = table(tmp_path, transient={**grows["at_maximum_volume"], **grows}, final=last)
    assert "last snapshot, still growing" in text.splitlines()[0] and "transient" not in text.splitlines()[0]
    assert "no final crater yet: volume +9%" in text
    assert not any(line.strip().startswith("final") or " final " in line for line in text.splitlines()[:2])


def test_errors_say_whether_they_hold_the_chain(tmp_path):
    assert "chain error not known" in table(tmp_path)
    assert "errors include the chain error" in table(
        tmp_path, final=entry(569e3, 74e3, 3840.0, chain=3e4, settled=True)
    )


def test_a_number_says_in_its_line_what_its_error_leaves_out(tmp_path):
    text = table(tmp_path, errors_without="without random seeds, resolution")
    depth = next(line for line in text.splitlines() if line.startswith("depth below the datum"))
    assert depth.endswith("74.0 +- 8.0 km   without random seeds, resolution")
    assert "without" not in table(tmp_path, errors_without="").split("errors:")[0]


@pytest.mark.parametrize(
    ("held", "handed_over", "words"),
    [
        ((), True, "without random seeds, resolution, time of the handoff, alpha"),
        ((), False, "without random seeds, resolution"),
        (("draws",), False, "without resolution"),
        (("draws", "size", "handoff", "alpha"), True, ""),
    ],
)
def test_what_an_error_leaves_out_follows_from_what_it_holds(held, handed_over, words):
    assert chain.missing(held, handed_over) == words


def test_resolution_pressure_and_cautions_stand_below(tmp_path):
    facts = {"projectile_particles": 37, "particles_per_radius": 2.07, "peak_pressure_Pa": 107e9,
    "planar_limit_Pa": 69.9e9, "planar_speed_m_s": 13968.0,
             "peak_over_planar_limit": 1.53, "cautions": ["the projectile has few"]}  # fmt: skip
    text = table(tmp_path, soundness=facts)
    assert (
        "projectile: 37 particles, 2.1 per radius; largest pressure of a particle 107 GPa, 1.5 times the planar limit "
        "(69.9 GPa at the vertical 13.97 km/s)" in text
    )
    assert "caution: the projectile has few" in text
    assert text.isascii()


def test_a_run_that_is_not_resolved_says_so_first_and_states_no_error(tmp_path):
    bare = entry(207.0937, 40.1234, 6.0, settled=True)
    for cell in bare.values():
        if isinstance(cell, dict):
            cell["sigma"] = None
    facts = {"not_resolved": "2.1 particles per projectile radius, fewer than 5", "cautions": []}
    text = table(tmp_path, final=bare, soundness=facts)
    assert text.splitlines()[0] == "NOT RESOLVED: 2.1 particles per projectile radius, fewer than 5"
    assert "207 m" in text and "207.1" not in text
