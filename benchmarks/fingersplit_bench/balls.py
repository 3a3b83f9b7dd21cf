"""Section `balls`: the share of feasible starts over the diameter of a ball and the thickness of a card."""

from collections.abc import Callable, Sequence
from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure as Drawing

from fingersplit.hands.hand import Hand
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.parametric import box, sphere
from fingersplit.objects.preparing import prepare_object
from fingersplit.planning.search import find_grasps
from fingersplit_bench.suite import Bench, Chapter

__all__ = ["balls_chapter", "feasible_shares"]

DIAMETERS = range(15, 121)
"""[mm]"""
THICKNESSES = [number / 10 for number in range(2, 31)]
"""[mm]"""
CARD = 85.6e-3, 54e-3
"""Length and width of a bank card [m]."""
BALLS, CARDS = "balls.png", "cards.png"


def balls_chapter(bench: Bench) -> Chapter:
    """Plan on balls of 15 to 120 mm and on cards of 0.2 to 3 mm, and plot how many starts end in a feasible grasp."""
    bench.note("balls of 15 to 120 mm")
    balls = feasible_shares(bench.hand, lambda diameter: sphere(diameter / 2000), DIAMETERS, bench.starts)
    _draw(bench.folder / BALLS, DIAMETERS, balls, "diameter of the ball [mm]")
    bench.note("cards of 0.2 to 3 mm")
    cards = feasible_shares(bench.hand, lambda thickness: box((*CARD, thickness / 1000)), THICKNESSES, bench.starts)
    _draw(bench.folder / CARDS, THICKNESSES, cards, "thickness of the card [mm]")
    text = (
        f"Share of {bench.starts} starts that end in a feasible grasp, one seed.\n\n"
        f"Balls of 15 to 120 mm in steps of 1 mm: {_said(DIAMETERS, balls)}.\n\n"
        f"![Share of feasible starts over the diameter]({BALLS})\n\n"
        f"Cards of 0.2 to 3 mm in steps of 0.1 mm: {_said(THICKNESSES, cards)}.\n\n"
        f"![Share of feasible starts over the thickness]({CARDS})\n"
    )
    data = {"diameters_mm": list(DIAMETERS), "feasible_shares": balls}
    data |= {"thicknesses_mm": THICKNESSES, "feasible_shares_of_cards": cards}
    return Chapter("Balls from 15 to 120 mm, cards from 0.2 to 3 mm", text, data=data)


def feasible_shares(hand: Hand, make: Callable[[float], Mesh], sizes: Sequence[float], starts: int) -> list[float]:
    """Share of ``starts`` that are feasible on the object of each size [mm]."""
    shares = []
    for size in sizes:
        model = prepare_object(make(size), f"{size:g} mm")
        runs = find_grasps(model, hand, starts=starts, seed=0, top_k=1).runs
        shares.append(sum(run.feasible for run in runs) / starts)
    return shares


def _said(sizes: Sequence[float], shares: Sequence[float]) -> str:
    worst = min(range(len(shares)), key=shares.__getitem__)
    return f"mean {sum(shares) / len(shares):.0%}, least {shares[worst]:.0%} at {sizes[worst]:g} mm"


def _draw(path: Path, sizes: Sequence[float], shares: Sequence[float], label: str) -> None:
    figure = Drawing(figsize=(7.0, 2.8), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    axes.plot(list(sizes), list(shares), linewidth=1.2)
    axes.set(xlabel=label, ylabel="feasible starts", ylim=(0, 1.03), xlim=(sizes[0], sizes[-1]))
    axes.grid(alpha=0.3)
    figure.savefig(path)
