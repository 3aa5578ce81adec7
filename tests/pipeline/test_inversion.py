"""The inversion against answers that are known: a closed form, calibration by simulation, a reference posterior."""

from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from crater.scaling import crater_size
from fixtures import inverse_laws as law
from pipeline.case import read as cases
from pipeline.case.prior_table import Prior
from pipeline.inverse import directions, expected_gain, posterior, scaling_members
from pipeline.inverse.posterior import Observed
from studies import inverse_checks
from studies.inverse_checks import POINTS, RUNS, SCATTER, emulated

DRAWS = 500
DISCREPANCY = 0.08


def normal(mean, sd):
    return Prior(distribution="normal", mean=mean, sd=sd)


def linear_problem(size):
    """ln y of two measures, linear in ``size`` normal parameters: priors, model, what was observed, and mean and
    covariance of the posterior."""
    rng = np.random.default_rng(4)
    mean, sd = 1.0 + rng.uniform(1.0, 2.0, size), rng.uniform(0.2, 0.6, size)
    slope, level = rng.uniform(0.3, 1.0, (2, size)), np.array([0.3, -0.2])
    observed = [Observed("a", "m", 30.0, 3.0, 3.0, 0.05, 0.0), Observed("b", "m", 20.0, 1.0, 1.0, 0.2, 0.0)]
    model_sd = np.array([0.1, 0.05])
    precision = 1.0 / np.array([o.error**2 + o.chain**2 + s**2 for o, s in zip(observed, model_sd)])
    covariance = np.linalg.inv(np.diag(sd**-2.0) + slope.T @ (precision[:, None] * slope))
    data = np.log([o.value for o in observed]) - level
    exact = covariance @ (mean / sd**2 + slope.T @ (precision * data))
    priors = {f"p{k}": normal(float(m), float(s)) for k, (m, s) in enumerate(zip(mean, sd))}

    def predict(theta):
        return level + theta @ slope.T, np.broadcast_to(model_sd, (len(theta), 2))

    return priors, predict, observed, exact, np.sqrt(np.diag(covariance))


@pytest.mark.parametrize("size, of_mean, of_sd", [(2, 0.02, 0.02), (5, 0.1, 0.1)])
def test_a_linear_model_of_normal_priors_has_its_closed_form(size, of_mean, of_sd):
    """By importance the mean within 1 % and 0.02 standard deviations, these within 2 %; by walkers within four times
    the scatter of some 3,000 independent points."""
    priors, predict, observed, mean, sd = linear_problem(size)
    found = posterior.sampled(priors, predict, observed)
    assert found.sampler == ("emcee" if size > posterior.MOST else "importance sampling")
    told = posterior.told(priors, found)
    means = np.array([one.mean for one in told.values()])
    assert np.all(np.abs(means - mean) < of_mean * sd)
    if found.sampler != "emcee":
        assert means == pytest.approx(mean, rel=0.01)
    assert [one.sd for one in told.values()] == pytest.approx(sd, rel=of_sd)
    widths = sd / [prior.normals[0][2] for prior in priors.values()]
    assert [one.width for one in told.values()] == pytest.approx(widths, rel=of_sd)


def test_the_evidence_is_the_integral_of_the_likelihood():
    priors, predict, observed, *_ = linear_problem(1)
    found = posterior.sampled(priors, predict, observed)
    [(_, mean, sd)] = priors["p0"].normals
    theta = np.linspace(mean - 8.0 * sd, mean + 8.0 * sd, 20001)
    density = np.exp(posterior.log_likelihood(observed, *predict(theta[:, None]))) * stats.norm.pdf(theta, mean, sd)
    assert found.evidence == pytest.approx(np.log(np.trapezoid(density, theta)), abs=1e-3)


def test_the_discrepancy_is_integrated_over_its_half_normal_prior():
    observed = [Observed("a", "m", 2.0, 0.1, 0.1, 0.0, 0.2)]
    tau = np.abs(np.random.default_rng(1).standard_normal(400_000)) * 0.2
    wanted = np.mean(stats.norm.pdf(np.log(2.0), 0.5, np.sqrt(0.05**2 + tau**2)))
    found = posterior.log_likelihood(observed, np.array([[0.5]]), np.zeros((1, 1)))
    assert np.exp(found[0]) == pytest.approx(wanted, rel=0.01)


@pytest.mark.parametrize("away", [-0.3, -0.02, 0.0, 0.05, 0.4])
@pytest.mark.parametrize(
    "minus, plus, others", [(0.05, 0.2, 0.03), (0.2, 0.05, 0.1), (0.1, 0.1, 0.05), (0.05, 0.2, 0.0)]
)
def test_unequal_errors_are_a_split_normal_distribution(away, minus, plus, others):
    """Against the integral over the truth; where nothing else is uncertain, the density itself."""

    def density(truth):
        side = plus if truth > 0.0 else minus
        return 2.0 / (minus + plus) / np.sqrt(2.0 * np.pi) * np.exp(-0.5 * (truth / side) ** 2)

    observed = [Observed("a", "m", 2.0, 2.0 * minus, 2.0 * plus, others, 0.0)]
    found = np.exp(posterior.log_likelihood(observed, np.array([[np.log(2.0) + away]]), np.zeros((1, 1))))[0]
    truth = np.linspace(-2.0, 2.0, 400_001)
    weight = stats.norm.pdf(truth, away, others) if others else None
    wanted = density(away) if weight is None else np.trapezoid(np.vectorize(density)(truth) * weight, truth)
    assert found == pytest.approx(wanted, rel=1e-5)


@pytest.mark.parametrize("size", [1, 4])
def test_one_of_several_values_has_the_chance_of_bayes_theorem(size):
    """Three kinds of ground with another size each, and parameters that only scatter it: by importance and by
    walkers."""
    level, scatter, error = np.array([0.0, 0.3, 0.5]), 0.1, 0.1
    priors = {"ground": Prior(distribution="choices", values=("sand", "clay", "rock"))}
    priors |= {f"p{k}": normal(0.0, 1.0) for k in range(size)}

    def predict(theta):
        return (level[theta[:, 0].astype(int)] + scatter * theta[:, 1:].sum(axis=1))[:, None], np.zeros(
            (len(theta), 1)
        )

    size_seen = np.exp(0.22)
    observed = [Observed("a", "m", size_seen, error * size_seen, error * size_seen, 0.0, 0.0)]
    found = posterior.sampled(priors, predict, observed)
    assert found.sampler == ("emcee" if size == 4 else "importance sampling")
    likely = stats.norm.pdf(0.22, level, np.sqrt(size * scatter**2 + error**2))
    told = posterior.told(priors, found)["ground"]
    assert told.chances == pytest.approx(likely / likely.sum(), abs=0.005 if size == 1 else 0.03)
    assert told.width == pytest.approx(np.sqrt((1.0 - np.sum(np.square(told.chances))) / (2.0 / 3.0)), rel=1e-3)
    assert np.isnan(told.mean)


def calibration(mean, sd, theta):
    """Ranks (DRAWS, 3) of truths drawn from the priors among their posteriors, and widths of these over the priors',
    for a model that says ``mean`` and ``sd`` (n, 1) of ln D at ``theta`` (n, 3)."""
    rng = np.random.default_rng(12)
    truths = posterior.theta_of(law.PRIORS, rng.uniform(size=(DRAWS, 3)))
    tau = DISCREPANCY * np.abs(rng.standard_normal(DRAWS))
    error = np.sqrt((0.8 / 14.5) ** 2 + (0.6 / 14.5) ** 2 + tau**2) * rng.standard_normal(DRAWS)
    ranks, widths = [], []
    inner = coordinates(theta)
    for truth, size in zip(truths, np.exp(law.log_diameter(truths) + error)):
        observed = law.observed(size, 0.8 / 14.5 * size, 0.6 / 14.5, DISCREPANCY)
        weight = posterior.weighted(tuple(law.PRIORS), theta, posterior.log_likelihood(observed, mean, sd)).weight
        ranks.append(weight @ (theta < truth))
        widths.append(np.sqrt(weight @ inner**2 - (weight @ inner) ** 2))
    return np.array(ranks), np.array(widths) / inner.std(axis=0)


@pytest.fixture(scope="module")
def exact():
    theta = posterior.prior_draws(law.PRIORS, POINTS, 3)
    return calibration(*law.exactly(theta), theta)


def coverage(ranks, part):
    return np.mean(np.abs(ranks - 0.5) < 0.5 * part, axis=0)


def test_truths_from_the_prior_have_even_ranks_in_their_posteriors(exact):
    """Simulation-based calibration (Talts et al. 2018), 500 draws in 20 bins; coverage within two standard errors."""
    ranks, widths = exact
    for column in ranks.T:
        counts = np.histogram(column, bins=20, range=(0.0, 1.0))[0]
        assert stats.chisquare(counts).pvalue > 0.01
    assert coverage(ranks, 0.68) == pytest.approx(np.full(3, 0.68), abs=0.04)
    assert coverage(ranks, 0.95) == pytest.approx(np.full(3, 0.95), abs=0.02)
    # cohesion is what one diameter tells: coverage alone would not say that the others stay as they were assumed
    assert widths.mean(axis=0)[1] < 0.6 and np.all(widths.mean(axis=0)[[0, 2]] > posterior.IDENTIFIED)


def coordinates(theta):
    return posterior.all_coordinates(law.PRIORS, theta)


@pytest.mark.parametrize("noise", [0.0, pytest.param(0.04, marks=pytest.mark.validation)])
def test_48_runs_and_an_emulator_are_as_well_calibrated(exact, noise):
    theta = posterior.prior_draws(law.PRIORS, POINTS, 3)
    mean, sd = emulated(5, noise)[0].predict(coordinates(theta))
    ranks, widths = calibration(mean[:, None], sd[:, None], theta)
    assert coverage(ranks, 0.68) == pytest.approx(np.full(3, 0.68), abs=0.06)
    assert np.all(widths.mean(axis=0) <= 1.3 * exact[1].mean(axis=0))


def test_left_out_members_lie_where_the_others_say():
    made, _, y = emulated(5, SCATTER)
    z = made.left_out().z
    assert abs(z.mean()) < 2.0 / np.sqrt(RUNS) and 0.8 < z.std() < 1.2 and np.all(np.abs(z) < 3.0)
    assert made.left_out().rms < 0.06
    # the closed form is the process fitted to the others, its kernel kept
    from sklearn.gaussian_process import GaussianProcessRegressor

    inner = made._process
    for k in (0, 17):
        rest = np.arange(RUNS) != k
        again = GaussianProcessRegressor(inner.kernel_, alpha=inner.alpha[rest], optimizer=None)
        again.fit(inner.X_train_[rest], inner.y_train_[rest])
        mean, sd = again.predict(inner.X_train_[[k]], return_std=True)
        noise = inner.alpha[k]
        assert made.left_out().mean[k] == pytest.approx(y.mean() + y.std() * mean[0], abs=1e-6)
        assert made.left_out().sd[k] == pytest.approx(y.std() * np.sqrt(sd[0] ** 2 + noise), rel=1e-4)


def test_a_second_design_predicts_the_first_and_back():
    """Coverage of 96 predictions, within two standard errors (0.095) and some for what a design shares; the same of
    their parameters, each member inverted by the other design, and how far these are narrowed beside it."""
    inside, found = inverse_checks.second_design()
    assert len(inside) == len(found.ranks) == 2 * RUNS
    assert inside.mean() == pytest.approx(0.68, abs=0.12)
    assert found.within(0.68) == pytest.approx(np.full(3, 0.68), abs=0.12)
    assert found.within(0.95) == pytest.approx(np.full(3, 0.95), abs=0.05)
    told = found.contraction <= posterior.IDENTIFIED
    assert told.tolist() == [True, True, False] and found.contraction[1] < 0.5 and found.contraction[0] > 0.85


def test_runs_left_out_become_observations_and_are_found():
    """Ten members in turn: the truth lies in the 95 % of nine, for every parameter; cohesion alone is narrowed."""
    found = inverse_checks.left_out()
    assert len(found.ranks) == 10 and np.all(found.within(0.95) >= 0.9)
    assert (found.contraction <= posterior.IDENTIFIED).tolist() == [False, True, False]


@pytest.fixture(scope="module")
def another_code():
    return inverse_checks.another_code()


def test_runs_of_another_code_are_learned_from_each_other(another_code):
    """28 runs of Raducan et al. 2019: leave-one-out below half of what a plane through them leaves (0.116, 0.137)."""
    for members, count, rms in zip(another_code.members, (28, 24), (0.06, 0.11)):
        assert len(members.z) == count and members.rms < rms
        assert abs(members.z.mean()) < 2.0 / np.sqrt(count) and 0.8 < members.z.std() < 1.2
        assert np.abs(members.z).max() < 3.0


def test_runs_of_another_code_are_found_from_what_they_threw_out(another_code):
    """Each in turn by the others, from beta - 1 and mass: strength to a third of its prior, porosity not; which is
    what the directions said before."""
    found = another_code.covered
    assert len(found.ranks) == 24 and np.all(found.within(0.95) >= 0.9)
    strength, friction, porosity = found.contraction
    assert strength < 0.4 and friction < posterior.IDENTIFIED < porosity
    expected = [another_code.directions.width(name) for name in another_code.directions.parameters]
    assert expected == pytest.approx(found.contraction, abs=0.1)
    said = directions.sentences(
        another_code.directions, ["b", "m"], {n: n for n in ("strength", "friction", "porosity")}
    )
    assert "Friction and porosity are not told apart." in said


def two_measures(theta):
    """ln of a diameter and a depth: speed and size count by their product, friction a little, time not at all."""
    speed, size, friction = theta[:, 0], theta[:, 1], theta[:, 2]
    both = 0.3 * speed + 0.4 * size
    return np.stack([both - 0.01 * friction, both + 0.01 * friction], axis=1), np.zeros((len(theta), 2))


def test_what_only_counts_together_is_not_told_apart():
    """Singular values and widths of a linear law in closed form, and what is said of it."""
    priors = {name: normal(0.0, 1.0) for name in ("speed", "size", "friction", "time")}
    observed = [Observed(name, "m", 2.0, 0.1, 0.3, 0.0, 0.0) for name in ("a", "b")]
    found = directions.told_apart(priors, two_measures, observed)
    rows = np.array([[0.3, 0.4, -0.01, 0.0], [0.3, 0.4, 0.01, 0.0]]) / 0.1
    assert found.singular == pytest.approx([*np.linalg.svd(rows)[1], 0.0, 0.0], rel=1e-3, abs=1e-9)
    assert np.abs(found.vectors[:, 0]) == pytest.approx([0.6, 0.8, 0.0, 0.0], abs=1e-3)
    exact = np.linalg.inv(np.eye(4) + rows.T @ rows)
    assert [found.width(name) for name in priors] == pytest.approx(np.sqrt(np.diag(exact)), rel=0.03)
    alone = 1.0 / np.sqrt(1.0 + np.sum(rows**2, axis=0))
    assert [found.width(name, True) for name in priors] == pytest.approx(alone, rel=0.05)
    assert found.widths[:2] == pytest.approx(1.0 / np.sqrt(1.0 + found.singular[:2] ** 2), rel=0.05)
    said = directions.sentences(found, ["diameter", "depth"], {name: name for name in priors})
    assert said == [
        "Diameter and depth together fix 1 of 4 directions: speed × size.",
        "Speed and size are not told apart.",
        "Not told, for the data hardly depend on it: friction, time.",
    ]  # fmt: skip
    # a second measure that counts them otherwise tells them apart

    def another(theta):
        mean, sd = two_measures(theta)
        return np.stack([mean[:, 0], 0.5 * theta[:, 1]], axis=1), sd

    found = directions.told_apart(priors, another, observed)
    said = directions.sentences(found, ["diameter", "depth"], {name: name for name in priors})
    assert said[0].startswith("Diameter and depth together fix 2 of 4 directions: ")
    assert not any("told apart" in words for words in said)


def test_where_few_draws_are_near_the_data_the_slopes_say_the_widths():
    priors = {f"p{k}": normal(0.0, 1.0) for k in range(4)}
    observed = [Observed(f"m{k}", "m", 2.0, 0.02, 0.02, 0.0, 0.0) for k in range(4)]
    found = directions.told_apart(priors, lambda theta: (0.5 * theta, np.zeros(theta.shape)), observed)
    assert found.widths == pytest.approx(np.full(4, 1.0 / np.sqrt(1.0 + 50.0**2)), rel=1e-3)


def test_one_of_several_values_has_its_directions():
    """Three values: of both contrasts the data see the one in which the measure differs, its singular value the
    standard deviation of the measure over the error."""
    level = np.array([0.0, 0.3, 0.5])
    priors = {"ground": Prior(distribution="choices", values=("sand", "clay", "rock")), "time": normal(0.0, 1.0)}

    def predict(theta):
        return level[theta[:, 0].astype(int)][:, None], np.zeros((len(theta), 1))

    found = directions.told_apart(priors, predict, [Observed("a", "m", 2.0, 0.2, 0.2, 0.0, 0.0)])
    assert found.names == ("ground", "ground", "time")
    assert found.singular == pytest.approx([level.std() / 0.1, 0.0, 0.0], abs=1e-9)
    assert found.width("time") == pytest.approx(1.0, abs=0.02) and found.width("ground") < 0.8


def test_the_expected_width_is_that_of_posteriors_of_simulated_craters(exact):
    """Of a law that is far from linear, where slopes alone would promise twice as much."""
    found = directions.told_apart(law.PRIORS, law.exactly, law.observed(discrepancy=DISCREPANCY))
    simulated = np.sqrt(np.mean(exact[1] ** 2, axis=0))
    assert [found.width(name) for name in law.PRIORS] == pytest.approx(simulated, rel=0.05)
    assert 1.0 / np.sqrt(1.0 + found.singular[0] ** 2) < 0.6 * found.widths[0]
    [first, *_] = directions.sentences(found, ["diameter"], {name: name for name in law.PRIORS})
    assert first == "Diameter fixes 1 of 3 directions: cohesion."


@pytest.mark.parametrize("error", [0.05, 0.2, 5.0])
def test_the_gain_of_a_further_measure_has_its_closed_form(error):
    """Of a linear model and normal distributions, within 3 %: the covariance of the posterior with the measure too."""
    priors = {name: normal(0.0, 1.0) for name in ("one", "two")}
    before = np.array([[0.5, -0.3], [-0.3, 0.4]])
    slope = np.array([0.3, 0.1])
    rng = np.random.default_rng(3)
    points, truths = (rng.multivariate_normal([0.2, -0.1], before, count) for count in (8192, 256))
    mean, true = points @ slope, truths @ slope
    seen = expected_gain.looked(true, np.full(256, error**2), None, 1)
    found = expected_gain.widths(priors, points, mean, np.full(8192, error**2), seen)
    exact = np.linalg.inv(np.linalg.inv(before) + np.outer(slope, slope) / error**2)
    assert list(found.values()) == pytest.approx(np.sqrt(np.diag(exact)), rel=0.03)


def test_a_second_look_agrees_with_the_first():
    """Of a prior N(0, 1), ln y = theta with a model's error of 0.3 and one of 0.4, halved by looking again: what is
    seen is spread as given the first look, and on the average the truth stays where that left it."""
    model, error, first = 0.3, 0.4, 0.9
    known = Observed("a", "1", np.exp(first), error * np.exp(first), error * np.exp(first), 0.0, model)
    before = 1.0 / (1.0 + 1.0 / (model**2 + error**2))
    mean = before * first / (model**2 + error**2)
    truths = mean + np.sqrt(before) * stats.norm.ppf((np.arange(4096) + 0.5) / 4096)
    seen = expected_gain.looked(truths, np.full(4096, model**2 + 0.25 * error**2), known, 1)
    variance = model**2 + 0.25 * error**2
    assert np.mean(seen / (1.0 + variance)) == pytest.approx(mean, abs=0.01)
    # total variance: of the posteriors' means, and theirs
    after = variance / (1.0 + variance)
    assert np.var(seen / (1.0 + variance)) + after == pytest.approx(before, rel=0.01)


def test_the_discrepancy_widens_the_posterior_and_hardly_moves_it():
    told = list(inverse_checks.discrepancies().values())
    assert len(told) == 3
    for name in law.PRIORS:
        widths = [one[name].width for one in told]
        assert widths == sorted(widths) and widths[2] > 1.02 * widths[0]
        assert all(abs(one[name].mean - told[0][name].mean) < one[name].sd for one in told)


# the study of 26 November 2026: friction angle [deg], its standard deviation, information [nat], by prior (mean, sd)
# of the angle within 20 to 42 deg, and model error [m]; likelihood in the diameter itself
REFERENCE = [
    (("30 deg", "5 deg"), 0.0, 27.6, 3.6, 0.95),
    (("30 deg", "5 deg"), 0.6, 28.1, 3.8, 0.79),
    (("30 deg", "5 deg"), 1.2, 28.8, 4.2, 0.59),
    (("33 deg", "2.5 deg"), 0.6, 32.0, 2.4, 0.86),
]


@pytest.mark.parametrize("angle, error, mean, sd, information", REFERENCE)
def test_the_reference_posterior_of_ryugus_crater(angle, error, mean, sd, information):
    prior = Prior(distribution="normal", mean=angle[0], sd=angle[1], low="20 deg", high="42 deg")
    priors = {**law.PRIORS, "friction_angle": prior}
    theta = posterior.prior_draws(priors, 1 << 16, 1)
    likelihood = stats.norm.logpdf(14.5, np.exp(law.log_diameter(theta)), np.hypot(0.8, error))
    found = posterior.weighted(tuple(priors), theta, likelihood)
    told = posterior.told(priors, found)["friction_angle"]
    assert np.degrees(told.mean) == pytest.approx(mean, rel=0.02)
    assert np.degrees(told.sd) == pytest.approx(sd, rel=0.02, abs=0.05)  # it was rounded to 0.1
    gained = float(found.weight @ np.log(np.maximum(found.weight, 1e-300) * len(theta)))
    assert gained == pytest.approx(information, rel=0.02)
    # in logarithms, as the inversion compares: within 2 % of a quadrature on a fine grid
    ours = posterior.sampled(priors, law.exactly, law.observed(chain=error / 14.5))
    for level, value in zip((0.5, 0.84, 0.95), cohesion_on_a_grid(prior, error / 14.5)):
        assert ours.quantile("cohesion", level) == pytest.approx(value, rel=0.02)


def cohesion_on_a_grid(angle, chain):
    """Quantiles at 50, 84 and 95 % of the cohesion [Pa] by integrals over a grid with 400 cells of it."""
    cohesion = 10.0 ** (-3.0 + 5.0 * (np.arange(400) + 0.5) / 400)
    [(_, middle, width)] = angle.normals
    phi = np.linspace(*angle.limits, 61)
    density = np.linspace(790.0, 1590.0, 61)
    grid = np.stack(np.meshgrid(phi, cohesion, density, indexing="ij"), axis=-1).reshape(-1, 3)
    weight = stats.norm.pdf(grid[:, 0], middle, width) * stats.norm.pdf(grid[:, 2], 1190.0, 100.0)
    weight *= stats.norm.pdf(np.log(14.5), law.log_diameter(grid), np.hypot(0.8 / 14.5, chain))
    held = np.cumsum(weight.reshape(61, 400, 61).sum(axis=(0, 2)))
    edges = 10.0 ** (-3.0 + 5.0 * (np.arange(400) + 1.0) / 400)
    return [float(np.exp(np.interp(part, held / held[-1], np.log(edges)))) for part in (0.5, 0.84, 0.95)]


def test_the_laws_simulator_is_the_projects_law():
    """Of Hayabusa2's shot: gravity and strength as ``expected_crater`` interpolates, whatever diameter the case says;
    and 1 Pa of cohesion takes as much off the diameter as in the reference law."""
    sets = ("sph.damage=false", "sph.materials.basalt.predamaged=false")
    sizes = []
    for cohesion in ("0 Pa", "1 Pa"):
        key = "sph.materials.basalt.drucker_prager.cohesion"
        case = cases.read(Path("sci_ryugu"), "quick", (*sets, f'{key}="{cohesion}"'))
        sizes.append(scaling_members.diameter(case))
        other = cases.read(
            Path("sci_ryugu"), "quick", (*sets, f'{key}="{cohesion}"', 'impact.expected_transient_diameter="3 m"')
        )
        assert scaling_members.diameter(other) == sizes[-1]
    event = crater_size.ImpactEvent(0.0376, 2000.0, 0.0, 1.2e-4, 8930.0, 1227.0)
    laws = [crater_size.LAWS[name](event) for name in crater_size.GROUNDS["sand"]]
    assert sizes[0] == pytest.approx(np.exp(np.mean(np.log(laws))), rel=0.01)
    # shear strength of the cone at 30 deg: sqrt(J2) = 6 c cos(phi) / (sqrt(3) (3 - sin(phi)))
    shear = 6.0 * np.cos(np.radians(30.0)) / (np.sqrt(3.0) * 2.5)
    theta = np.array([[np.radians(30.0), shear, 1227.0], [np.radians(30.0), 1e-9, 1227.0]])
    strength = np.exp(np.diff(law.log_diameter(theta)))[0]
    assert sizes[0] / sizes[1] == pytest.approx(strength, rel=0.03)
