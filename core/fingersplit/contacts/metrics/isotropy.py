"""How evenly contact forces become wrenches."""

from fingersplit.contacts.metric import GraspState, Metric

__all__ = ["METRIC"]


def _isotropy(state: GraspState) -> float:
    """sigma_min(G) / sigma_max(G)."""
    singular = state.space.singular_values
    return float(singular[-1] / singular[0])


METRIC = Metric(
    name="isotropy",
    title="isotropy",
    unit="",
    meaning="Smallest over largest singular value of the grasp matrix, 0 to 1",
    higher_is_better=True,
    source="Kim2001",
    function=_isotropy,
    symbol="Q_iso",
    in_tables=False,
    recorded_states=None,
    order=20,
)
