"""The subcommand `fingersplit bench`."""

import json
import os
from pathlib import Path
from time import perf_counter, process_time
from typing import Annotated

import typer
from rich.console import Console

__all__ = ["bench"]

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""Linear algebra libraries read these when they are loaded."""


def bench(
    objects_folder: Annotated[
        Path | None,
        typer.Argument(
            help="Folder of meshes in metres; else FINGERSPLIT_OBJECTS, ../shared/objects, or objects of our own.",
            exists=True,
            file_okay=False,
        ),
    ] = None,
    json_file: Annotated[Path | None, typer.Option("--json", help="Write the figures here too.")] = None,
    only: Annotated[
        list[str] | None, typer.Option(help="Section to run, such as planner, paper or ipopt; repeatable.")
    ] = None,
    report: Annotated[Path, typer.Option(help="Folder for report.md, report.json and pictures.")] = Path("build/bench"),
    repeats: Annotated[int, typer.Option(help="How often each measurement is taken.", min=1)] = 5,
    starts: Annotated[int, typer.Option(help="Starts of an ordinary plan.", min=1)] = 64,
    refit: Annotated[
        bool, typer.Option("--refit", help="Section holding: write the coefficients of p_hold anew, into the package.")
    ] = False,
) -> None:
    """Measure speed and quality of the planner and write a report."""
    os.environ.update(ONE_THREAD)
    # Imported here, because every `fingersplit` command loads this module.
    from fingersplit.hands.hand import load_hand
    from fingersplit_bench.machine import describe_machine
    from fingersplit_bench.objects import benchmark_objects, corpus_folder
    from fingersplit_bench.report import to_document, to_markdown
    from fingersplit_bench.sections import chosen_sections, run_sections
    from fingersplit_bench.suite import Bench

    names = chosen_sections(only or [])
    # Files that are tried one by one may all be clouds, or broken.
    objects = {} if names == ["intake"] else benchmark_objects(objects_folder)
    machine = describe_machine()
    run: dict[str, float] = {"objects": len(objects), "starts": starts, "repeats": repeats}
    report.mkdir(parents=True, exist_ok=True)
    began, used = perf_counter(), process_time()
    with Console(stderr=True).status("starting") as status:
        suite = Bench(
            objects,
            load_hand("barrett"),
            report,
            repeats,
            starts,
            note=status.update,
            corpus=corpus_folder(objects_folder),
            refit=refit,
        )
        chapters, left_out = run_sections(suite, names, required=only is not None)
    run["cpu_share"] = round((process_time() - used) / (perf_counter() - began), 2)
    document = json.dumps(to_document(machine, run, chapters, left_out), indent=2) + "\n"
    text = to_markdown(machine, run, chapters, left_out)
    (report / "report.md").write_text(text)
    for path in {report / "report.json", *([json_file] if json_file else [])}:
        path.write_text(document)
    typer.echo(text)
    typer.echo(f"Written to {report / 'report.md'} and {report / 'report.json'}.")
