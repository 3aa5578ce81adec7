"""The functions that measure a body after an impact, each named like its row in ``matter/wording/body_measures.py``:
one argument, ``BodyComparison``; one ``Quantity`` back, or a ``Pair`` of before and after.

What particles say of a body departs from the shape that they fill (``sampling``), and it depends on what is counted to
it while matter still flies about it (``counted``: half of what the bound matter near it changes). A change has the
first of these for the fraction of the mass that moved alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from crater.bodies import classes, hollow, mutual_orbit
from crater.bodies.body_comparison import BodyComparison, Pair
from crater.bodies.exchange import Exchange
from crater.measures.uncertainty import Quantity, quantity
from matter.solids import pose_tracker
from matter.solids.body_shape import enclosed
from matter.wording.body_measures import BY_NAME, TABLE


def all_of(compared: BodyComparison) -> dict[str, Quantity | Pair]:
    """Every measure of the table."""
    return {row.name: globals()[row.name](compared) for row in TABLE}


def _pair(name: str, values: tuple[float, float], sampling: float, counted: float, compared: BodyComparison) -> Pair:
    unit = BY_NAME[name].unit
    one, two = values
    return Pair(
        quantity(one, {"sampling": sampling}, unit),
        quantity(two, {"sampling": sampling, "counted": counted}, unit),
        quantity(two - one, {"sampling": sampling * compared.moved_fraction, "counted": counted}, unit),
    )


def _of_axes(name: str, compared: BodyComparison, of: Callable[[np.ndarray], float]) -> Pair:
    """A number made of the three axes."""
    one, two, given, more = (
        float(of(axes)) for axes in (compared.first.axes, compared.last.axes, compared.axes, compared.counted.axes)
    )
    return _pair(name, (one, two), abs(one - given), 0.5 * abs(two - more), compared)


def axis_a_m(compared: BodyComparison) -> Pair:
    """The longest axis of the ellipsoid of equal inertia."""
    return _of_axes("axis_a_m", compared, lambda axes: axes[0])


def axis_b_m(compared: BodyComparison) -> Pair:
    """The middle one."""
    return _of_axes("axis_b_m", compared, lambda axes: axes[1])


def axis_c_m(compared: BodyComparison) -> Pair:
    """The shortest."""
    return _of_axes("axis_c_m", compared, lambda axes: axes[2])


def axis_ratio_a_over_b(compared: BodyComparison) -> Pair:
    """a / b."""
    return _of_axes("axis_ratio_a_over_b", compared, lambda axes: axes[0] / axes[1])


def axis_ratio_a_over_c(compared: BodyComparison) -> Pair:
    """a / c."""
    return _of_axes("axis_ratio_a_over_c", compared, lambda axes: axes[0] / axes[2])


def _extent(name: str, compared: BodyComparison, k: int) -> Pair:
    (one, error), (two, later) = compared.extents(False), compared.extents(True)
    unit = BY_NAME[name].unit
    return Pair(
        quantity(one[k], {"surface": error[k]}, unit),
        quantity(two[k], {"surface": later[k]}, unit),
        quantity(two[k] - one[k], {"surface": math.hypot(error[k], later[k])}, unit),
    )


def extent_x_m(compared: BodyComparison) -> Pair:
    """From end to end along x of the body's own frame."""
    return _extent("extent_x_m", compared, 0)


def extent_y_m(compared: BodyComparison) -> Pair:
    """Along y."""
    return _extent("extent_y_m", compared, 1)


def extent_z_m(compared: BodyComparison) -> Pair:
    """Along z."""
    return _extent("extent_z_m", compared, 2)


def body_volume_m3(compared: BodyComparison) -> Pair:
    """Volume of the shape, and with what the ground gained over it."""
    volume = compared.shape.solid.volume
    gained, error = compared.chart.gained()
    discrepancy = abs(enclosed(compared.chart.ground(False), compared.chart.points.triangles) - volume)
    return Pair(
        quantity(volume, {"sampling": discrepancy}, "m^3"),
        quantity(volume + gained, {"sampling": discrepancy, "surface": error}, "m^3"),
        quantity(gained, {"surface": error}, "m^3"),
    )


def body_mass_kg(compared: BodyComparison) -> Pair:
    """Mass of the target before, of all that is bound after."""
    p = compared.before.particles
    target = p.layer >= 0 if "layer" in p else np.ones(len(p), dtype=bool)
    one, two = float(p.mass[target].sum()), compared.moved.mass
    escaped = compared.after.particles.mass[~compared.after.bound]
    counting = {"counting": float(np.sqrt(np.sum(escaped**2)))}
    return Pair(
        quantity(one, {}, "kg"), quantity(two, counting, "kg"), quantity(two - one, counting, "kg")
    )  # fmt: skip


def spin_period_s(compared: BodyComparison) -> Pair:
    """Period of rotation: as the case gives it, and of the body's angular momentum."""
    one, two = (float(np.linalg.norm(rate)) for rate in (compared.omega, compared.last.rotation))
    sampling = float(np.linalg.norm(compared.first.rotation - compared.omega))
    counted = 0.5 * float(np.linalg.norm(compared.last.rotation - compared.counted.rotation))
    counting = _of_what_left(compared)
    error = math.hypot(sampling, counted, counting)
    none = Quantity(None, None, "s", "the body did not turn")
    slow = Quantity(None, None, "s", "the body turns no faster than its error")
    before = quantity(2.0 * math.pi / one, {}, "s") if one > 0.0 else none
    if not two > error:
        return Pair(before, slow, slow)
    period, parts = 2.0 * math.pi / two, {"sampling": sampling, "counted": counted, "counting": counting}
    parts = {name: period * part / two for name, part in parts.items()}
    change = quantity(period - 2.0 * math.pi / one, parts, "s") if one > 0.0 else none
    return Pair(before, quantity(period, parts, "s"), change)


def _of_what_left(compared: BodyComparison) -> float:
    """Error of the rotation [1/s] by counting the particles which took angular momentum with them."""
    p, escaped = compared.after.particles, ~compared.after.bound
    spin = p.mass[escaped, None] * np.cross(p.position[escaped], p.velocity[escaped])
    held = compared.after.particles.select(compared.after.body)
    moments = pose_tracker.inertia(held.position - held.mass @ held.position / held.mass.sum(), held.mass)
    return float(np.linalg.norm(np.linalg.solve(moments, np.sqrt(np.sum(spin**2, axis=0)))))


def spin_axis_turned_deg(compared: BodyComparison) -> Quantity:
    """Angle between the axes of rotation."""
    one, two = (float(np.linalg.norm(rate)) for rate in (compared.omega, compared.last.rotation))
    if not (one > 0.0 and two > 0.0):
        return Quantity(None, None, "deg", "the body did not turn")
    cross = float(np.linalg.norm(np.cross(compared.omega, compared.last.rotation)))
    error = math.hypot(float(np.linalg.norm(compared.first.rotation - compared.omega)), _of_what_left(compared)) / two
    return quantity(
        math.degrees(math.atan2(cross, float(compared.omega @ compared.last.rotation))),
        {"sampling": math.degrees(error)},
        "deg",
    )


def centre_of_mass_moved_m(compared: BodyComparison) -> Quantity:
    """Way of the centre of mass against the half of the body that moved least."""
    way = compared.last.centre - compared.first.centre
    counted = 0.5 * float(np.linalg.norm(compared.last.centre - compared.counted.centre))
    return quantity(float(np.linalg.norm(way)), {"counted": counted}, "m")


def _mean_square(compared: BodyComparison) -> float:
    area = compared.chart.points.area
    return float(np.average(compared.chart.change**2, weights=area))


def height_change_rms_m(compared: BodyComparison) -> Quantity:
    """RMS over the surface; the noise of what is resurfaced is its error."""
    area, resurfaced = compared.chart.points.area, compared.chart.deep > 0.0
    noise = math.sqrt(float(np.sum((area * compared.chart.error**2)[resurfaced]) / area.sum()))
    return quantity(math.sqrt(_mean_square(compared)), {"surface": noise}, "m")


def _extreme(compared: BodyComparison, where: int) -> Quantity:
    return quantity(float(compared.chart.change[where]), {"surface": float(compared.chart.error[where])}, "m")


def height_change_lowest_m(compared: BodyComparison) -> Quantity:
    """The deepest one."""
    return _extreme(compared, int(np.argmin(compared.chart.change)))


def height_change_highest_m(compared: BodyComparison) -> Quantity:
    """The highest one."""
    return _extreme(compared, int(np.argmax(compared.chart.change)))


def hollow_across_m(compared: BodyComparison) -> Quantity:
    """Of the hollow that holds the deepest change."""
    return hollow.across(compared.chart)


def _counted(compared: BodyComparison, fraction: float) -> Quantity:
    """A fraction of the surface; its error is that of counting patches of a spacing."""
    chart = compared.chart
    patches = float(np.sum(chart.points.area / chart.spacing**2))
    return quantity(fraction, {"counting": math.sqrt(max(fraction * (1.0 - fraction), 1.0 / patches) / patches)}, "1")


def changed_share(compared: BodyComparison) -> Quantity:
    """Fraction of the surface whose height changed for sure."""
    return _counted(compared, classes.extent_of(compared.chart).changed)


def change_spread(compared: BodyComparison) -> Quantity:
    """Fraction over which that change would be spread were it even."""
    return _counted(compared, classes.extent_of(compared.chart).spread)


def resurfaced_share(compared: BodyComparison) -> Quantity:
    """Fraction of the surface that is resurfaced."""
    return _counted(compared, compared.chart.resurfaced_fraction)


def resurfaced_depth_m(compared: BodyComparison) -> Quantity:
    """Mean depth of what is resurfaced; half a spacing is its error."""
    chart = compared.chart
    resurfaced = chart.deep > 0.0
    if not resurfaced.any():
        return Quantity(None, None, "m", "nothing of the surface is resurfaced")
    area = chart.points.area[resurfaced]
    return quantity(
        float(np.average(chart.deep[resurfaced], weights=area)),
        {"resolution": 0.5 * float(np.average(chart.spacing[resurfaced], weights=area))},
        "m",
    )


def ejected_mass_kg(compared: BodyComparison) -> Quantity:
    """Target matter that is not on the ground."""
    return quantity(compared.moved.ejected, {}, "kg")


def escaping_mass_kg(compared: BodyComparison) -> Quantity:
    """All that is unbound and moves outwards."""
    escaped = compared.after.particles.mass[~compared.after.bound]
    return quantity(compared.moved.escaping, {"counting": float(np.sqrt(np.sum(escaped**2)))}, "kg")


def pair_escaping_mass_kg(compared: BodyComparison) -> Quantity:
    """What of it leaves the companion too; its error as that of what leaves the body."""
    if compared.moved_pair is None:
        return Quantity(None, None, "kg", NO_COMPANION)
    escaped = compared.after.particles.mass[~compared.after.bound]
    return quantity(compared.moved_pair.escaping, {"counting": float(np.sqrt(np.sum(escaped**2)))}, "kg")


def _beta(compared: BodyComparison, direction: np.ndarray, moved: Exchange | None = None) -> Quantity:
    value, error = (moved or compared.moved).beta(direction)
    return quantity(value, {"counting": error}, "1", "the projectile flew across this direction")


def beta_normal(compared: BodyComparison) -> Quantity:
    """Along the normal of the surface at the site."""
    return _beta(compared, compared.shape.placed.normal)


def beta_flight(compared: BodyComparison) -> Quantity:
    """Along the projectile's flight."""
    return _beta(compared, compared.moved.brought / np.linalg.norm(compared.moved.brought))


def beta_along_track(compared: BodyComparison) -> Quantity:
    """Along the track of the orbit."""
    if compared.orbit is None:
        return Quantity(None, None, "1", NO_COMPANION)
    return _beta(compared, compared.orbit.track)


def beta_pair_normal(compared: BodyComparison) -> Quantity:
    """Of what leaves body and companion, along the normal of the surface at the site."""
    if compared.moved_pair is None:
        return Quantity(None, None, "1", NO_COMPANION)
    return _beta(compared, compared.shape.placed.normal, compared.moved_pair)


def beta_pair_flight(compared: BodyComparison) -> Quantity:
    """The same along the projectile's flight."""
    if compared.moved_pair is None:
        return Quantity(None, None, "1", NO_COMPANION)
    return _beta(compared, compared.moved.brought / np.linalg.norm(compared.moved.brought), compared.moved_pair)


def delta_v_m_s(compared: BodyComparison) -> Quantity:
    """Size of the change of velocity."""
    size = float(np.linalg.norm(compared.moved.stays))
    error = float(np.linalg.norm(compared.moved.error * compared.moved.stays / max(size, 1e-300)))
    return quantity(size / compared.moved.mass, {"counting": error / compared.moved.mass}, "m/s")


def _along_track(compared: BodyComparison, track: np.ndarray) -> tuple[float, float]:
    error = float(np.linalg.norm(compared.moved.error * track))
    return float(compared.moved.change @ track), error / compared.moved.mass


def delta_v_along_track_m_s(compared: BodyComparison) -> Quantity:
    """Its part along the track."""
    if compared.orbit is None:
        return Quantity(None, None, "m/s", NO_COMPANION)
    value, error = _along_track(compared, compared.orbit.track)
    return quantity(value, {"counting": error}, "m/s")


def orbit_period_before_s(compared: BodyComparison) -> Quantity:
    """Of the circle about the companion."""
    if compared.orbit is None:
        return Quantity(None, None, "s", NO_COMPANION)
    return quantity(mutual_orbit.period(compared.orbit, compared.moved.mass, np.zeros(3)), {}, "s")


def orbit_period_change_s(compared: BodyComparison) -> Quantity:
    """What the change of velocity makes of it."""
    if compared.orbit is None:
        return Quantity(None, None, "s", NO_COMPANION)
    before = mutual_orbit.period(compared.orbit, compared.moved.mass, np.zeros(3))
    after = mutual_orbit.period(compared.orbit, compared.moved.mass, compared.moved.change)
    error = _along_track(compared, compared.orbit.track)[1]
    shifted = mutual_orbit.period(
        compared.orbit, compared.moved.mass, compared.moved.change + error * compared.orbit.track
    )
    return quantity(after - before, {"counting": abs(shifted - after)}, "s", "the body leaves its companion")


def orbit_period_change_by_shape_s(compared: BodyComparison) -> Quantity:
    """What the change of shape adds to it, with the longest axis towards the companion before and after. Matter that
    is not settled (``counted``) is its error."""
    if compared.orbit is None:
        return Quantity(None, None, "s", NO_COMPANION)
    value, other = (
        mutual_orbit.period_change_by_shape(compared.orbit, compared.moved.mass, compared.first.axes, body.axes)
        for body in (compared.last, compared.counted)
    )
    return quantity(value, {"counted": 0.5 * abs(value - other)}, "s")


NO_COMPANION = "no orbit: the case has no [target.companion]"
