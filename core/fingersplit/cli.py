"""The ``fingersplit`` program; other distributions add commands through the entry point ``fingersplit.commands``."""

import json
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import entry_points
from pathlib import Path
from typing import Annotated, Any

import typer
from rich import box
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from fingersplit.errors import FingersplitError, ParallelGraspError
from fingersplit.recording.commands import record, review, setup_viewer

__all__ = ["main"]

BAD_INPUT = 2
"""Exit code for input that cannot be used; 1 means that no feasible grasp was found."""


app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    help="Grasp planning for multi-fingered hands by finger splitting.",
)


@app.command()
def plan(
    mesh: Annotated[Path, typer.Argument(help="Mesh file: STL, OBJ, PLY, OFF or GLB.", exists=True, dir_okay=False)],
    hand: Annotated[str, typer.Option(help="Hand to plan for; see `fingersplit hands`.")] = "barrett",
    starts: Annotated[int, typer.Option(help="Most runs of the finger splitting.", min=1)] = 64,
    seed: Annotated[int, typer.Option(help="Seed of every random choice.", min=0)] = 0,
    unit: Annotated[str, typer.Option(help="Unit of the mesh: m, mm, cm or in.")] = "m",
    top_k: Annotated[int, typer.Option(help="Most grasps to return.", min=1)] = 10,
    parallel_grasps: Annotated[
        Path | None,
        typer.Option(
            help='JSON list of {"contacts": [[x,y,z],[x,y,z]], "approach": [x,y,z]}, object frame [m].',
            exists=True,
            dir_okay=False,
        ),
    ] = None,
    setting: Annotated[
        list[str] | None, typer.Option(help="Planner setting as NAME=VALUE, such as friction=0.4; repeatable.")
    ] = None,
    json_file: Annotated[
        Path | None, typer.Option("--json", help="Write the result document here; - for standard output.")
    ] = None,
    picture: Annotated[Path | None, typer.Option(help="Write a PNG of the best grasp here.")] = None,
    recording: Annotated[
        Path | None, typer.Option(help="Record how the best grasp came about here, .rrd; see `fingersplit review`.")
    ] = None,
) -> None:
    """Plan grasps for a mesh and print them, best first."""
    from fingersplit.hands.hand import load_hand
    from fingersplit.objects.intake import load_mesh
    from fingersplit.objects.model import prepare_object
    from fingersplit.parallel_grasps.parallel_grasp import ParallelGrasp
    from fingersplit.planning import plan as plan_grasps
    from fingersplit.splitting.settings import PlannerSettings

    settings = PlannerSettings.from_pairs(setting or [])
    grasps = None
    if parallel_grasps is not None:
        grasps = [ParallelGrasp.from_document(document) for document in _json_list(parallel_grasps)]
    planned_hand = load_hand(hand)
    checked, _ = load_mesh(mesh, unit)
    with _progress() as report:
        report("preparing the object", 0.0)
        model = prepare_object(checked, mesh.stem)
        result = plan_grasps(
            model, planned_hand, grasps, starts=starts, seed=seed, top_k=top_k, settings=settings, progress=report
        )
        document = result.to_document()
        if picture is not None:
            report("drawing", 0.0)
            _draw(result, picture)
        if recording is not None and result.grasps:
            report("recording", 0.0)
            _record(result, recording)
    to_stdout = json_file is not None and str(json_file) == "-"
    if to_stdout:
        typer.echo(json.dumps(document, indent=2))
    elif json_file is not None:
        json_file.write_text(json.dumps(document, indent=2) + "\n")
    Console(stderr=to_stdout).print(_table(document))
    if not result.feasible:
        raise typer.Exit(1)


@app.command()
def hands() -> None:
    """List the hands that can be planned for."""
    from fingersplit.hands.hand import available_hands, load_hand

    for name in available_hands():
        hand = load_hand(name)
        typer.echo(f"{name}: {hand.title}; {len(hand.fingers)} fingers, {len(hand.joint_names)} joints")


@app.command()
def warm() -> None:
    """Compile the planner's kernels for every hand, so that the first plan does not wait for it."""
    from fingersplit.hands.hand import available_hands, load_hand
    from fingersplit.warming import compile_kernels

    for name in available_hands():
        with Console(stderr=True).status(f"compiling the kernels for {name} (about a minute with an empty cache)"):
            compile_kernels(load_hand(name))


app.command()(record)
app.command()(review)
app.command()(setup_viewer)


def main() -> None:
    """Run the program; bad input ends with one sentence on standard error and exit code 2."""
    for entry in entry_points(group="fingersplit.commands"):
        command = entry.load()
        if isinstance(command, typer.Typer):
            app.add_typer(command, name=entry.name)
        else:
            app.command(entry.name)(command)
    try:
        app()
    except FingersplitError as error:
        typer.echo(f"Error: {error}", err=True)
        sys.exit(BAD_INPUT)


@contextmanager
def _progress() -> Iterator[Any]:
    """A callback ``(stage, share)`` behind a progress bar on a terminal; silent in a pipe."""
    from fingersplit.warming import kernels_are_compiled

    console = Console(stderr=True)
    if console.is_terminal and not kernels_are_compiled():
        console.print("Compiling the planner's kernels first (about a minute, once).")
    columns = (TextColumn("{task.description:>22}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("", total=1.0)
        yield lambda stage, share: bar.update(task, description=stage.replace("_", " "), completed=share)


def _draw(result: Any, picture: Path) -> None:
    """Picture of the best grasp, through the same file that the service keeps."""
    from tempfile import TemporaryDirectory

    from fingersplit.recording.stored import draw_stored

    with TemporaryDirectory() as folder:
        traces = Path(folder) / "traces.npz"
        result.save_traces(traces)
        draw_stored(traces, result.model.mesh, 1, picture)


def _record(result: Any, recording: Path) -> None:
    from fingersplit.recording.run_recording import record_run

    record_run(recording, result.model, result.hand, result.grasps[0])


def _table(document: dict[str, Any]) -> Table:
    table = Table(
        title=f"{document['object']['name']}, {document['hand']}",
        caption=document["summary"]["message"],
        box=box.SIMPLE_HEAD,
        collapse_padding=True,
        pad_edge=False,
    )
    for heading in ("rank", "feasible", "Ferrari-Canny", "Q", "pad rad", "CPO/PPO", "ended"):
        table.add_column(heading, justify="left" if heading == "ended" else "right", no_wrap=True)
    for grasp in document["grasps"]:
        metrics, iterations = grasp["metrics"], grasp["iterations"]
        table.add_row(
            str(grasp["rank"]),
            "yes" if grasp["feasible"] else "no",
            f"{metrics['ferrari_canny']:.3f}",
            f"{metrics['quality']:.5f}",
            f"{max(contact['pad_angle'] for contact in grasp['contacts']):.2f}",
            f"{iterations['cpo']}/{iterations['ppo']}",
            grasp["termination"].replace("_", " "),
        )
    return table


def _json_list(path: Path) -> list[dict[str, Any]]:
    try:
        documents = json.loads(path.read_text())
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise ParallelGraspError(f"{path} is not JSON: {error}.") from error
    if not isinstance(documents, list) or not all(isinstance(document, dict) for document in documents):
        raise ParallelGraspError(f"{path} must hold a list of parallel grasps.")
    return documents
