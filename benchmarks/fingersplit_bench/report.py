"""The report: figures first, then every section, and what the JSON beside it holds."""

from collections.abc import Mapping
from typing import Any

from fingersplit_bench.suite import Chapter, Figure, table

__all__ = ["FIGURES", "to_document", "to_markdown"]

FIGURES = {
    "us_per_iteration": "<= 8 us",
    "paper_run_ms": "<= 1 ms",
    "default_run_ms": "<= 0.3 ms",
    "starts_per_second": ">= 2,000, on two threads >= 1.8 times",
    "feasible_per_second": ">= 1,000 (mean)",
    "best_of_64_ms": "<= 60 ms",
    "dense_ratio": "<= 1.3",
    "first_plan_s": "<= 3 s",
    "ipopt_ratio": "reported",
    "holding_rate": ">= 15 of 16",
    "lift_ms": "<= 13 ms",
    "verdict_changes": "<= 1 % of 480, of which a third fail",
    "held_per_second": ">= 60",
    "p_hold_auc": ">= 0.90, estimated >= 0.80",
    "p_hold_calibration": "<= 0.04, estimated <= 0.05",
    "noisy_top1": ">= 0.94, on each axis >= 0.80; estimated >= 0.88 and 0.70",
    "cheap_tier_ms": "<= 15 ms",
    "simulated_tier_ms": "<= 4 ms",
    "engine_agreement": ">= 92 % of 200, half of them spoilt",
    "recording_ms": "<= 40 ms and 1.5 MB",
    "convex_pieces_s": "<= 3 s",
}
"""The keys of the headline figures and what each is meant to reach, on one thread of a 2-core machine."""


def to_document(
    machine: dict[str, Any], run: dict[str, Any], chapters: Mapping[str, Chapter], left_out: Mapping[str, str]
) -> dict[str, Any]:
    """The JSON file: ``machine``, ``run``, ``figures`` by key, ``sections`` with their data, and what is left out."""
    figures = _figures(chapters)
    return {
        "machine": machine,
        "run": run,
        "figures": {key: figures[key].to_document() for key in FIGURES if key in figures},
        "sections": {name: chapter.data for name, chapter in chapters.items()},
        "left_out": dict(left_out),
    }


def to_markdown(
    machine: dict[str, Any], run: dict[str, Any], chapters: Mapping[str, Chapter], left_out: Mapping[str, str]
) -> str:
    """The report as Markdown."""
    parts = ["# Fingersplit benchmarks", _machine_text(machine, run), "## Figures", _figure_table(_figures(chapters))]
    parts += [f"Left out: `{name}`. {why}" for name, why in left_out.items()]
    for name, chapter in chapters.items():
        parts += [f"## {chapter.title} (`{name}`)", chapter.text]
    return "\n\n".join([*parts, "## The JSON file", _JSON_TEXT]) + "\n"


_JSON_TEXT = (
    "The same numbers for programs. `figures` holds the keys of the first table; each has `value`, `unit`, "
    "`center` (`value` is the median or the mean), `low` and `high` (quartiles), `runs` (how many measurements), "
    "`meaning`, and `beside`, the numbers that belong to "
    "it, by name. `sections` holds what stands behind each section's tables, `machine` and `run` what it was measured "
    "on and with, `left_out` the sections that could not run and why."
)


def _figures(chapters: Mapping[str, Chapter]) -> dict[str, Figure]:
    return {key: figure for chapter in chapters.values() for key, figure in chapter.figures.items()}


def _machine_text(machine: dict[str, Any], run: dict[str, Any]) -> str:
    versions = ", ".join(f"{name} {version}" for name, version in machine["versions"].items() if version)
    return (
        f"{machine['cpu']}; {machine['cores']} cores, load {machine['load_average']} when the run began; "
        f"{machine['system']}; Python {machine['python']}; {versions}.\n\n"
        f"{run['objects']} objects, {run['starts']} starts a plan, {run['repeats']} repeats; warm kernels, one thread "
        f"where nothing else is said, wall times. The process had {run['cpu_share']:.0%} of a core; what is well "
        "below one went to others, and the times are longer by as much."
    )


def _figure_table(figures: Mapping[str, Figure]) -> str:
    rows = []
    for key, target in FIGURES.items():
        if key in figures:
            figure = figures[key]
            beside = "; ".join(f"{name.replace('_', ' ')} {_number(number)}" for name, number in figure.beside.items())
            rows.append(
                [
                    f"`{key}`",
                    f"**{_number(figure.value)}** {'' if figure.unit == '1' else figure.unit}".rstrip(),
                    figure.center,
                    f"{_number(figure.low)} to {_number(figure.high)} ({figure.runs})",
                    target,
                    f"{figure.meaning} {beside and beside[0].upper() + beside[1:] + '.'}".rstrip(),
                ]
            )
        else:
            rows.append([f"`{key}`", "not measured", "", "", target, ""])
    return table(["figure", "value", "", "quartiles (of)", "target", "what it is"], rows, left=6)


def _number(value: float) -> str:
    """Three significant digits, thousands separated."""
    return f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.3g}"
