"""Run the benchmarks and write ``report.md`` and ``report.json``."""

import argparse
import json
from pathlib import Path

from rich.progress import track

from benchmarks.objects import benchmark_objects
from benchmarks.parallel_grasps import measure_parallel_grasps, table_parallel_grasps
from benchmarks.planner import measure_object, table_one, table_two
from fingersplit.hands import load_hand


def main() -> None:
    """Measure every object, print the tables and write the report."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("--objects", type=Path, help="folder of meshes [m]; default: see benchmarks/objects.py")
    parser.add_argument("--report", type=Path, default=Path("build/bench"), help="folder for the report")
    parser.add_argument("--repeats", type=int, default=5, help="plans per object; medians are reported")
    arguments = parser.parse_args()
    hand = load_hand("barrett")
    objects = benchmark_objects(arguments.objects)
    rows = [
        measure_object(name, load, hand, arguments.repeats)
        for name, load in track(objects.items(), description="measuring", transient=True)
    ]
    grasp_rows = [
        measure_parallel_grasps(name, load, arguments.repeats)
        for name, load in track(objects.items(), description="parallel grasps", transient=True)
    ]
    report = (
        "# Planner benchmark\n\nOne thread, warm kernels; medians over runs.\n\n"
        f"## Runs (as Table I of Fan2018)\n\n{table_one(rows)}\n\n"
        f"## Time by stage (as Table II of Fan2018)\n\n{table_two(rows)}\n\n"
        f"## Parallel grasps\n\n{table_parallel_grasps(grasp_rows)}\n"
    )
    arguments.report.mkdir(parents=True, exist_ok=True)
    (arguments.report / "report.md").write_text(report)
    (arguments.report / "report.json").write_text(
        json.dumps({"planner": rows, "parallel_grasps": grasp_rows}, indent=2) + "\n"
    )
    print(report)
    print(f"Written to {arguments.report / 'report.md'} and {arguments.report / 'report.json'}")


if __name__ == "__main__":
    main()
