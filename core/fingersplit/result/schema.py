"""The client's schemas of results, written from the dataclasses: ``python -m fingersplit.result.schema``.

Core and client may not import each other, so the pydantic models of the client are files that this program writes, one
a module of results, from type hints, docstrings and the metadata of fields; and so are the words for their faults. A
test holds them against what it would write.
"""

import inspect
import re
import sys
from collections.abc import Iterator
from dataclasses import MISSING, Field, fields, is_dataclass, make_dataclass
from enum import Enum
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

from fingersplit import field_faults
from fingersplit.contacts.metrics import available_metrics
from fingersplit.objects.intake.report import CloudReport, IntakeReport
from fingersplit.objects.options import ObjectOptions
from fingersplit.objects.source import ObjectSource
from fingersplit.result.grasp import (
    Contact,
    GraspMetrics,
    GraspResult,
    GraspTimings,
    HoldProbability,
    InitialGrasp,
    Iterations,
    PalmPose,
    ParallelContacts,
    Pregrasp,
    SplitGrasp,
)
from fingersplit.result.grip import PlannedGrip
from fingersplit.result.plan import PlannedObject, PlanResult, PlanSummary, PlanTimings, Provenance
from fingersplit.result.scene import Clearance, FramePose, Relaxation, SceneSummary, Way, WorldPoses
from fingersplit.result.verification import (
    GripReport,
    PhaseReport,
    Reason,
    TrialReport,
    Verification,
    VerificationSummary,
)
from fingersplit.result.wire import Json, Quaternion, Vector3, described
from fingersplit.splitting.termination import Termination

__all__ = ["client_modules", "write_client_modules"]

SCHEMAS = Path(__file__).parents[3] / "clients" / "python" / "fingersplit_client" / "schemas"
"""Where the client's schemas are in a checkout."""
MODULE = "fingersplit.result.schema"
WIDTH = 120
_NAMES: dict[Any, str] = {
    TrialReport: "VerificationTrial",
    GraspResult: "Grasp",
    GripReport: "VerificationGrip",
    InitialGrasp: "InitialState",
    PalmPose: "Palm",
    ParallelContacts: "ParallelGrasp",
    PhaseReport: "VerificationPhase",
    PlannedGrip: "Grip",
    Reason: "VerificationReason",
}
"""What clients call a type, where it is not what it is called here."""
_ALIASES: dict[str, tuple[Any, str]] = {
    "verification": (Reason, "Why a grasp passed or failed; only ``held`` is a pass."),
    "plan": (Termination, "Why a run of the planner ended."),
}
_CLASSES: dict[str, tuple[type, ...]] = {
    "verification": (PhaseReport, TrialReport, GripReport, Verification, VerificationSummary),
    "plan": (
        ParallelContacts,
        PalmPose,
        Contact,
        Iterations,
        GraspTimings,
        Pregrasp,
        SplitGrasp,
        HoldProbability,
        PlannedGrip,
        InitialGrasp,
        FramePose,
        WorldPoses,
        Way,
        Clearance,
        Relaxation,
        SceneSummary,
        GraspResult,
        PlannedObject,
        Provenance,
        PlanSummary,
        PlanTimings,
        PlanResult,
    ),
}
_WRITTEN_BY_HAND: dict[str, tuple[type, ...]] = {
    "objects": (CloudReport, IntakeReport, ObjectOptions, ObjectSource),
}
"""Types whose schemas the client has in modules of its own."""
_TITLES = {
    "verification": "Verification reports: what simulating a grasp showed.",
    "plan": "The result of planning: the same document in the API, in the client and on the command line.",
}


def client_modules() -> dict[str, str]:
    """The source of every generated module of the client's schemas, by its name."""
    kinds = _CLASSES | {"plan": (_metrics(), *_CLASSES["plan"])}
    return {name: _module(name, kinds) for name in kinds} | {"field_faults": _words_for_faults()}


def _words_for_faults() -> str:
    """The words that core and service use for faults of fields, as the client has them."""
    title, rest = inspect.getsource(field_faults).split('"""\n', 1)
    return f'{title}\n\nWritten by ``python -m {MODULE}``; change ``{field_faults.__name__}`` there.\n"""\n{rest}'


def _metrics() -> type:
    """A class with a field for every metric that is known here; documents of other versions may have more."""
    described_metrics = [
        (metric.name, float | None if metric.may_be_missing else float, described(metric.meaning, metric.unit))
        for metric in available_metrics().values()
    ]
    doc = "Every metric of a grasp by its name; `GET /v1/metrics` says what each means and which way is better."
    return make_dataclass("Metrics", described_metrics, namespace={"__doc__": doc, "open": True})


def write_client_modules(folder: Path = SCHEMAS) -> None:
    """Write the modules into the client's folder of schemas."""
    for name, source in client_modules().items():
        (folder / f"{name}.py").write_text(source)


def _module(name: str, classes: dict[str, tuple[type, ...]]) -> str:
    alias, alias_doc = _ALIASES[name]
    kinds = classes[name]
    public = "".join(f'    "{one}",\n' for one in sorted(map(_name, (alias, *kinds))))
    head = [
        f'"""{_TITLES[name]}\n\nWritten by ``python -m {MODULE}``; change the dataclasses there.\n"""\n',
        "from typing import Literal\n",
        *_imports(name, classes),
        f"\n__all__ = [\n{public}]\n",
    ]
    body = [_alias(alias, alias_doc), *map(_schema, kinds)]
    return "\n".join(head) + "\n" + "\n\n\n".join(body) + "\n"


def _imports(name: str, classes: dict[str, tuple[type, ...]]) -> Iterator[str]:
    """The imports that a module needs."""
    hints = [_type(hint) for kind in classes[name] for hint in get_type_hints(kind).values()]
    used = {"Document", *re.findall(r"\w+", " ".join(hints))}
    config = "ConfigDict, " if any(hasattr(kind, "open") for kind in classes[name]) else ""
    yield f"from pydantic import {config}Field{', JsonValue' if 'JsonValue' in used else ''}\n"
    modules: dict[str, list[str]] = {"base": ["Document", "Quaternion", "Vector3"]}
    others = _WRITTEN_BY_HAND | classes
    modules |= {other: sorted(map(_name, kinds)) for other, kinds in others.items() if other != name}
    for module, known in modules.items():
        imported = [one for one in known if one in used]
        if imported:
            yield f"from fingersplit_client.schemas.{module} import {', '.join(imported)}"


def _alias(kind: Any, doc: str) -> str:
    values = "".join(f'    "{value}",\n' for value in _choices(kind))
    return f'{_name(kind)} = Literal[\n{values}]\n"""{doc}"""'


def _schema(kind: type) -> str:
    hints = get_type_hints(kind)
    paragraphs = inspect.cleandoc(kind.__doc__ or "").split("\n\n")
    doc = "\n\n".join(f"    {paragraph}".replace("\n", "\n    ") for paragraph in paragraphs).lstrip()
    end = '"""' if len(paragraphs) == 1 else '\n    """'
    lines = [f"class {_name(kind)}(Document):", f'    """{doc}{end}', ""]
    if hasattr(kind, "open"):
        lines += ['    model_config = ConfigDict(extra="allow")', "    __pydantic_extra__: dict[str, float | None]", ""]
    return "\n".join(lines + [_field(part, hints[part.name]) for part in fields(kind)])


def _field(part: "Field[Any]", hint: Any) -> str:
    """One field as ruff would format it."""
    about = part.metadata
    arguments = []
    if part.default is not MISSING:
        default = [] if part.default == () else part.default
        arguments.append(f"default={default!r}".replace("'", '"'))
    meaning, semicolon, exception = about["doc"].removesuffix(".").partition("; ")
    unit = f" [{about['unit']}]" if about["unit"] not in ("", "1") else ""
    arguments.append(f'description="{meaning}{unit}{semicolon}{exception}."')
    if about.get("examples"):
        arguments.append(f"examples={about['examples']!r}")
    head = f"    {part.name}: {_type(hint)} = Field("
    line = f"{head}{', '.join(arguments)})"
    if len(line) <= WIDTH:
        return line
    inner = f"        {', '.join(arguments)}"
    if len(inner) <= WIDTH:
        return f"{head}\n{inner}\n    )"
    return f"{head}\n" + "".join(f"{line}\n" for one in arguments for line in _argument(one)) + "    )"


def _argument(argument: str) -> Iterator[str]:
    """An argument on a line of its own, its text broken where it is too long."""
    name, _, text = argument.partition("=")
    start = f"        {name}="
    if len(start) + len(text) + 1 <= WIDTH:
        yield f"{start}{text},"
        return
    words, line = text[1:-1].split(" "), ""
    pieces = list[str]()
    for word in words:
        room = WIDTH - (len(start) if not pieces else 8) - 4
        if line and len(line) + len(word) + 1 > room:
            pieces.append(line + " ")
            line = ""
        line = f"{line} {word}" if line else word
    pieces.append(line)
    for number, piece in enumerate(pieces):
        comma = "," if number == len(pieces) - 1 else ""
        yield f'{start if number == 0 else 8 * " "}"{piece}"{comma}'


def _type(hint: Any) -> str:
    """A type hint as the client writes it."""
    for known, name in (
        (Vector3, "Vector3"),
        (Quaternion, "Quaternion"),
        (Json, "JsonValue"),
        (GraspMetrics, "Metrics"),
    ):
        if hint == known:
            return name
    origin, arguments = get_origin(hint), get_args(hint)
    if origin in (Union, UnionType):
        inner = [_type(one) for one in arguments if one is not NoneType]
        return " | ".join([*inner, *(["None"] if NoneType in arguments else [])])
    if origin is tuple:
        if arguments[-1] is Ellipsis:
            return f"list[{_type(arguments[0])}]"
        return f"tuple[{', '.join(_type(one) for one in arguments)}]"
    if origin is dict:
        return f"dict[str, {_type(arguments[1])}]"
    if origin is Literal and hint not in _NAMES:
        return "Literal[" + ", ".join(f'"{value}"' for value in arguments) + "]"
    return _name(hint)


def _name(kind: Any) -> str:
    return _NAMES.get(kind) or str(kind.__name__)


def _choices(kind: Any) -> list[str]:
    """The values of a Literal or of an Enum, as documents hold them."""
    if get_origin(kind) is Literal:
        return list(get_args(kind))
    assert issubclass(kind, Enum)
    return [value.name.lower() for value in kind]


if __name__ == "__main__":
    assert all(is_dataclass(kind) for kinds in _CLASSES.values() for kind in kinds)
    write_client_modules(Path(sys.argv[1]) if len(sys.argv) > 1 else SCHEMAS)
