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


def test_the_weakest_flaws_are_those_dealt_out():
    """One size: as many flaws in all, the weakest and the strongest of a particle as strong. Of particles of 300 times
    the volume: as many, 31 weakest and the strongest of which are kept."""
    weibull = grady_kipp.Parameters(k=1e22, m=8.0)
    for volumes in (np.full(4000, 2.0), np.concatenate([np.full(60, 600.0), np.full(4000, 2.0)])):
        rng = np.random.default_rng(1)
        dealt, one = grady_kipp.flaws(volumes, weibull, rng)
        start, two, total = grady_kipp.weakest(volumes, weibull, rng)
        large = volumes == volumes.max()
        # where the last particle gets its first is one random number of all, of spread 1.28 in ln n + 0.6
        assert total[large].mean() == pytest.approx(np.diff(dealt)[large].mean(), rel=0.3)
        assert stats.ks_2samp(one[dealt[:-1]][large], two[start[:-1]][large]).pvalue > 1e-3
        assert np.median(two[start[1:] - 1]) == pytest.approx(np.median(one[dealt[1:] - 1]), rel=0.05)
        held = np.diff(start)
        assert (
            held.max() <= grady_kipp.KEPT and np.all(held <= total) and np.all(held[total < 32] == total[total < 32])
        )
        assert all(np.all(np.diff(two[a:b]) >= 0.0) for a, b in itertools.pairwise(start))


def test_flaws_between_those_kept_open_as_those_dealt_out_do():
    """Of 60 large particles, at strains from the weakest to the strongest flaw of all."""
    volumes, weibull = np.concatenate([np.full(60, 600.0), np.full(4000, 2.0)]), grady_kipp.Parameters(k=1e22, m=8.0)
    start, strains, total = grady_kipp.weakest(volumes, weibull, np.random.default_rng(4))
    for strain in np.geomspace(strains.min(), strains.max(), 12)[1:-1]:
        found = [grady_kipp.active(strains, start[i], start[i + 1], total[i], strain) for i in range(60)]
        law = weibull.k * 600.0 * strain**weibull.m
        # the mean of 60 Poisson numbers, and no flaw beyond the last
        assert np.mean(found) == pytest.approx(min(law, total[:60].mean()), abs=4.0 * np.sqrt(law / 60.0) + 0.03 * law)
    assert grady_kipp.active(strains, start[0], start[1], total[0], 1.0) == total[0]
    assert grady_kipp.active(strains, start[0], start[1], total[0], 0.5 * strains[start[0]]) == 0.0
    small = 4059  # all of whose flaws are kept
    own = strains[start[small] : start[small + 1]]
    assert len(own) == total[small]
    assert [grady_kipp.active(strains, start[small], start[small + 1], total[small], eps) for eps in own] == [
        float(k) for k in range(len(own))
    ]
