"""The MCP server in a process of its own, asked by the SDK's client over standard input and output."""

import json
import sys
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import pytest
from mcp import Client as McpClient
from mcp import StdioServerParameters

from fingersplit_client import PlanResult

pytestmark = pytest.mark.anyio
PROGRAM = "from fingersplit_client.commands.program import main; main()"


def parameters(url: str) -> StdioServerParameters:
    paths = {"PYTHONPATH": ":".join(sys.path)}
    return StdioServerParameters(command=sys.executable, args=["-c", PROGRAM, "mcp", "--server", url], env=paths)


@pytest.fixture(scope="module")
async def tools(service: str) -> AsyncIterator[McpClient]:
    async with McpClient(parameters(service)) as client:
        yield client


async def call(client: McpClient, name: str, **arguments: Any) -> Any:
    """What a tool answers, parsed."""
    answer = await client.call_tool(name, arguments)
    assert not answer.is_error, answer.content
    return json.loads(answer.content[0].text)  # type: ignore[union-attr]


async def test_the_tools_say_what_they_do(tools: McpClient) -> None:
    listed = {tool.name: tool for tool in (await tools.list_tools()).tools}
    names = {"upload_object", "list_hands", "plan_grasps", "explain_grasp", "verify_grasps", "export_grasps"}
    assert listed.keys() == names
    assert all(len(tool.description or "") > 50 for tool in listed.values())
    assert listed["plan_grasps"].input_schema["required"] == ["object_id"]


async def test_from_a_file_to_an_export(tools: McpClient, can: bytes, tmp_path: Path) -> None:
    mesh = tmp_path / "can.off"
    mesh.write_bytes(can)
    uploaded = await call(tools, "upload_object", path=str(mesh), mass=0.3)
    assert uploaded["options"]["mass"] == 0.3
    planned = await call(tools, "plan_grasps", object_id=uploaded["object_id"], starts=8, top_k=2)
    assert [grasp["rank"] for grasp in planned["grasps"]] == [1, 2]
    explained = await tools.call_tool("explain_grasp", {"job_id": planned["job_id"], "rank": 1})
    text, picture = explained.content
    assert json.loads(text.text)["joints"] == planned["grasps"][0]["joints"]  # type: ignore[union-attr]
    assert picture.mime_type == "image/png"  # type: ignore[union-attr]
    exported = await call(tools, "export_grasps", job_id=planned["job_id"], rank=1)
    assert exported["grasps"][0]["id"] == "grasp_1"
    file = tmp_path / "sample.npy"
    told = await tools.call_tool(
        "export_grasps", {"job_id": planned["job_id"], "format_name": "dexgraspbench", "path": str(file)}
    )
    assert str(file) in told.content[0].text  # type: ignore[union-attr]
    assert file.stat().st_size > 100


async def test_grasps_of_a_plan_are_verified(tools: McpClient, result: PlanResult) -> None:
    verified = await call(tools, "verify_grasps", job_id=result.job_id)
    assert verified["grasps"][-1]["held"]
    assert "1 requested" in verified["message"]


async def test_faults_are_sentences(tools: McpClient, unused_url: str) -> None:
    for name, arguments, told in (
        ("plan_grasps", {"object_id": "none"}, "There is no object 'none'"),
        ("upload_object", {"path": "/nowhere.ply"}, "/nowhere.ply: No such file"),
        ("explain_grasp", {"job_id": "none"}, "There is no job 'none'"),
    ):
        answer = await tools.call_tool(name, arguments)
        assert answer.is_error
        assert told in answer.content[0].text  # type: ignore[union-attr]
    async with McpClient(parameters(unused_url)) as alone:
        answer = await alone.call_tool("list_hands", {})
        assert answer.is_error
        assert "No answer from" in answer.content[0].text  # type: ignore[union-attr]
