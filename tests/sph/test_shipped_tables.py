"""The tables that ship, quartz and dunite of M-ANEOS: against states of their source between the nodes, against
themselves (first and second law), against published shocks, and along their isentropes."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from fixtures import isentropes, tables
from matter.case.material import TABLES
from matter.formats import sesame
from sph.eos import dispatch, table, table_slopes
from sph.shock_states import hugoniot

KIND = dispatch.FAMILY.kind("table")
DATA = Path(__file__).parents[1] / "data"
SHIPPED = {
    "quartz": table.EXAMPLE,
    "dunite": table.Parameters(3320.0, str(TABLES / "dunite.txt.xz"), 298.0),
}
COLD = 1e-5
"""Share of the energy below which the heat between two isotherms is less than what interpolation leaves of cold
energy (50 to 100 K, at more than twice the density at rest)."""


class Shipped(NamedTuple):
    """A table: its row, its file, and which of its cells are cut, all mixture, of one phase (n - 1, k - 1)."""

    name: str
    row: np.ndarray
    source: sesame.Table
    cut: np.ndarray
    both: np.ndarray
    one: np.ndarray

    def pressure(self, rho, u):
        return dispatch.pressure_and_derivatives(KIND, self.row, rho, u)[0]

    def behind(self, speed):
        """The states behind the wave or the two waves of a piston [m/s]."""
        rest = hugoniot.State(self.row[0], 0.0, self.pressure(self.row[0], 0.0), 0.0)
        return hugoniot.waves(self.pressure, rest, speed)


def opened(name):
    row, source = table.row(SHIPPED[name]), sesame.read(SHIPPED[name].file)
    x = np.log(source.rho)
    cut = tables.cut_cells(x, source.u, source.P)
    mixed = table_slopes.mixed(x, source.P)
    both = mixed[1:, 1:] & mixed[:-1, 1:] & mixed[1:, :-1] & mixed[:-1, :-1]
    return Shipped(name, row, source, cut, both & ~cut, ~cut & ~both)


@pytest.fixture(scope="module", params=SHIPPED)
def shipped(request):
    return opened(request.param)


@pytest.fixture(scope="module")
def quartz():
    return opened("quartz")


@pytest.fixture(scope="module")
def dunite():
    return opened("dunite")


# --- against its source ---


@pytest.fixture(scope="module")
def between(shipped):
    """States of M-ANEOS halfway between the nodes: how much P, s and c of the table miss them by, whether the cell is
    cut by a phase boundary or all mixture, and P.

    Relative errors, but of a pressure below 1e-4 K of condensed matter in shares of that, of one below 1 Pa in Pa, of
    an entropy below 1000 J/(kg K) (of the order of c_v; its zero is free) in shares of that, of a speed below 1 m/s in
    m/s.
    """
    found, row = [], shipped.row
    for state in csv.DictReader((DATA / f"maneos_{shipped.name}_between.csv").open()):
        rho, T, u, P, c, s = (float(state[key]) for key in ("rho", "T", "u", "P", "c", "s"))
        i, j = np.searchsorted(shipped.source.rho, rho) - 1, np.searchsorted(shipped.source.T, T) - 1
        u, least = u - row[2], 1e-4 * row[1] if rho > 0.5 * row[0] else 1.0
        found.append(
            (
                abs(shipped.pressure(rho, u) - P) / max(abs(P), least),
                abs(dispatch.entropy(KIND, row, rho, u) - s) / max(abs(s), 1000.0),
                abs(dispatch.sound_speed(KIND, row, rho, u) - c) / max(c, 1.0),
                shipped.cut[i, j],
                shipped.both[i, j],
                P,
            )
        )
    return np.array(found).T


def test_a_table_is_its_source_between_the_nodes_where_no_boundary_cuts_the_cell(between):
    """P and s within 1 %, c within 3 %, in every state of one phase (408 and 409 of 494; 6 lie in cells that are
    cut)."""
    P, s, c, cut, both, _ = between
    whole = (cut == 0) & (both == 0)
    assert len(P) == 494 and cut.sum() < 10 and whole.sum() > 400
    assert P[whole].max() < 0.01 and s[whole].max() < 0.01 and c[whole].max() < 0.03
    assert np.median(P[whole]) < 1e-5 and np.median(s[whole]) < 1e-5 and np.median(c[whole]) < 1e-4


def test_a_table_in_two_phases_has_the_vapour_pressure_of_its_source(between):
    """Above 1 bar within 1 % (and c within 6 %), and below within 4 %: M-ANEOS goes straight from one of its own
    temperatures to the next there, and its d ln P / d(1/T) is a saw of 6 % above 2000 K, of 40 % below."""
    P, s, c, cut, both, source = between
    both = (cut == 0) & (both == 1)
    assert both.sum() > 70 and (both & (source > 1e5)).sum() > 10
    assert P[both & (source > 1e5)].max() < 0.01 and c[both & (source > 1e5)].max() < 0.06
    assert P[both].max() < 0.04 and s[both].max() < 0.01


def test_quartz_is_cut_along_its_boundaries_only(quartz):
    """2.8 % of the cells. At 1000 K: where the stretched solid gives way to vapour (2100 kg/m^3), and at both ends of
    the transition to stishovite, 3500 and 4300 kg/m^3 in the program's input; nowhere near the density at rest."""
    source, cut = quartz.source, quartz.cut
    assert cut.size == 38640 and cut.sum() == 1066
    i = np.flatnonzero(cut[:, np.searchsorted(source.T, 1000.0)])
    places = 0.5 * (source.rho[i] + source.rho[i + 1])
    assert places == pytest.approx([2107.0, 3492.0, 4292.0], rel=5e-3)
    rest = (source.rho[:-1] > 2300.0) & (source.rho[1:] < 3450.0)
    assert not cut[rest][:, source.T[1:] < 1900.0].any()


# --- against the first and second law ---


def own_errors(shipped):
    """How far the nodes of the file are from T ds = du at one density, and from d(u - T s) = P / rho^2 drho at one
    temperature, the larger of each cell's two sides (n - 1, k - 1): what M-ANEOS itself misses the laws by."""
    source, x = shipped.source, np.log(shipped.source.rho)
    mean = np.diff(source.T) / np.diff(np.log(source.T))
    heat = np.abs(np.diff(source.s, axis=1) * mean / np.diff(source.u, axis=1) - 1.0)
    q, h = source.P / source.rho[:, None], np.diff(x)[:, None]
    work = 0.5 * (q[1:] + q[:-1]) * h - h**2 / 12.0 * np.diff(np.gradient(q, x, axis=0), axis=0)
    free = np.diff(source.u - source.T * source.s, axis=0)
    dense = np.where(source.rho[1:] > 0.5 * shipped.row[0], 0.1 * shipped.row[1] / source.rho[1:], 0.0)[:, None]
    misfit = np.abs(free - work) / np.maximum(np.abs(work), dense * h)
    return np.maximum(heat[1:], heat[:-1]), np.maximum(misfit[:, 1:], misfit[:, :-1])


def test_between_nodes_that_obey_the_laws_so_does_the_table(shipped):
    """|T ds/du - 1| at one density and |rho^2 T ds/drho + P| at one energy over P (0.1 K where P is less), together
    the relation of Maxwell, below 3 %, in the middle of every third cell along both axes that is of one phase and
    whose nodes obey them to 1 %.

    That is half of them: above some 8,000 K M-ANEOS' own entropy and energy do not belong together (T ds/du off by
    9 % in the median above 20,000 K, by its ionisation). Left out too: cold, dense cells whose heat is lost in the
    cold energy.
    """
    source, row, seen = shipped.source, shipped.row, 0
    heat, misfit = own_errors(shipped)
    for i in range(0, len(source.rho) - 1, 3):
        for j in range(0, len(source.T) - 1, 3):
            if not shipped.one[i, j] or heat[i, j] > 0.01 or misfit[i, j] > 0.01:
                continue
            gap = source.u[i : i + 2, j + 1] - source.u[i : i + 2, j]
            if gap.min() < COLD * np.abs(source.u[i : i + 2, j]).max():
                continue
            rho, low, high = (float(v) for v in (np.sqrt(source.rho[i] * source.rho[i + 1]), *source.T[j : j + 2]))
            u = table._energy_at(rho, float(np.sqrt(low * high)), row) - row[2]
            T, P = dispatch.temperature(KIND, row, rho, u), shipped.pressure(rho, u)
            step = 0.02 * gap.min()
            near = min(1e-5, step * rho / abs(P))
            rise = dispatch.entropy(KIND, row, rho, u + step) - dispatch.entropy(KIND, row, rho, u - step)
            turn = dispatch.entropy(KIND, row, rho * (1 + near), u) - dispatch.entropy(KIND, row, rho * (1 - near), u)
            least = 0.1 * row[1] if rho > 0.5 * row[0] else 1.0
            assert abs(T * rise / (2.0 * step) - 1.0) < 0.03, (rho, T)
            assert abs(rho * T * turn / (2.0 * near) + P) < 0.03 * max(abs(P), least), (rho, T)
            seen += 1
    assert seen > 1400


@pytest.mark.parametrize("u,squeezed", [(0.0, 1.25), (2e5, 1.9), (1e7, 2.0)])
def test_squeezed_through_its_transition_and_released_it_comes_back(shipped, u, squeezed):
    """1.9 times their densities lie beyond the transitions to stishovite and to the dense phase of dunite: entropy
    within 1 % of c_v = 1000 J/(kg K) on the way, and back to 1e-6 of it."""
    most, change, energy = isentropes.loop(shipped.row, shipped.row[0], u, squeezed, 2000)
    assert most < 10.0 and abs(change) < 1e-3 and abs(energy) < 1.0


# --- against published shocks ---


def test_quartz_behind_a_shock_is_where_it_was_published(quartz):
    """Knudson & Desjarlais 2009 (Phys. Rev. Lett. 103, 225501), their line through shocks in quartz: Us = 6.26 + 1.20
    up - 2.56 up exp(-0.37 up), km/s: within 3 % from 72 to 306 GPa (5 % wanted)."""
    for up in np.arange(3.5, 8.1, 0.5):
        (state,) = quartz.behind(1e3 * up)
        assert state.shock_speed == pytest.approx(1e3 * (6.26 + 1.20 * up - 2.56 * up * np.exp(-0.37 * up)), rel=0.03)
    assert state.P > 300e9


def test_quartz_behind_a_shock_is_that_of_its_author(quartz):
    """Melosh 2007, text of p. 2094: 242 GPa, 15,800 K and 4730 J/(kg K) at up = 7 km/s; p. 2093: 652 GPa at 12.3 km/s.
    The transition splits the shock: a first wave at 5.8 km/s between up = 1.4 and 2.4 km/s, the flat piece of his
    Figure 5, with the data of Wackerle 1962 and Ahrens & Rosenberg 1968 on it."""
    (state,) = quartz.behind(7e3)
    assert state.P == pytest.approx(242e9, rel=0.01)
    assert dispatch.temperature(KIND, quartz.row, state.rho, state.u) == pytest.approx(15_800.0, rel=0.02)
    assert dispatch.entropy(KIND, quartz.row, state.rho, state.u) == pytest.approx(4730.0, rel=0.01)
    assert quartz.behind(12.3e3)[0].P == pytest.approx(652e9, rel=0.01)
    for up in (1500.0, 2000.0, 2300.0):
        first, second = quartz.behind(up)
        assert first.shock_speed == pytest.approx(5.8e3, rel=0.02) and second.shock_speed < first.shock_speed
    assert len(quartz.behind(1300.0)) == len(quartz.behind(2500.0)) == 1


SHOTS = {  # every third shot of each paper, up and Us [km/s]
    "Syono et al. 1981, forsterite": ((0.9, 7.41), (2.805, 9.11), (1.37, 7.98), (2.03, 8.35), (0.71, 7.11))
    + ((1.97, 8.31), (3.12, 9.19)),
    "Jackson & Ahrens 1979, forsterite": ((2.4, 8.96), (3.77, 10.01), (4.61, 11.12)),
    "Mosenfelder et al. 2007, forsterite": ((1.52, 7.97), (3.87, 10.48)),
    "Watt & Ahrens 1983, forsterite": ((3.85, 10.61), (3.82, 10.5)),
    "Furnish & Brown 1986, olivine": ((4.97, 11.63), (4.479, 11.088)),
    "Root et al. 2018, forsterite": ((6.022, 13.39), (6.5099, 13.99), (6.4968, 14.24)),
}


def test_dunite_behind_a_shock_is_where_olivine_was_shot_to(dunite):
    """Us beside shots into forsterite and olivine from 16 to 310 GPa: 4 of 5 within 5 %, all within 8 % (the worst
    between 68 and 81 GPa, where there are two waves), 2 % in the mean; shots of one paper scatter by 5 % among
    themselves. Within 2.5 % of the line of Chidester et al. 2021 (Geophys. Res. Lett.) through shots into olivine,
    3.934 + 1.638 up - 0.01269 up^2, from 139 to 309 GPa."""
    off = [dunite.behind(1e3 * up)[0].shock_speed / (1e3 * us) - 1.0 for shots in SHOTS.values() for up, us in shots]
    assert len(off) == 19 and np.abs(off).max() < 0.08
    assert np.mean(np.abs(off) < 0.05) > 0.8 and abs(np.mean(off)) < 0.02
    for up in np.arange(4.0, 6.6, 0.5):
        (state,) = dunite.behind(1e3 * up)
        assert state.shock_speed == pytest.approx(1e3 * (3.93403 + 1.63806 * up - 0.01269 * up**2), rel=0.025)
    assert state.P > 300e9


# --- release ---


def test_a_shocked_table_is_released_at_its_entropy(shipped):
    """From behind a shock of 7 km/s to a tenth of the density at rest: entropy within 1 %, pressure and temperature
    fall all the way."""
    (state,) = shipped.behind(7e3)
    path = isentropes.along(shipped.row, np.geomspace(state.rho, 0.1 * shipped.row[0], 4000), state.u)
    assert np.abs(path.s / path.s[0] - 1.0).max() < 0.01
    assert (np.diff(path.P) < 0.0).all() and (np.diff(path.T) < 0.0).all()
    assert path.P[0] > 200e9 and 0.0 < path.P[-1] < 0.2e9


def test_quartz_has_its_critical_point_where_its_author_says(quartz):
    """Melosh 2007, Table 1: 5398 K, 0.189 GPa, 549 kg/m^3. From 450 to 650 kg/m^3 pressure is that of a mixture
    (within 1 %) 2.5 % below that temperature and rises by more than 3 % 2 % above it, on both sides of 0.189 GPa."""

    def isotherm(T):
        energies = [(rho, table._energy_at(rho, T, quartz.row) - quartz.row[2]) for rho in (450.0, 549.0, 650.0)]
        return [quartz.pressure(*state) for state in energies]

    below, above = isotherm(0.975 * 5398.0), isotherm(1.02 * 5398.0)
    assert below[2] == pytest.approx(below[0], rel=0.01) and below[1] < 0.189e9
    assert above[2] > 1.03 * above[0] and above[1] > 0.189e9
