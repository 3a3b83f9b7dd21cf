"""Subcommands about recordings: make one from a stored result, look at one, set up the viewer of the web pages."""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from fingersplit.cli.verify import named_values
from fingersplit.errors import ViewerError

__all__ = ["record", "review", "setup_viewer"]


def record(
    result: Annotated[Path, typer.Argument(help="Result document, JSON.", exists=True, dir_okay=False)],
    mesh: Annotated[Path, typer.Option("--object", help="The object's mesh file.", exists=True, dir_okay=False)],
    unit: Annotated[str, typer.Option(help="Unit of the mesh: m, mm, cm or in.")] = "m",
    rank: Annotated[int, typer.Option(help="Rank of the grasp to record.", min=1)] = 1,
    setting: Annotated[
        list[str] | None, typer.Option(help="Planner setting it was planned with, as NAME=VALUE; repeatable.")
    ] = None,
    output: Annotated[
        Path | None, typer.Option(help="Recording to write.", show_default="RESULT with the suffix .rrd")
    ] = None,
) -> None:
    """Record a stored grasp: its run is repeated, which must give the same grasp, and so is its verification."""
    from fingersplit.contacts.friction import planned_friction, without_friction
    from fingersplit.hands.hand import load_hand
    from fingersplit.objects.convex_pieces import decompose
    from fingersplit.objects.loading import load_object
    from fingersplit.recording.recorded_run import RecordedRun
    from fingersplit.recording.replay import read_result, replay
    from fingersplit.recording.run_recording import write_recording
    from fingersplit.splitting.settings import PlannerSettings
    from fingersplit.verification import verify

    document = read_result(result)
    named, requested = without_friction(named_values(setting or []))
    settings = PlannerSettings.from_document(named)
    friction = planned_friction(requested, document.get("friction"))
    hand = load_hand(document["hand"])
    model = load_object(mesh, unit=unit, name=document["object"]["name"])
    grasp = replay(document, rank, model, hand, settings, friction)
    stored = document["grasps"][rank - 1]
    if stored["verification"] is not None:
        pieces, protocol = decompose(model.mesh), stored["verification"]["protocol"]
        simulated = stored["verification"]["settings"]["friction"]
        grasps = [grasp.run.final] + ([grasp.run.initial] if stored["initial"]["verification"] is not None else [])
        reports = [
            verify(one, hand, model, pieces, protocol, friction=simulated, planned_friction=friction) for one in grasps
        ]
        grasp = replace(grasp, verification=reports[0], initial_verification=reports[1] if reports[1:] else None)
    run = RecordedRun.from_planned(grasp, hand)
    path = output or result.with_suffix(".rrd")
    write_recording(path, model, hand, run, friction)
    typer.echo(f"{path}: {len(run.trace)} states, {path.stat().st_size / 1e6:.1f} MB")


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
    from fingersplit.recording.viewer_assets import set_up_viewer

    typer.echo(f"The viewer is in {set_up_viewer()}.")
