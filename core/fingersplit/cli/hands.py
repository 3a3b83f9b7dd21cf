"""The commands about hands: list them, and compile the kernels for them."""

import typer
from rich.console import Console

__all__ = ["hands", "warm"]


def hands() -> None:
    """List the hands that can be planned for."""
    from fingersplit.hands.hand import available_hands, load_hand
    from fingersplit.hands.public_hands import described_hands

    for name in available_hands():
        hand = load_hand(name)
        typer.echo(f"{name}: {hand.title}; {len(hand.chains)} fingers, {len(hand.joint_names)} joints")
    for name in described_hands():
        typer.echo(f"{name}@FOLDER: the model is yours, its description ships")


def warm() -> None:
    """Compile the planner's kernels, so that the first plan does not wait for it."""
    from fingersplit.cli.warming import compile_kernels
    from fingersplit.hands.hand import available_hands, load_hand

    with Console(stderr=True).status("compiling the kernels (a few minutes with an empty cache)"):
        compile_kernels([load_hand(name) for name in available_hands()])
