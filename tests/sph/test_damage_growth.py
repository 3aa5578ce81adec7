"""Damage growth laws: what each says, and that they agree where they must."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from sph.damage import grady_kipp, growth, growth_linear

CRACK, RADIUS, SUPPORT = 1500.0, 10.0, 32.0


def grown(law, active, total, strain=0.0, least=1e-4, most=1e-3):
    kind = growth.FAMILY.kind(law)
    counted = growth.counted(kind, active, total, strain, least, most)
    return growth.rate(kind, *counted, CRACK, RADIUS, SUPPORT), growth.cap(kind, *counted)


def test_each_law_is_as_published():
    assert grown("cube_root", 8, 27) == pytest.approx((2 * CRACK / RADIUS, 2 / 3))
    assert grown("single", 8, 27) == pytest.approx((CRACK / RADIUS, 1.0))
    assert grown("linear", 8, 27) == pytest.approx((8 * CRACK / SUPPORT, 2 / 3))
    assert grown("fraction", 8, 27) == pytest.approx((8 / 27 * CRACK / RADIUS, 2 / 3))
    assert grown("weibull", 8, 27, strain=1e-4 * 8 ** (1 / 1.431363764158986))[0] == pytest.approx(2 * CRACK / SUPPORT, rel=1e-9)


@pytest.mark.parametrize("law", growth.FAMILY.names[1:])
@settings(max_examples=30, deadline=None)
@given(total=st.integers(1, 60), share=st.floats(0.0, 1.0))
def test_more_open_flaws_never_break_slower(law, total, share):
    active = int(share * total)
    strain = 1e-4 * (1.0 + 20.0 * share)
    rate, cap = grown(law, active, total, strain)
    more, higher = grown(law, total, total, 2e-2)
    assert 0.0 <= rate <= more and 0.0 <= cap <= higher == 1.0


@pytest.mark.parametrize("law", growth.FAMILY.names[1:])
def test_nothing_grows_without_an_open_flaw(law):
    assert grown(law, 0, 12, strain=0.5e-4) == (0.0, 0.0)


def test_the_fit_goes_through_both_ends():
    kind = growth.FAMILY.kind("weibull")
    assert growth.counted(kind, 0, 30, 1e-3, 1e-4, 1e-3)[0] == pytest.approx(30.0)
    assert growth.counted(kind, 0, 30, 1.0000001e-4, 1e-4, 1e-3)[0] == pytest.approx(1.0, rel=1e-5)
    assert growth.counted(kind, 0, 1, 3e-4, 1e-4, 1e-4)[0] == 1.0


def test_cracks_slow_down_in_damaged_rock():
    whole, broken = (growth_linear.crack_speed(0.0, 26.7e9, 22.7e9, 2700.0, D) for D in (0.0, 1.0))
    assert whole == pytest.approx(1837.3, abs=0.1) and broken == pytest.approx(0.4 * (26.7e9 / 2700) ** 0.5)


def test_the_weakest_flaws_of_a_graded_body():
    """A Poisson process in each particle: k V eps^m of the weakest flaw is exponential, the j-th lies near j, large particles keep equal numbers."""
    rng = np.random.default_rng(5)
    volumes = np.exp(rng.uniform(0.0, np.log(1e7), 9000))
    weibull = grady_kipp.Parameters(k=3e20, m=9.5)
    start, strains = grady_kipp.weakest(volumes, weibull, 400_000, rng)
    count = np.diff(start)
    assert count.min() >= 1 and 0.95 * 400_000 < count.sum() <= 400_000 + len(volumes)
    assert np.all(count[volumes > 1e4] == count.max()) and count[volumes < 2.0].max() < count.max()
    assert all(np.all(np.diff(strains[a:b]) >= 0.0) for a, b in itertools.pairwise(start))
    first, last = strains[start[:-1]].astype(float), strains[start[1:] - 1].astype(float)
    assert stats.kstest(weibull.k * volumes * first**weibull.m, "expon").pvalue > 1e-3
    number = (weibull.k * volumes * last**weibull.m)[count == count.max()]
    assert number.mean() == pytest.approx(count.max(), rel=5.0 / np.sqrt(count.max() * len(number)) + 1e-3)


def test_kept_flaws_are_those_of_the_whole_draw():
    """Equal particles: as many flaws, and weakest ones as strong, as where flaws are dealt out one by one."""
    volumes, weibull = np.full(4000, 2.0), grady_kipp.Parameters(k=1e22, m=8.0)
    all_start, all_strains = grady_kipp.flaws(volumes, weibull, np.random.default_rng(1))
    start, strains = grady_kipp.weakest(volumes, weibull, 10**9, np.random.default_rng(2))
    assert len(strains) == pytest.approx(len(all_strains), rel=0.3)
    one, two = all_strains[all_start[:-1]], strains[start[:-1]]
    assert stats.ks_2samp(one, two).pvalue > 1e-3
