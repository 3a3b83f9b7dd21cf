"""The metrics of a grasp: every module of this folder defines one ``Metric``, and nothing else lists them."""

from functools import cache

from fingersplit.contacts.metric import GraspState, Metric
from fingersplit.registry import find_by_name

__all__ = ["assess", "available_metrics"]


@cache
def available_metrics() -> dict[str, Metric]:
    """Every metric by name, in the order of documents and tables."""
    found = find_by_name(__name__, Metric)
    return dict(sorted(found.items(), key=lambda entry: (entry[1].order, entry[0])))


def assess(state: GraspState) -> dict[str, float | None]:
    """Every metric of a grasp by name; None where a metric has no number for it."""
    return {name: metric.function(state) for name, metric in available_metrics().items()}
