"""The largest disturbance that a grasp resists from everywhere."""

from scipy.spatial import ConvexHull, QhullError

from fingersplit.contacts.metric import GraspState, Metric

__all__ = ["METRIC"]


def _ferrari_canny(state: GraspState) -> float:
    """The L1 form: radius of the largest ball about the origin inside the convex hull of all cone-edge wrenches.

    0 without force closure. Exact for the inscribed pyramids of ``contacts.cones``.
    """
    wrenches = state.space.cone_wrenches()
    for options in ("Q0", "Qx"):  # without merging facets three times as fast, where rounding allows it
        try:
            hull = ConvexHull(wrenches, qhull_options=options)
        except QhullError:  # wrenches that span no six-dimensional volume close no grasp
            continue
        return max(0.0, float(-hull.equations[:, -1].max()))
    return 0.0


METRIC = Metric(
    name="ferrari_canny",
    title="Ferrari-Canny",
    unit="N",
    meaning="Largest wrench resisted in every direction by normal forces of 1 N in total, torques over the object's "
    "radius",
    higher_is_better=True,
    source="Ferrari1992",
    function=_ferrari_canny,
    order=22,
)
