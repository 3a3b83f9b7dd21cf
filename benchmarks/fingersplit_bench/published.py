"""What others published, to be read beside our own figures."""

from collections.abc import Mapping

from fingersplit_bench.suite import Figure, table

__all__ = ["compare_with_published"]

PUBLISHED = (
    (
        "finger splitting [Fan2018]",
        "Barrett, 8 free joints",
        "4.0 GHz PC, Matlab",
        "582 ms a grasp",
        "One run from one parallel grasp that is given; no forces, no ranking.",
    ),
    (
        "FRoGGeR [Li2023]",
        "Barrett",
        "2 CPU cores",
        "0.41 s of CPU a grasp (median), 1.9 s (mean)",
        "Our own run of its public code. It optimises force closure itself (min-weight metric) under collision "
        "constraints; we climb contact area and joint range, and rank afterwards.",
    ),
    (
        "BODex [Chen2024]",
        "Shadow, Allegro, Leap",
        "one RTX 3090",
        "about 50 grasps/s",
        "Hands with 16 and more joints; optimises contact forces by batched QPs; thousands of grasps at once.",
    ),
    (
        "Lightning Grasp [Yin2025]",
        "several, many-jointed",
        "one A100",
        "300-1000 grasps/s",
        "Counts effective samples of a batch that takes 2 to 5 s; contacts anywhere on the hand.",
    ),
)


def compare_with_published(figures: Mapping[str, Figure], starts: int) -> str:
    """Markdown table of published figures, with ours from this run below them."""
    ours = [
        "this run",
        "Barrett, 8 free joints",
        "one thread of this machine",
        f"{figures['feasible_per_second'].value:,.0f} feasible grasps/s, "
        f"{figures['best_of_64_ms'].value:.0f} ms for a ranked best of {starts}",
        "Feasible means contact, joint limits, pad angle and collision by our own measure, not a lift.",
    ]
    note = (
        "None of these is a like-for-like comparison: hands, objects, hardware and above all what counts as a grasp "
        "differ, as the last column says. The measured comparison on the same starts is the section on IPOPT."
    )
    headings = ["planner", "hand", "hardware", "figure", "what differs"]
    return table(headings, [*PUBLISHED, ours], left=len(headings)) + f"\n\n{note}"
