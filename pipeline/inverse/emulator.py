"""A measure of the members as a function of what was drawn: a Gaussian process of scikit-learn.

    ln y(x) = b_0 + b.x + g(x) + e,      g ~ GP(0, s^2 Matern_5/2(|x - x'| / l)),   e ~ N(0, nugget + noise)

x (n, d) are the parameters, each less its mean over its standard deviation in the design; a length l for each of
them. The linear mean has a normal prior (kernel ``DotProduct``); s, l, b's scale and the nugget maximise the
likelihood. ``noise`` (n,) is the known variance of each member. Leaving member i out of the fitted process, K its
covariance (Rasmussen & Williams 2006, Gaussian Processes for Machine Learning, eqs. 5.12):

    mean_i = y_i - [K^-1 y]_i / [K^-1]_ii,      variance_i = 1 / [K^-1]_ii
"""

from __future__ import annotations

import warnings
from typing import Any, NamedTuple

import numpy as np

from matter.errors import InputError

RESTARTS = 4
_BLOCK = 1 << 14
"""Points that are predicted at once."""


class LeftOut(NamedTuple):
    """Each member as the others predict it: ``truth``, ``mean`` and ``sd`` (n,) of ln y."""

    truth: np.ndarray
    mean: np.ndarray
    sd: np.ndarray

    @property
    def z(self) -> np.ndarray:
        """(n,) deviations over their standard errors: mean 0, standard deviation 1 where the emulator is honest."""
        return (self.truth - self.mean) / self.sd

    @property
    def rms(self) -> float:
        """Root mean square of the deviations."""
        return float(np.sqrt(np.mean((self.truth - self.mean) ** 2)))


class Emulator:
    """The process fitted to ``x`` (n, d) and ``y`` (n,), both real; ``noise`` (n,): variance of y that is known;
    ``kernel`` (d + 3,): the logarithms of s^2, the lengths, b's scale and the nugget of one that was fitted before, in
    the order of scikit-learn."""

    def __init__(
        self, x: np.ndarray, y: np.ndarray, noise: np.ndarray, seed: int = 1, kernel: np.ndarray | None = None
    ) -> None:
        require()
        from sklearn.gaussian_process import GaussianProcessRegressor
        from sklearn.gaussian_process.kernels import ConstantKernel, DotProduct, Matern, WhiteKernel

        self._at, self._by = x.mean(axis=0), x.std(axis=0)
        self._by[self._by == 0.0] = 1.0
        self._level, self._size = float(y.mean()), float(y.std()) or 1.0
        form = (
            ConstantKernel(0.3, (1e-4, 1e2)) * Matern(np.full(x.shape[1], 3.0), (0.3, 1e2), nu=2.5)
            + ConstantKernel(1.0, (1e-4, 1e2)) * DotProduct(1.0, "fixed")
            + WhiteKernel(1e-3, (1e-8, 1.0))
        )
        process = GaussianProcessRegressor(
            form if kernel is None else form.clone_with_theta(kernel),
            alpha=noise / self._size**2 + 1e-10,
            optimizer="fmin_l_bfgs_b" if kernel is None else None,
            n_restarts_optimizer=RESTARTS,
            random_state=seed,
        )
        with warnings.catch_warnings():  # a length at its limit says that a parameter does not matter
            warnings.simplefilter("ignore")
            self._process: Any = process.fit(self._scaled(x), (y - self._level) / self._size)
        self._y = y

    @property
    def kernel(self) -> np.ndarray:
        """What was fitted, as ``kernel`` takes it (d + 3,)."""
        return np.asarray(self._process.kernel_.theta)

    def _scaled(self, x: np.ndarray) -> np.ndarray:
        return (x - self._at) / self._by

    def predict(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean and standard deviation (m,) of y at ``x`` (m, d), the nugget included."""
        parts = [
            self._process.predict(self._scaled(x[k : k + _BLOCK]), return_std=True) for k in range(0, len(x), _BLOCK)
        ]
        mean, sd = (np.concatenate(columns) for columns in zip(*parts))
        return self._level + self._size * mean, self._size * sd

    def left_out(self) -> LeftOut:
        """Every member predicted by the others, the kernel as it was fitted to all."""
        from scipy.linalg import cho_solve

        diagonal = np.diag(cho_solve((self._process.L_, True), np.eye(len(self._y))))
        mean = self._y - self._size * self._process.alpha_ / diagonal
        return LeftOut(self._y, mean, self._size / np.sqrt(diagonal))


def require() -> None:
    """Raise ``InputError`` where the libraries of an inversion are not installed."""
    try:
        import emcee
        import sklearn  # noqa: F401
    except ImportError as missing:
        raise InputError(f"--invert needs {missing.name}: pip install 'bolide[inverse]'") from None
    assert emcee
