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
    assert grown("weibull", 8, 27, strain=1e-4 * 8 ** (1 / 1.431363764158986))[0] == pytest.approx(
        2 * CRACK / SUPPORT, rel=1e-9
    )


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


def test_flaws_by_size_in_a_graded_body():
    """k V eps^m of the weakest flaw is exponential, whatever the volume; as many flaws in large particles as in small
    ones, in order, none beyond the mean."""
    rng = np.random.default_rng(5)
    volumes = np.exp(rng.uniform(0.0, np.log(1e7), 9000))
    weibull = grady_kipp.Parameters(k=3e20, m=9.5)
    start, strains = grady_kipp.flaws_by_size(volumes, weibull, rng)
    count = np.diff(start)
    assert count.min() >= 1 and count.mean() == pytest.approx(np.log(9000) + 0.6, rel=0.02)
    assert abs(np.corrcoef(count, np.log(volumes))[0, 1]) < 0.05
    assert all(np.all(np.diff(strains[a:b]) >= 0.0) for a, b in itertools.pairwise(start))
    opens = weibull.k * np.repeat(volumes, count) * strains.astype(float) ** weibull.m
    assert 0.0 < opens.min() and opens.max() < (np.log(9000) + 0.6) * (1.0 + 1e-4)
    for some in (volumes < 1e3, volumes > 1e4):
        assert stats.kstest(opens[start[:-1]][some], "expon").pvalue > 1e-3


def test_flaws_by_size_are_those_dealt_out_where_all_are_of_one_size():
    """As many flaws in all, the weakest and the strongest of a particle as strong."""
    volumes, weibull = np.full(4000, 2.0), grady_kipp.Parameters(k=1e22, m=8.0)
    dealt, one = grady_kipp.flaws(volumes, weibull, np.random.default_rng(1))
    start, two = grady_kipp.flaws_by_size(volumes, weibull, np.random.default_rng(2))
    assert len(two) == pytest.approx(len(one), rel=0.2)
    assert stats.ks_2samp(one[dealt[:-1]], two[start[:-1]]).pvalue > 1e-3
    assert np.median(two[start[1:] - 1]) == pytest.approx(np.median(one[dealt[1:] - 1]), rel=0.02)
