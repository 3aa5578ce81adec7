"""``python -m sph.eos tillotson basalt`` and its like: a table, a picture, and exit code 2 for what does not fit."""

import importlib

import pytest


@pytest.mark.parametrize(
    "folder,law,material,shown",
    [
        ("eos", "tillotson", "basalt", "1000     4683.9     3432.9      12.65"),
        ("eos", "murnaghan", "regolith_loose", "0.000739"),
        ("strength", "collins", "granite", "91.997"),
        ("strength", "drucker_prager", "basalt", "6.9282"),
        ("strength", "von_mises", "ice", "577.35"),
        ("porosity", "p_alpha", "aluminum", "4065.9"),
        ("porosity", "strain_alpha", "aluminum", "1.0000"),
    ],
)
def test_a_picture_and_a_table(folder, law, material, shown, tmp_path, capsys):
    picture = tmp_path / "law.png"
    assert (
        importlib.import_module(f"sph.shock_states.{folder}_picture").main([law, material, "--out", str(picture)]) == 0
    )
    assert picture.read_bytes().startswith(b"\x89PNG") and picture.stat().st_size > 10_000
    assert shown in capsys.readouterr().out


@pytest.mark.parametrize(
    "folder,law,material,said",
    [
        ("eos", "tillotson", "basat", "did you mean 'basalt'"),
        ("eos", "murnaghan", "ice", "has no [murnaghan]"),
        ("strength", "collins", "iron", "has no [collins]"),
        ("porosity", "p_alpha", "iron", "has no [p_alpha]"),
    ],
)
def test_what_does_not_fit_is_one_message(folder, law, material, said, tmp_path, capsys):
    assert (
        importlib.import_module(f"sph.shock_states.{folder}_picture").main(
            [law, material, "--out", str(tmp_path / "no.png")]
        )
        == 2
    )
    assert said in capsys.readouterr().err and not (tmp_path / "no.png").exists()
