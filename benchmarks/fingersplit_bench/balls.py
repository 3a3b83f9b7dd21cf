"""Section `balls`: the share of feasible starts over the diameter of a ball and the thickness of a card, by hand."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure as Drawing

from fingersplit.hands.hand import Hand
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.parametric import box, sphere
from fingersplit.objects.preparing import prepare_object
from fingersplit.planning.search import find_grasps
from fingersplit_bench.hands import hands_there
from fingersplit_bench.suite import Bench, Chapter, table

__all__ = ["balls_chapter", "feasible_shares", "gaps"]

DIAMETERS = range(15, 121)
"""[mm]"""
THICKNESSES = [number / 10 for number in range(2, 31)]
"""[mm]"""
CARD = 85.6e-3, 54e-3
"""Length and width of a bank card [m]."""
BALLS, CARDS = "balls.png", "cards.png"

Shares = dict[str, list[float]]
"""By hand, the share of starts that are feasible on the object of each size."""


def balls_chapter(bench: Bench) -> Chapter:
    """Plan on balls of 15 to 120 mm and on cards of 0.2 to 3 mm, and plot how many starts end in a feasible grasp."""
    hands, missing = hands_there(bench.hand.name)
    balls = feasible_shares(hands, lambda size: sphere(size / 2000), DIAMETERS, bench.starts, bench.note)
    _draw(bench.folder / BALLS, DIAMETERS, balls, "diameter of the ball [mm]")
    cards = feasible_shares(hands, lambda size: box((*CARD, size / 1000)), THICKNESSES, bench.starts, bench.note)
    _draw(bench.folder / CARDS, THICKNESSES, cards, "thickness of the card [mm]")
    text = (
        f"Share of {bench.starts} starts that end in a feasible grasp, one seed. A gap is a size without any, between "
        "sizes that have some.\n\n"
        f"Balls of 15 to 120 mm in steps of 1 mm:\n\n{_table(DIAMETERS, balls)}\n\n"
        f"![Share of feasible starts over the diameter]({BALLS})\n\n"
        f"Cards of 0.2 to 3 mm in steps of 0.1 mm:\n\n{_table(THICKNESSES, cards)}\n\n"
        f"![Share of feasible starts over the thickness]({CARDS})\n"
    )
    text += f"\nLeft out: {'; '.join(missing)}\n" if missing else ""
    data = {"diameters_mm": list(DIAMETERS), "feasible_shares": balls}
    data |= {"thicknesses_mm": THICKNESSES, "feasible_shares_of_cards": cards}
    return Chapter("Balls from 15 to 120 mm, cards from 0.2 to 3 mm", text, data=data)


def feasible_shares(
    hands: Sequence[Hand],
    make: Callable[[float], Mesh],
    sizes: Sequence[float],
    starts: int,
    note: Callable[[str], None] = lambda _: None,
) -> Shares:
    """Share of ``starts`` that are feasible on the object of each size [mm], by hand."""
    shares: Shares = {hand.name: [] for hand in hands}
    for size in sizes:
        note(f"planning on {size:g} mm")
        model = prepare_object(make(size), f"{size:g} mm")
        for hand in hands:
            found = find_grasps(model, hand, starts=starts, seed=0, top_k=1)
            shares[hand.name].append(found.feasible / found.starts)
    return shares


def gaps(sizes: Sequence[float], shares: Sequence[float]) -> list[float]:
    """Sizes at which no start is feasible, between two at which some are."""
    grasped = [place for place, share in enumerate(shares) if share > 0]
    inner = range(grasped[0], grasped[-1]) if grasped else range(0)
    return [sizes[place] for place in inner if shares[place] == 0]


def _table(sizes: Sequence[float], shares: Mapping[str, Sequence[float]]) -> str:
    headings = ["hand", "from", "to", "mean between", "least between", "at", "gaps"]
    return table(headings, [[name, *_cells(sizes, of_hand)] for name, of_hand in shares.items()])


def _cells(sizes: Sequence[float], shares: Sequence[float]) -> list[str]:
    grasped = [place for place, share in enumerate(shares) if share > 0]
    if not grasped:
        return ["none", *[""] * 5]
    first, last = grasped[0], grasped[-1]
    between = shares[first : last + 1]
    least = min(range(len(between)), key=between.__getitem__)
    missed = ", ".join(f"{size:g}" for size in gaps(sizes, shares)) or "none"
    cells = [f"{sizes[first]:g} mm", f"{sizes[last]:g} mm", f"{sum(between) / len(between):.0%}"]
    return [*cells, f"{between[least]:.0%}", f"{sizes[first + least]:g} mm", missed]


def _draw(path: Path, sizes: Sequence[float], shares: Mapping[str, Sequence[float]], label: str) -> None:
    figure = Drawing(figsize=(7.0, 3.4), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    for number, (name, of_hand) in enumerate(shares.items()):
        axes.plot(list(sizes), list(of_hand), linewidth=2.2 if number == 0 else 1.1, label=name)
    axes.set(xlabel=label, ylabel="feasible starts", ylim=(-0.02, 1.03), xlim=(sizes[0], sizes[-1]))
    axes.grid(alpha=0.3)
    figure.legend(loc="outside right center", fontsize=8, frameon=False)
    figure.savefig(path)
