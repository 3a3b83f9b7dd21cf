"""The words of a recording: what happened when, and how it ended."""

from typing import Any

import rerun as rr

from fingersplit.recording import colors
from fingersplit.recording.lift_rows import Lift
from fingersplit.recording.planning_rows import phases_of
from fingersplit.recording.recorded_run import RecordedRun
from fingersplit.splitting.trace import QUALITY

__all__ = ["log_story"]

_PHASES = {
    "map": "parallel grasp, mapped",
    "cpo": "CPO: contacts move",
    "ppo": "PPO: palm moves",
    "settle": "settling on the surface",
}


def log_story(stream: rr.RecordingStream, title: str, run: RecordedRun, lift: Lift | None) -> None:
    """Write phases, log and summary of a run."""
    lifted = [] if lift is None else list(dict.fromkeys(lift.phases))
    names = [*_PHASES, *lifted]
    palette = [*colors.PHASES.values(), *(colors.FINGERS[i % len(colors.FINGERS)] for i in range(len(lifted)))]
    configuration = rr.StateConfiguration(
        values=names, labels=[_PHASES.get(n, n) for n in names], colors=[colors.rgba(color) for color in palette]
    )
    stream.log("phase", configuration, static=True)
    stream.log("summary", rr.TextDocument(_summary(title, run), media_type="text/markdown"), static=True)
    states, lines = _planning_lines(run)
    if lift is not None:
        starts = [row for row, name in enumerate(lift.phases) if row == 0 or name != lift.phases[row - 1]]
        states += [(len(run.trace) + row, lift.phases[row]) for row in starts]
        lines += [(len(run.trace) + row, "INFO", f"{lift.times[row]:.2f} s: {lift.phases[row]}") for row in starts]
    lines += _verdicts(len(run.trace) - 1 + (0 if lift is None else len(lift.times)), run)
    changes = rr.StateChange.columns(state=[name for _, name in states])
    stream.send_columns("phase", [rr.TimeColumn("step", sequence=[step for step, _ in states])], changes)
    texts = rr.TextLog.columns(text=[text for _, _, text in lines], level=[level for _, level, _ in lines])
    stream.send_columns("log", [rr.TimeColumn("step", sequence=[step for step, _, _ in lines])], texts)


def _planning_lines(run: RecordedRun) -> tuple[list[tuple[int, str]], list[tuple[int, str, str]]]:
    """First row and name of every phase; row, level and text of what is said about the planning."""
    quality = run.trace.scores[:, QUALITY]
    states, lines = [], list[tuple[int, str, str]]()
    for name, first, end in phases_of(run.trace):
        states.append((first, name))
        if name == "map":
            lines.append((first, "INFO", f"Mapped start, Q = {quality[first]:.5f}"))
        else:
            risen = f"Q {quality[first - 1]:.5f} to {quality[end - 1]:.5f}"
            lines.append((first, "INFO", f"{_PHASES[name]}: {end - first} steps, {risen}"))
    last = len(run.trace) - 1
    ended = run.document["termination"].replace("_", " ")
    level = "INFO" if run.document["feasible"] else "WARN"
    lines.append((last, level, f"Ended: {ended}. {run.document['advice']}"))
    lines += [(last, "WARN", violation) for violation in run.document["violations"]]
    return states, lines


def _verdicts(step: int, run: RecordedRun) -> list[tuple[int, str, str]]:
    lines = []
    for who, report in (("Split grasp", run.document["verification"]), ("Parallel grasp", run.initial_report)):
        if report is not None:
            lines.append((step, "INFO" if report["passed"] else "WARN", f"{who}: {_verdict(report)}"))
    return lines


def _verdict(report: dict[str, Any]) -> str:
    return f"{'held' if report['passed'] else 'not held'} ({report['protocol']}). {report['explanation']}"


def _summary(title: str, run: RecordedRun) -> str:
    document = run.document
    lines = [f"# {title}", "", document["advice"], *(f"- {violation}" for violation in document["violations"]), ""]
    for who, report in (("Split grasp", document["verification"]), ("Parallel grasp", run.initial_report)):
        if report is not None:
            lines += [f"**{who}**: {_verdict(report)}", ""]
    lines += ["| metric | value |", "|---|---|"]
    known = {name: value for name, value in document["metrics"].items() if value is not None}
    lines += [f"| {name.replace('_', ' ')} | {value:.5g} |" for name, value in known.items()]
    iterations = document["iterations"]
    lines += [f"| rounds, CPO, PPO | {iterations['outer']}, {iterations['cpo']}, {iterations['ppo']} |"]
    return "\n".join(lines)
