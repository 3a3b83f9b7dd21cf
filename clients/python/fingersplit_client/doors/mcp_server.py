"""An MCP server: grasp planning as tools for assistants, over a Fingersplit service; needs the extra ``mcp``."""

import functools
import json
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from mcp.server.mcpserver import Image, MCPServer
from mcp.server.mcpserver.exceptions import ToolError

from fingersplit_client.client import AsyncClient
from fingersplit_client.errors import FingersplitClientError
from fingersplit_client.results import Job, PlanResult

__all__ = ["build_server"]

Params = ParamSpec("Params")
Returned = TypeVar("Returned")

INSTRUCTIONS = (
    "Plans grasps for robot hands with three or more fingers. Upload a mesh with its unit, plan, look at the best "
    "grasp with explain_grasp, and export it for the robot. Lengths are in metres, angles in radians, masses in "
    "kilograms; poses are of the palm in the object frame, quaternions wxyz."
)
MAX_TEXT = 200_000
"""Characters of an export that are answered; a longer one needs a file."""


def _faults_as_tool_errors(tool: Callable[Params, Awaitable[Returned]]) -> Callable[Params, Awaitable[Returned]]:
    """Errors of client and service as sentences."""

    @functools.wraps(tool)
    async def run(*args: Params.args, **kwargs: Params.kwargs) -> Returned:
        try:
            return await tool(*args, **kwargs)
        except FingersplitClientError as error:
            advice = error.advice if error.advice not in str(error) else ""
            raise ToolError(f"{error} {advice}".strip()) from error
        except OSError as error:
            raise ToolError(f"{error.filename or 'The file'}: {error.strerror or error}.") from error

    return run


def build_server(client: AsyncClient) -> MCPServer:
    """The server with its tools; run it with ``.run()``, which talks over standard input and output.

    Args:
        client: The service.
    """
    server = MCPServer(
        "fingersplit", title="Fingersplit grasp planning", instructions=INSTRUCTIONS, log_level="WARNING"
    )
    for tool in (
        _upload(client),
        _list_hands(client),
        _plan(client),
        _explain(client),
        _verify(client),
        _export(client),
    ):
        server.tool(structured_output=False)(_faults_as_tool_errors(tool))
    return server


Tool = Callable[..., Awaitable[Any]]


def _upload(client: AsyncClient) -> Tool:
    async def upload_object(
        path: str,
        unit: str = "m",
        scale: float = 1.0,
        name: str | None = None,
        mass: float | None = None,
        density: float | None = None,
        friction: float | None = None,
    ) -> dict[str, Any]:
        """Upload a mesh (STL, OBJ, PLY, OFF, GLB) or point cloud (PLY, PCD, NPZ) from a file on this machine.

        Say the unit of the file (m, mm, cm or in); it is never guessed. Give mass [kg] or density [kg/m^3], and the
        Coulomb friction with the fingertips, where they are known. The answer has the object_id for plan_grasps.
        """
        given = {"scale": scale, "name": name, "mass": mass, "density": density, "friction": friction}
        known: Any = {key: value for key, value in given.items() if value is not None} | {"unit": unit}
        info = await client.objects.upload(path, **known)
        document = info.model_dump(mode="json", exclude={"id", "created_at"})
        return {"object_id": info.id} | document

    return upload_object


def _list_hands(client: AsyncClient) -> Tool:
    async def list_hands() -> list[dict[str, Any]]:
        """The hands that can be planned for, with fingers, joints and their limits [rad]."""
        return [hand.model_dump(mode="json") for hand in await client.hands.list()]

    return list_hands


def _plan(client: AsyncClient) -> Tool:
    async def plan_grasps(
        object_id: str,
        hand: str = "barrett",
        starts: int = 64,
        seed: int = 0,
        top_k: int = 5,
        verified: int = 0,
        protocol: str = "lift",
        scene: dict[str, Any] | None = None,
        approach: dict[str, Any] | None = None,
    ) -> dict[str, Any]:
        """Plan ranked grasps of an uploaded object and wait for them.

        `verified` simulates ranked grasps until so many have held (protocol lift, shake, pick, six_direction ...).
        `scene` says what stands around, such as {"support_surfaces": [{"id": "table"}]}; `approach` where the hand may
        come from, such as {"directions": [{"axis": [0, 0, -1], "max_angle": 0.6}]}.
        """
        said = {
            "hand": hand,
            "starts": starts,
            "seed": seed,
            "top_k": top_k,
            "verified": verified,
            "protocol": protocol,
        }
        options: Any = said | {"scene": scene, "approach": approach}
        result = await client.plan(await client.objects.get(object_id), **options)
        return {"job_id": result.job_id, "message": result.summary.message, "grasps": _rows(result)}

    return plan_grasps


def _explain(client: AsyncClient) -> Tool:
    async def explain_grasp(job_id: str, rank: int = 1) -> list[Any]:
        """One grasp of a plan in detail, with a picture of hand and object before and after the search."""
        result = await _result(client, job_id)
        grasp = next((one for one in result.grasps if one.rank == rank), None)
        if grasp is None:
            raise ToolError(f"There is no grasp of rank {rank}; the plan has {len(result.grasps)}.")
        text = {
            "reason": grasp.reason,
            "termination": grasp.termination,
            "advice": grasp.advice,
            "violations": grasp.violations,
            "palm": grasp.palm.model_dump(),
            "joints": grasp.joints,
            "squeeze_joints": grasp.squeeze_joints,
            "pregrasp": None if grasp.pregrasp is None else grasp.pregrasp.model_dump(mode="json"),
            "metrics": grasp.metrics.model_dump(),
            "simulation": None if grasp.verification is None else grasp.verification.explanation,
        }
        return [json.dumps(text), Image(data=await result.picture(rank), format="png")]

    return explain_grasp


def _verify(client: AsyncClient) -> Tool:
    async def verify_grasps(
        job_id: str, count: int = 1, protocol: str = "lift", friction: float | None = None
    ) -> dict[str, Any]:
        """Simulate the grasps of a plan, best first, until `count` have held; it is a new job with the same grasps.

        `friction` is that of the simulated world; grip forces stay planned for the friction of the plan.
        """
        asked = (await client.jobs.get(job_id)).request
        again = asked.model_copy(update={"verified": count, "protocol": protocol, "simulated_friction": friction})
        job = await client.jobs.create(type(asked).model_validate(again.model_dump()))
        result = await _result(client, (await client.jobs.wait(job.id)).id)
        summary = result.summary.verification
        return {
            "job_id": job.id,
            "message": summary.message if summary else result.summary.message,
            "grasps": [
                {"rank": one.rank, "held": one.held, "explanation": one.verification.explanation}
                for one in result.grasps
                if one.verification is not None
            ],
        }

    return verify_grasps


def _export(client: AsyncClient) -> Tool:
    async def export_grasps(
        job_id: str, format_name: str = "moveit", rank: int | None = None, path: str | None = None
    ) -> str:
        """The grasps of a plan in the format of another tool: moveit, isaac_grasp, curobo, dexgraspnet and others.

        All that can be executed, or the one of `rank`. With `path` a file is written; binary formats need it.
        """
        content = await client.jobs.export(job_id, format_name, rank=rank)
        if path is not None:
            Path(path).write_bytes(content)
            return f"Wrote {len(content)} bytes to {path}."
        try:
            text = content.decode()
        except UnicodeDecodeError:
            raise ToolError(f"{format_name} is a binary format; give a path to write it to.") from None
        if len(text) > MAX_TEXT:
            raise ToolError(f"The export has {len(text)} characters; give a path to write it to, or one rank.")
        return text

    return export_grasps


async def _result(client: AsyncClient, job_id: str) -> PlanResult[Any]:
    job: Job[Any] = await client.jobs.get(job_id)
    if job.result is None:
        reason = job.error.detail if job.error else f"it is {job.state}"
        raise ToolError(f"Job {job_id} has no result: {reason}")
    return job.result


def _rows(result: PlanResult[Any]) -> list[dict[str, Any]]:
    return [
        {
            "rank": grasp.rank,
            "feasible": grasp.feasible,
            "held_in_simulation": grasp.held,
            "holding_margin_N": grasp.metrics.holding_margin,
            "palm": grasp.palm.model_dump(),
            "joints": grasp.joints,
            "reason": grasp.reason,
        }
        for grasp in result.grasps
    ]
