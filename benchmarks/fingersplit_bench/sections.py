"""Every section of the benchmarks, and how they are run."""

from collections.abc import Callable, Iterable
from pkgutil import resolve_name

from fingersplit_bench.suite import Bench, BenchError, Chapter

__all__ = ["SECTIONS", "chosen_sections", "run_sections"]

SECTIONS = {
    "planner": "fingersplit_bench.planner:measure_planner",
    "paper": "fingersplit_bench.paper:measure_paper",
    "ipopt": "fingersplit_bench.ipopt.section:measure_ipopt",
    "intake": "fingersplit_bench.intake:intake_chapter",
    "objects": "fingersplit_bench.objects_report:objects_chapter",
    "parallel_grasps": "fingersplit_bench.parallel_grasps:parallel_grasps_chapter",
    "balls": "fingersplit_bench.balls:balls_chapter",
    "verification": "fingersplit_bench.verification:verification_chapter",
    "holding": "fingersplit_bench.holding:holding_chapter",
    "second_engine": "fingersplit_bench.second_engine.section:second_engine_chapter",
    "scene": "fingersplit_bench.scene:measure_scene",
    "generated_scenes": "fingersplit_bench.generated_scenes:generated_scenes_chapter",
    "dense_grasps": "fingersplit_bench.dense_grasps:dense_grasps_chapter",
    "depth": "fingersplit_bench.depth:depth_chapter",
    "hands": "fingersplit_bench.hands:hands_chapter",
    "recordings": "fingersplit_bench.recordings:recordings_chapter",
}
"""Name of each section and its function from ``Bench`` to ``Chapter``, in the order of the report."""


def chosen_sections(only: Iterable[str]) -> list[str]:
    """The sections of that name in the order of the report; all of them without a name.

    Raises:
        BenchError: There is no section of that name.
    """
    wanted = list(only) or list(SECTIONS)
    for name in wanted:
        if name not in SECTIONS:
            raise BenchError(f"Unknown section {name!r}; known sections: {', '.join(SECTIONS)}.")
    return [name for name in SECTIONS if name in wanted]


def run_sections(bench: Bench, names: Iterable[str], *, required: bool) -> tuple[dict[str, Chapter], dict[str, str]]:
    """Run sections and return their chapters, and why others are left out.

    Args:
        bench: What they measure with.
        names: Names of sections.
        required: Whether a section whose packages are not installed is an error; else it is left out.

    Raises:
        BenchError: A required section lacks a package.
    """
    measures: dict[str, Callable[[Bench], Chapter]] = {}
    left_out: dict[str, str] = {}
    for name in names:  # all of them before the first one takes its minutes
        try:
            measures[name] = resolve_name(SECTIONS[name])
        except ModuleNotFoundError as error:
            why = f"It needs {error.name}, which is not installed; benchmarks/README.md says how."
            if required:
                raise BenchError(f"Section {name!r} cannot run. {why}") from error
            left_out[name] = why
    return {name: measure(bench) for name, measure in measures.items()}, left_out
