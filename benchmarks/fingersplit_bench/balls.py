"""Section `balls`: the share of feasible starts over the diameter of a ball."""

from collections.abc import Sequence
from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure as Drawing

from fingersplit.hands.hand import Hand
from fingersplit.objects.parametric import sphere
from fingersplit.objects.preparing import prepare_object
from fingersplit.planning.search import find_grasps
from fingersplit_bench.suite import Bench, Chapter

__all__ = ["balls_chapter", "feasible_shares"]

DIAMETERS = range(15, 121)
"""[mm]"""
PICTURE = "balls.png"


def balls_chapter(bench: Bench) -> Chapter:
    """Plan on balls of 15 to 120 mm in steps of 1 mm and plot how many starts end in a feasible grasp."""
    bench.note("balls of 15 to 120 mm")
    shares = feasible_shares(bench.hand, DIAMETERS, bench.starts)
    _draw(bench.folder / PICTURE, DIAMETERS, shares)
    worst = min(range(len(shares)), key=shares.__getitem__)
    text = (
        f"Share of {bench.starts} starts that end in a feasible grasp of a ball, one seed: mean "
        f"{sum(shares) / len(shares):.0%}, least {shares[worst]:.0%} at {DIAMETERS[worst]} mm.\n\n"
        f"![Share of feasible starts over the diameter]({PICTURE})\n"
    )
    return Chapter("Balls from 15 to 120 mm", text, data={"diameters_mm": list(DIAMETERS), "feasible_shares": shares})


def feasible_shares(hand: Hand, diameters: Sequence[int], starts: int) -> list[float]:
    """Share of ``starts`` that are feasible on a ball of each diameter [mm]."""
    shares = []
    for diameter in diameters:
        ball = prepare_object(sphere(diameter / 2000), f"ball of {diameter} mm")
        runs = find_grasps(ball, hand, starts=starts, seed=0, top_k=1).runs
        shares.append(sum(run.feasible for run in runs) / starts)
    return shares


def _draw(path: Path, diameters: Sequence[int], shares: Sequence[float]) -> None:
    figure = Drawing(figsize=(7.0, 2.8), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    axes.plot(list(diameters), list(shares), linewidth=1.2)
    axes.set(xlabel="diameter of the ball [mm]", ylabel="feasible starts", ylim=(0, 1.03), xlim=(15, 120))
    axes.grid(alpha=0.3)
    figure.savefig(path)
