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

from fingersplit.cli.hand import app as hand_app
from fingersplit.cli.record import record, review, setup_viewer
from fingersplit.cli.verify import named_values, verify_stored
from fingersplit.errors import ExchangeError, FingersplitError

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
    file: Annotated[
        Path,
        typer.Argument(
            help="Mesh (STL, OBJ, PLY, OFF, GLB) or point cloud (PLY, PCD, NPZ).", exists=True, dir_okay=False
        ),
    ],
    hand: Annotated[
        str, typer.Option(help="Hand to plan for: a name of `fingersplit hands`, a folder or a zip.")
    ] = "barrett",
    starts: Annotated[int, typer.Option(help="Most runs of the finger splitting.", min=1)] = 64,
    seed: Annotated[int, typer.Option(help="Seed of every random choice.", min=0)] = 0,
    unit: Annotated[str, typer.Option(help="Unit of the file: m, mm, cm or in.")] = "m",
    scale: Annotated[float, typer.Option(help="Multiplies the file's numbers, beside the unit.")] = 1.0,
    density: Annotated[float | None, typer.Option(help="Density of the object [kg/m^3].")] = None,
    mass: Annotated[float | None, typer.Option(help="Mass of the object [kg], instead of a density.")] = None,
    friction: Annotated[float | None, typer.Option(help="Coulomb friction between the object and the pads.")] = None,
    fairing: Annotated[float, typer.Option(help="Smooth a noisy mesh: wavelength attenuated by half [m].")] = 0.0,
    viewpoint: Annotated[
        tuple[float, float, float] | None,
        typer.Option(help="Where the camera stood that saw the point cloud, in the file's frame and unit."),
    ] = None,
    top_k: Annotated[int, typer.Option(help="Most grasps to return.", min=1)] = 10,
    parallel_grasps: Annotated[
        Path | None,
        typer.Option(
            help="Start from the parallel grasps of this file instead: our JSON, Dex-Net, ACRONYM, GraspGen, "
            "Isaac grasp or graspnetAPI.",
            exists=True,
            dir_okay=False,
        ),
    ] = None,
    grasp_format: Annotated[
        str | None, typer.Option("--format", help="Format of that file; by its content when left out.")
    ] = None,
    source: Annotated[
        str, typer.Option(help="Where parallel grasps are found: antipodal, surface_fitting or both.")
    ] = "antipodal",
    setting: Annotated[
        list[str] | None, typer.Option(help="Planner setting as NAME=VALUE, such as pad_angle_limit=0.5; repeatable.")
    ] = None,
    json_file: Annotated[
        Path | None, typer.Option("--json", help="Write the result document here; - for standard output.")
    ] = None,
    picture: Annotated[Path | None, typer.Option(help="Write a PNG of the best grasp here.")] = None,
    recording: Annotated[
        Path | None, typer.Option(help="Record how the best grasp came about here, .rrd; see `fingersplit review`.")
    ] = None,
    verified: Annotated[int, typer.Option(help="Verify ranked grasps in MuJoCo until so many hold.", min=0)] = 0,
    protocol: Annotated[
        str, typer.Option(help="What is done with the held object; see `fingersplit verify`.")
    ] = "lift",
    simulated_friction: Annotated[
        float | None,
        typer.Option(help="Friction while verifying; default: the planned one, which the grip always believes.", min=0),
    ] = None,
    initial: Annotated[bool, typer.Option(help="Verify the initial parallel grasps, too.")] = False,
) -> None:
    """Plan grasps for a mesh or a point cloud and print them, best first."""
    from fingersplit.contacts.friction import without_friction
    from fingersplit.formats.importing import import_parallel_grasps
    from fingersplit.hands.hand import load_hand
    from fingersplit.objects.convex_pieces import decompose
    from fingersplit.objects.loading import load_object
    from fingersplit.objects.options import ObjectOptions
    from fingersplit.planning.planning import plan as plan_grasps
    from fingersplit.planning.proving import prove
    from fingersplit.splitting.settings import PlannerSettings

    options = ObjectOptions(density=density, mass=mass, friction=friction, fairing=fairing)
    named, requested_friction = without_friction(named_values(setting or []))
    settings = PlannerSettings.from_document(named)
    planned_hand = load_hand(hand)
    with _progress() as report:
        report("preparing the object", 0.0)
        model = load_object(file, unit=unit, scale=scale, viewpoint=viewpoint, options=options)
        imported = None
        if parallel_grasps is not None:
            imported = import_parallel_grasps(parallel_grasps, model, grasp_format)
        result = plan_grasps(
            model,
            planned_hand,
            None if imported is None else imported.grasps,
            source=source,
            starts=starts,
            seed=seed,
            top_k=top_k,
            settings=settings,
            friction=requested_friction,
            progress=report,
        )
        if verified:
            report("convex pieces", 0.0)
            pieces = decompose(model.mesh)
            report("verifying", 0.0)
            result = prove(
                result,
                pieces,
                verified=verified,
                protocol=protocol,
                friction=simulated_friction,
                threads=2,
                initial=initial,
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
    console = Console(stderr=to_stdout)
    if imported is not None:
        console.print(imported.message, highlight=False)
    for remark in () if model.report is None else model.report.remarks:
        console.print(f"{file.name}: {remark}", highlight=False, markup=False)
    console.print(_table(document))
    if not result.feasible:
        raise typer.Exit(1)


@app.command()
def export(
    result: Annotated[Path, typer.Argument(help="Result document, as `plan --json` writes it.", exists=True)],
    output: Annotated[Path, typer.Option("--output", "-o", help="File to write.", dir_okay=False)],
    export_format: Annotated[
        str,
        typer.Option(
            "--format",
            help="isaac_grasp, moveit, moveit_yaml, dexgraspbench, multi_gripper_grasp or dexgraspnet.",
        ),
    ],
    rank: Annotated[int | None, typer.Option(help="Only the grasp of this rank; else all feasible ones.")] = None,
) -> None:
    """Write the feasible grasps of a result in the format of another tool."""
    from fingersplit.formats import export as export_grasps

    try:
        document = json.loads(result.read_bytes())
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise ExchangeError(f"{result} is not JSON: {error}.") from error
    output.write_bytes(export_grasps(document, export_format, rank=rank))


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
    from fingersplit.cli.warming import compile_kernels
    from fingersplit.hands.hand import available_hands, load_hand

    for name in available_hands():
        with Console(stderr=True).status(f"compiling the kernels for {name} (about a minute with an empty cache)"):
            compile_kernels(load_hand(name))


app.add_typer(hand_app, name="hand")
app.command("verify")(verify_stored)
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
    from fingersplit.cli.warming import kernels_are_compiled

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
    from fingersplit.recording.traces_file import save_traces

    with TemporaryDirectory() as folder:
        traces = Path(folder) / "traces.npz"
        save_traces(result, json.dumps(result.to_document()), traces)
        draw_stored(traces, result.model.mesh, 1, picture)


def _record(result: Any, recording: Path) -> None:
    from fingersplit.recording.run_recording import record_run

    record_run(recording, result.model, result.hand, result.grasps[0], friction=result.friction)


def _table(document: dict[str, Any]) -> Table:
    table = Table(
        title=f"{document['object']['name']}, {document['hand']}",
        caption=_caption(document["summary"]),
        box=box.SIMPLE_HEAD,
        collapse_padding=True,
        pad_edge=False,
    )
    for heading in ("rank", "feasible", "spare N", "held", "Ferrari-Canny", "pad rad", "ended"):
        table.add_column(heading, justify="left" if heading == "ended" else "right", no_wrap=True)
    for grasp in document["grasps"]:
        metrics, verification = grasp["metrics"], grasp["verification"]
        margin = metrics["holding_margin"]
        table.add_row(
            str(grasp["rank"]),
            "yes" if grasp["feasible"] else "no",
            "none" if margin is None else f"{margin:.2f}",
            "" if verification is None else "yes" if verification["passed"] else "no",
            f"{metrics['ferrari_canny']:.3f}",
            f"{max(contact['pad_angle'] for contact in grasp['contacts']):.2f}",
            grasp["termination"].replace("_", " "),
        )
    return table


def _caption(summary: dict[str, Any]) -> str:
    proof = summary["verification"]
    return summary["message"] if proof is None else f"{summary['message']} {proof['message']}"
