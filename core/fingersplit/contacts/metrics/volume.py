"""The size of the wrench ellipsoid."""

import numpy as np

from fingersplit.contacts.metric import GraspState, Metric

__all__ = ["METRIC"]


def _volume(state: GraspState) -> float:
    """sqrt(det(G G^T)), the volume up to a constant."""
    return float(np.prod(state.space.singular_values))


METRIC = Metric(
    name="volume",
    title="wrench volume",
    unit="N^6",
    meaning="Volume of the wrench ellipsoid of unit contact forces, torques over the object's radius",
    higher_is_better=True,
    source="Li1988",
    function=_volume,
    symbol="Q_vol",
    in_tables=False,
    recorded_states=None,
    order=21,
)
