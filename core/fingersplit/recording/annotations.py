"""The annotations of a recording: phases, log and summary."""

from fingersplit.contacts.metrics import available_metrics
from fingersplit.extras import extra
from fingersplit.recording import colors
from fingersplit.recording.replay import ReplayedGrasp
from fingersplit.recording.series import RecordedFrames, phases_of
from fingersplit.result.verification import Verification
from fingersplit.splitting.trace import QUALITY

with extra("recording"):
    import rerun as rr

__all__ = ["annotate"]

_PHASES = {
    "map": "parallel grasp, mapped",
    "cpo": "CPO: contacts move",
    "ppo": "PPO: palm moves",
    "settle": "settling on the surface",
}


def annotate(stream: rr.RecordingStream, title: str, replayed: ReplayedGrasp, simulated: RecordedFrames | None) -> None:
    """Write phases, log and summary of a grasp's history."""
    phases = [] if simulated is None else list(dict.fromkeys(simulated.phases))
    names = [*_PHASES, *phases]
    palette = [*colors.PHASES.values(), *(colors.FINGERS[i % len(colors.FINGERS)] for i in range(len(phases)))]
    configuration = rr.StateConfiguration(
        values=names, labels=[_PHASES.get(n, n) for n in names], colors=[colors.rgba(color) for color in palette]
    )
    stream.log("phase", configuration, static=True)
    stream.log("summary", rr.TextDocument(_summary(title, replayed), media_type="text/markdown"), static=True)
    states, lines = _planning_lines(replayed)
    count = len(replayed.trace)
    if simulated is not None:
        names_of_frames = simulated.phases
        begins = [row for row, name in enumerate(names_of_frames) if row == 0 or name != names_of_frames[row - 1]]
        states += [(count + row, names_of_frames[row]) for row in begins]
        lines += [(count + row, "INFO", f"{simulated.times[row]:.2f} s: {names_of_frames[row]}") for row in begins]
    lines += _verdicts(count - 1 + (0 if simulated is None else len(simulated.times)), replayed)
    changes = rr.StateChange.columns(state=[name for _, name in states])
    stream.send_columns("phase", [rr.TimeColumn("step", sequence=[step for step, _ in states])], changes)
    texts = rr.TextLog.columns(text=[text for _, _, text in lines], level=[level for _, level, _ in lines])
    stream.send_columns("log", [rr.TimeColumn("step", sequence=[step for step, _, _ in lines])], texts)


def _planning_lines(replayed: ReplayedGrasp) -> tuple[list[tuple[int, str]], list[tuple[int, str, str]]]:
    """First row and name of every phase; row, level and text of the log's lines about planning."""
    quality, grasp = replayed.trace.scores[:, QUALITY], replayed.grasp
    states, lines = [], list[tuple[int, str, str]]()
    for name, first, end in phases_of(replayed.trace):
        states.append((first, name))
        if name == "map":
            lines.append((first, "INFO", f"Mapped start, Q = {quality[first]:.5f}"))
        else:
            change = f"Q {quality[first - 1]:.5f} to {quality[end - 1]:.5f}"
            lines.append((first, "INFO", f"{_PHASES[name]}: {end - first} steps, {change}"))
    last = len(replayed.trace) - 1
    level = "INFO" if grasp.feasible else "WARN"
    lines.append((last, level, f"Ended: {grasp.termination.label.replace('_', ' ')}. {grasp.advice}"))
    lines += [(last, "WARN", violation) for violation in grasp.violations]
    return states, lines


def _reports(replayed: ReplayedGrasp) -> list[tuple[str, Verification]]:
    """The verification reports that there are, and whose they are."""
    both = (("Split grasp", replayed.grasp.verification), ("Parallel grasp", replayed.grasp.initial.verification))
    return [(name, report) for name, report in both if report is not None]


def _verdicts(step: int, replayed: ReplayedGrasp) -> list[tuple[int, str, str]]:
    return [
        (step, "INFO" if report.passed else "WARN", f"{name}: {_verdict(report)}")
        for name, report in _reports(replayed)
    ]


def _verdict(report: Verification) -> str:
    return f"{'held' if report.passed else 'not held'} ({report.protocol}). {report.explanation}"


def _summary(title: str, replayed: ReplayedGrasp) -> str:
    grasp = replayed.grasp
    lines = [f"# {title}", "", grasp.advice, *(f"- {violation}" for violation in grasp.violations), ""]
    for name, report in _reports(replayed):
        lines += [f"**{name}**: {_verdict(report)}", ""]
    lines += ["| metric | value |", "|---|---|"]
    for metric in available_metrics().values():
        value = grasp.metrics.get(metric.name)
        if value is not None:
            lines.append(f"| {metric.name.replace('_', ' ')} | {value:.5g} {metric.unit} |")
    iterations = grasp.iterations
    lines += [f"| rounds, CPO, PPO | {iterations.outer}, {iterations.cpo}, {iterations.ppo} |"]
    return "\n".join(lines)
