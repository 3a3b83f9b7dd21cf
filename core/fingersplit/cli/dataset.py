"""The command ``fingersplit dataset``: many grasps of many objects, in shards."""

from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import entry_points
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console

from fingersplit.cli.values import named_values
from fingersplit.errors import DatasetError

if TYPE_CHECKING:
    from fingersplit.dataset.planners import Planner
    from fingersplit.dataset.request import DatasetRequest
    from fingersplit.dataset.running import DatasetProgress

__all__ = ["dataset"]

INCOMPLETE = 1
"""Exit code where objects have too few grasps."""
TABLE = "table"


def dataset(
    objects: Annotated[
        list[Path], typer.Argument(help="Meshes, point clouds, or folders of them.", metavar="OBJECTS...")
    ],
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder of the data set; one that was begun goes on.")],
    hand: Annotated[
        str, typer.Option(help="Hand to plan for: a name of `fingersplit hands`, a folder or a zip.")
    ] = "barrett",
    per_object: Annotated[int, typer.Option(help="Grasps wanted of each object.", min=1)] = 100,
    verified: Annotated[
        bool, typer.Option("--verified", help="Count only grasps that held in simulation; others are kept as failures.")
    ] = False,
    scene: Annotated[
        str | None, typer.Option(help="`table`, or a JSON file as for `fingersplit plan`, of primitives and points.")
    ] = None,
    approach: Annotated[
        list[str] | None, typer.Option(help="Direction of travel with an angle, such as down:35; repeatable.")
    ] = None,
    starts: Annotated[int, typer.Option(help="Starts of one round.", min=1, max=4096)] = 64,
    max_rounds: Annotated[int, typer.Option(help="Rounds after which an object is given up.", min=1)] = 50,
    seed: Annotated[int, typer.Option(help="Seed of the first round; later ones count up.", min=0)] = 0,
    unit: Annotated[str, typer.Option(help="Unit of the files: m, mm, cm or in.")] = "m",
    scale: Annotated[float, typer.Option(help="Multiplies the files' numbers, beside the unit.")] = 1.0,
    density: Annotated[float | None, typer.Option(help="Density of the objects [kg/m^3].")] = None,
    mass: Annotated[float | None, typer.Option(help="Mass of each object [kg], instead of a density.")] = None,
    friction: Annotated[float | None, typer.Option(help="Coulomb friction between objects and pads.")] = None,
    fairing: Annotated[float, typer.Option(help="Smooth noisy meshes: wavelength attenuated by half [m].")] = 0.0,
    protocol: Annotated[str, typer.Option(help="What verified grasps must survive.")] = "lift",
    controller: Annotated[str, typer.Option(help="virtual_frame, or position_servo.")] = "virtual_frame",
    simulated_friction: Annotated[
        float | None, typer.Option(help="Friction in the simulation; default: the planned one.", min=0)
    ] = None,
    source: Annotated[str, typer.Option(help="Where parallel grasps come from.")] = "antipodal",
    setting: Annotated[list[str] | None, typer.Option(help="Planner setting as NAME=VALUE; repeatable.")] = None,
    split: Annotated[
        tuple[float, float, float], typer.Option(help="Shares of train, validation and test, by object.")
    ] = (0.8, 0.1, 0.1),
    licence: Annotated[str, typer.Option(help="Licence of the data set, such as CC-BY-4.0.")] = "unspecified",
    retry_failed: Annotated[bool, typer.Option("--retry-failed", help="Try objects again that failed before.")] = False,
    workers: Annotated[
        int | None, typer.Option(help="Processes; default: one a core. With a server: jobs at a time, 16.", min=1)
    ] = None,
    server: Annotated[
        str | None, typer.Option(help="Plan with this service's workers instead of here.", envvar="FINGERSPLIT_SERVER")
    ] = None,
    api_key: Annotated[str | None, typer.Option(help="Key of the service.", envvar="FINGERSPLIT_API_KEY")] = None,
) -> None:
    """Plan many grasps of many objects into a folder of HDF5 shards.

    The same command goes on where it was stopped or killed; nothing is lost or planned twice. Shards can be read while
    more are written, `summary.html` shows the whole, and `fingersplit export FOLDER --format ...` converts it.
    """
    from fingersplit.dataset.request import DatasetRequest, find_objects
    from fingersplit.dataset.running import make_dataset
    from fingersplit.dataset.summary import write_summary

    request = DatasetRequest(
        hand=hand,
        per_object=per_object,
        verified=verified,
        starts=starts,
        max_rounds=max_rounds,
        seed=seed,
        unit=unit,
        scale=scale,
        density=density,
        mass=mass,
        friction=friction,
        fairing=fairing,
        protocol=protocol,
        controller=controller,
        simulated_friction=simulated_friction,
        source=source,
        planner=named_values(setting),
        constraints=_constraints(scene, approach or []),
        split=split,
        licence=licence,
    )
    _check(request)
    items, files, remarks = find_objects(objects, split)
    planner = _planner(server, api_key, workers, len(items))
    console = Console(stderr=True)
    for remark in remarks:
        console.print(remark, highlight=False, markup=False)
    with _shown(console) as show:
        last = make_dataset(output, request, items, files, planner, retry_failed=retry_failed, progress=show)
    page = write_summary(output)
    typer.echo(f"{last.message}\nWrote {output} and {page}.")
    if last.failed:
        raise typer.Exit(INCOMPLETE)


def _constraints(scene: str | None, approach: list[str]) -> dict[str, Any]:
    """What differs from no constraints, as plain JSON data."""
    from fingersplit.cli.scenes import read_constraints
    from fingersplit.scene import Constraints

    table, file = scene == TABLE, None if scene in (None, TABLE) else Path(str(scene))
    if file is not None and not file.is_file():
        raise DatasetError(f"--scene is {scene!r}: neither `{TABLE}` nor a file.")
    asked = read_constraints(file, table, approach)
    named = [obstacle.object_id for obstacle in asked.scene.obstacles if obstacle.object_id is not None]
    if named:
        raise DatasetError(f"A data set's scene takes primitives and points; obstacle {named[0]!r} is a file.")
    document, usual = asked.to_document(), Constraints().to_document()
    return {name: value for name, value in document.items() if value != usual[name]}


def _check(request: "DatasetRequest") -> None:
    """Refuse what no object can be planned with, before anything is begun."""
    from fingersplit.contacts.friction import planned_friction
    from fingersplit.hands.hand import load_hand
    from fingersplit.objects.options import ObjectOptions
    from fingersplit.objects.source import ObjectSource
    from fingersplit.parallel_grasps.sources import load_source
    from fingersplit.splitting.settings import PlannerSettings
    from fingersplit.verification.controllers import load_controller
    from fingersplit.verification.protocols import load_protocol

    load_hand(request.hand)
    ObjectSource(request.unit, request.scale, None)
    ObjectOptions(request.density, request.mass, request.friction, request.fairing)
    planned_friction(request.friction)
    PlannerSettings.from_document(request.planner)
    load_source(request.source)
    load_protocol(request.protocol)
    load_controller(request.controller)


def _planner(server: str | None, api_key: str | None, workers: int | None, objects: int) -> "Planner":
    """Processes of this machine, or the service that is named."""
    from fingersplit.dataset.planners import LocalPlanner, ServicePlanner, cores

    if server is None:
        return LocalPlanner(min(workers or cores(), objects))
    doors = entry_points(group="fingersplit.services")
    if not doors:
        raise DatasetError("--server needs the client: pip install fingersplit-client.")
    return ServicePlanner(next(iter(doors)).load()(server, api_key), min(workers or 16, objects))


@contextmanager
def _shown(console: Console) -> "Iterator[Any]":
    """A callback that shows progress: a bar on a terminal, now and then a line elsewhere."""
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    if not console.is_terminal:
        yield _Lines(console)
        return
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task("beginning", total=None)

        def show(now: "DatasetProgress") -> None:
            rate = f"{now.grasps / max(now.seconds, 1e-9):.1f} grasps/s, {now.held / max(now.seconds, 1e-9):.1f} held/s"
            text = f"{now.selected} of {now.wanted}, {now.done} of {now.objects} objects, {rate}"
            bar.update(task, description=text, completed=now.selected, total=now.wanted)

        yield show


class _Lines:
    """A line for every tenth of the data set but the last, for logs."""

    def __init__(self, console: Console) -> None:
        self._console, self._shown = console, 0

    def __call__(self, now: "DatasetProgress") -> None:
        tenth = 10 * now.selected // max(now.wanted, 1)
        if self._shown != tenth < 10:
            self._shown = tenth
            self._console.print(now.message, highlight=False, markup=False, soft_wrap=True)
