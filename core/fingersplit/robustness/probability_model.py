"""Calibrated models of the probability of holding: coefficients as data, and how they are fitted.

A logistic model p = 1 / (1 + exp(-w . z - b)) of standardized features z, fitted to shares of executions that held by
penalized maximum likelihood. The coefficients of a hand stand in ``coefficients/HAND.json`` with where they come from;
``fingersplit bench --only holding --refit`` writes them anew.
"""

import json
from dataclasses import asdict, dataclass
from functools import lru_cache
from importlib.resources import files
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.special import expit

from fingersplit.errors import SettingsError
from fingersplit.hands.hand import Hand

__all__ = ["COEFFICIENTS", "HoldModels", "LogisticModel", "load_models"]

COEFFICIENTS = Path(str(files("fingersplit.robustness"))) / "coefficients"
GENERAL = "barrett"
"""Hands without coefficients of their own take those of this one."""
PENALTY = 0.01
"""Of squared weights in the mean log likelihood."""


@dataclass(frozen=True)
class LogisticModel:
    """One logistic model.

    Attributes:
        features: Names of the features, in their order.
        means: What is subtracted from each.
        scales: What it is divided by then.
        weights: Weight of each.
        intercept: Added to the weighted sum.
    """

    features: tuple[str, ...]
    means: tuple[float, ...]
    scales: tuple[float, ...]
    weights: tuple[float, ...]
    intercept: float

    def __call__(self, rows: NDArray[np.float64]) -> NDArray[np.float64]:
        """Probabilities (n,) of feature rows (n, features)."""
        z = (rows - np.array(self.means)) / np.array(self.scales)
        return np.asarray(expit(z @ np.array(self.weights) + self.intercept))

    @classmethod
    def from_document(cls, document: dict[str, Any]) -> Self:
        """From what ``asdict`` gives, as it comes back from JSON."""
        return cls(
            tuple(document["features"]),
            tuple(document["means"]),
            tuple(document["scales"]),
            tuple(document["weights"]),
            float(document["intercept"]),
        )

    @classmethod
    def fit(cls, features: tuple[str, ...], rows: NDArray[np.float64], held: NDArray[np.float64]) -> Self:
        """Fit to the share of executions that held, (n,), of grasps with feature rows (n, features)."""
        means, scales = rows.mean(axis=0), np.maximum(rows.std(axis=0), 1e-6)
        z = np.column_stack([np.ones(len(rows)), (rows - means) / scales])
        penalty = np.r_[0.0, np.full(rows.shape[1], PENALTY)]

        def loss(w: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
            eta = z @ w
            value = np.mean(np.logaddexp(0.0, eta) - held * eta) + penalty @ w**2
            return float(value), z.T @ (expit(eta) - held) / len(held) + 2.0 * penalty * w

        w = minimize(loss, np.zeros(z.shape[1]), jac=True, method="L-BFGS-B").x.tolist()
        return cls(features, tuple(means.tolist()), tuple(scales.tolist()), tuple(w[1:]), w[0])


@dataclass(frozen=True)
class HoldModels:
    """The models of a hand.

    Attributes:
        estimate: From surface and kinematic closings.
        closings: From simulated closings.
        prior_strength: How many executions the latter counts for where executions are simulated, too.
        provenance: What they were fitted on, and how well they did on objects that were left out.
    """

    estimate: LogisticModel
    closings: LogisticModel
    prior_strength: float
    provenance: dict[str, Any]

    @classmethod
    def read(cls, path: Path) -> Self:
        """From a file that ``write`` wrote.

        Raises:
            SettingsError: The file holds something else.
        """
        try:
            document = json.loads(path.read_text())
            estimate, closings = (LogisticModel.from_document(document[name]) for name in ("estimate", "closings"))
            return cls(estimate, closings, float(document["prior_strength"]), document["provenance"])
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise SettingsError(f"{path} holds no coefficients of p_hold: {error!r}; refit them.") from error

    def write(self, path: Path) -> None:
        """As a JSON file."""
        path.write_text(json.dumps(asdict(self), indent=1) + "\n")


def load_models(hand: Hand) -> HoldModels:
    """The models of a hand; those of ``GENERAL`` where it has none of its own."""
    return _read(hand.name.partition("@")[0])


@lru_cache(maxsize=16)
def _read(name: str) -> HoldModels:
    own = COEFFICIENTS / f"{name}.json"
    return HoldModels.read(own if own.exists() else COEFFICIENTS / f"{GENERAL}.json")
