"""The commands about recordings: make one from a stored result, look at one, set up the viewer of the web pages."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Annotated

import typer

from fingersplit.cli.output import check_writable
from fingersplit.errors import ViewerError

__all__ = ["record", "review", "setup_viewer"]


def record(
    result: Annotated[Path, typer.Argument(help="Result, as `plan --json` writes it.", exists=True, dir_okay=False)],
    file: Annotated[
        Path, typer.Option("--object", help="The object's file that was planned for.", exists=True, dir_okay=False)
    ],
    rank: Annotated[int, typer.Option(help="Rank of the grasp to record.", min=1)] = 1,
    hand: Annotated[
        str | None, typer.Option(help="Name, folder or zip of the hand; default: the one of the result by its name.")
    ] = None,
    obstacle: Annotated[
        list[Path] | None,
        typer.Option(help="File of a mesh or cloud among the obstacles; repeatable.", exists=True, dir_okay=False),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Recording to write.", show_default="RESULT with the suffix .rrd"),
    ] = None,
) -> None:
    """Record a stored grasp: its search is repeated, which must give the same grasp, and so is its verification."""
    from fingersplit.cli.objects import load_origin, obstacle_files
    from fingersplit.objects.convex_pieces import decompose
    from fingersplit.recording.replay import replay
    from fingersplit.recording.run_recording import write_recording
    from fingersplit.result import read_result

    path = output or result.with_suffix(".rrd")
    check_writable(path)
    stored = read_result(result)
    stored.grasp(rank)
    model, known_hand = load_origin(stored, file, hand)
    around = obstacle_files(obstacle or [])
    replayed = replay(stored, rank, model, known_hand, lambda: decompose(model.mesh), around)
    write_recording(path, replayed, model, known_hand)
    typer.echo(f"Wrote {path}: {len(replayed.trace)} states, {path.stat().st_size / 1e6:.1f} MB.")


def review(
    recording: Annotated[Path, typer.Argument(help="Recording, .rrd.", exists=True, dir_okay=False)],
) -> None:
    """Open a recording in rerun's viewer; without a display, look at it in the browser under /review."""
    # The viewer itself ends without an error where it finds no display.
    if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise ViewerError(
            "rerun's viewer needs a display, and neither DISPLAY nor WAYLAND_DISPLAY is set. "
            "`fingersplit serve` shows recordings in the browser, under /review."
        )
    viewer = subprocess.run([sys.executable, "-m", "rerun_cli", str(recording)], check=False)
    if viewer.returncode != 0:
        raise ViewerError(f"rerun's viewer ended with code {viewer.returncode}.")


def setup_viewer() -> None:
    """Take the browser's viewer out of the installed rerun package; a few seconds, once a version."""
    from fingersplit.recording.three_assets import set_up_three
    from fingersplit.recording.viewer_assets import set_up_viewer

    typer.echo(f"three.js is in {set_up_three()}, rerun's viewer in {set_up_viewer()}.")
