"""How a grasp improves from state to state: metrics along a trace, brought to one length and one scale."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fingersplit.contacts.metric import GraspState
from fingersplit.contacts.metrics import available_metrics
from fingersplit.contacts.wrench_space import WrenchSpace
from fingersplit.objects.model import ObjectModel
from fingersplit.splitting.trace import Trace

__all__ = ["METRICS", "mean_and_deviation", "metric_profiles", "normalised", "resampled"]

METRICS = ("Q", "Q_iso", "Q_vol", "Ferrari-Canny")
"""The four that the paper shows."""
_NAMES = ("quality", "isotropy", "volume", "ferrari_canny")
LENGTH = 60
"""States that every profile is brought to."""


def metric_profiles(trace: Trace, model: ObjectModel, friction: float) -> dict[str, NDArray[np.float64]]:
    """Every metric of ``METRICS`` over the states of a trace, (T,) each."""
    states = [
        GraspState(WrenchSpace(contacts, normals, friction, model.center_of_mass, model.radius), scores[:3])
        for contacts, normals, scores in zip(trace.contacts, trace.normals, trace.scores, strict=True)
    ]
    known = available_metrics()
    return {
        title: np.array([known[name].function(state) for state in states], dtype=np.float64)
        for title, name in zip(METRICS, _NAMES, strict=True)
    }


def resampled(profile: NDArray[np.float64], length: int = LENGTH) -> NDArray[np.float64]:
    """A profile (T,) stretched to ``length`` values, linear in between, ends kept."""
    return np.interp(np.linspace(0, len(profile) - 1, length), np.arange(len(profile)), profile)


def normalised(profile: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """A profile (T,) moved and scaled to 0..1; None when it never changes and so has no trend."""
    low, high = profile.min(), profile.max()
    return (profile - low) / (high - low) if high > low else None


def mean_and_deviation(
    profiles: Sequence[NDArray[np.float64]], length: int = LENGTH
) -> tuple[NDArray[np.float64], NDArray[np.float64], int]:
    """Mean and standard deviation (length,) of profiles, resampled and normalised, and how many have a trend."""
    scaled = [normalised(resampled(profile, length)) for profile in profiles]
    kept = [profile for profile in scaled if profile is not None]
    if not kept:
        return np.zeros(length), np.zeros(length), 0
    return np.mean(kept, axis=0), np.std(kept, axis=0), len(kept)
