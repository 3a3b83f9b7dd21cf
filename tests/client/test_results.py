import copy
import math
import pickle
import sys
from pathlib import Path

import numpy as np
import pytest

from fingersplit_client import Client, FingersplitClientError, InvalidRequestError, PlanResult, Transform
from fingersplit_client.grasps import Link
from plan_documents import grasp, plan_result
from scripted_server import answers, scripted_server


def test_a_grasp_has_the_matrices_of_its_poses() -> None:
    one = plan_result(grasp(1)).best
    np.testing.assert_allclose(one.matrix, [[1, 0, 0, 0], [0, -1, 0, 0], [0, 0, -1, 0.2], [0, 0, 0, 1]], atol=1e-15)
    assert one.pregrasp is not None
    np.testing.assert_allclose(one.pregrasp.matrix[:3, 3], [0, 0, 0.3])
    assert one.approach == pytest.approx((0.0, 0.0, -1.0))
    assert plan_result(grasp(1, pregrasp=None)).best.approach is None


def test_a_grasp_goes_into_the_robots_frame() -> None:
    quarter = Transform((1.0, 2.0, 3.0), (math.cos(math.pi / 4), 0.0, math.sin(math.pi / 4), 0.0))  # z becomes x
    one = plan_result(grasp(1)).best
    for pose in (quarter, quarter.matrix, (quarter.position, quarter.wxyz)):
        placed = one.in_frame(pose, "base_link")
        np.testing.assert_allclose(placed.matrix, quarter.matrix @ one.matrix, atol=1e-12)
        assert placed.approach == pytest.approx((-1.0, 0.0, 0.0))
        assert placed.pregrasp is not None
        assert placed.pregrasp.position == pytest.approx((1.3, 2.0, 3.0))
        (contact,) = placed.contacts
        assert contact.position == pytest.approx((1.0, 2.0, 2.97))
        assert contact.normal == pytest.approx((0.0, 0.0, -1.0))
        assert contact.force == pytest.approx((0.5, 0.0, 2.0))
    assert one.contacts[0].position == (0.03, 0.0, 0.0)
    assert (
        repr(placed)
        == "<<Grasp of rank 1: feasible, holding margin 1.00 N> in base_link, palm at (1.200, 2.000, 3.000) m>"
    )


def test_joints_come_in_the_order_and_under_the_names_of_the_driver() -> None:
    one = plan_result(grasp(1)).best
    assert one.joint_vector(["tip", "base"]) == [0.4, 1.0]
    assert one.joint_vector({"bh_j12": "base", "bh_j13": "tip"}, at="squeeze") == [1.2, 0.5]
    assert one.joint_vector(["base"], at="pregrasp") == [0.6]
    with pytest.raises(InvalidRequestError, match="no joints knuckle; it has spread, base, tip"):
        one.joint_vector(["knuckle"])
    with pytest.raises(InvalidRequestError, match="no pre-grasp"):
        plan_result(grasp(1, pregrasp=None)).best.joint_vector(["base"], at="pregrasp")
    with pytest.raises(InvalidRequestError, match="'sqeeze'"):
        one.joint_vector(["base"], at="sqeeze")  # type: ignore[arg-type]


def test_the_best_is_the_first_that_held() -> None:
    assert plan_result(grasp(1, feasible=False), grasp(2), grasp(3)).best.rank == 2
    assert plan_result(grasp(1, held=False), grasp(2, held=True), grasp(3)).best.rank == 2
    with pytest.raises(FingersplitClientError, match="held in simulation"):
        _ = plan_result(grasp(1, held=False), grasp(2)).best
    with pytest.raises(FingersplitClientError, match="no feasible grasp"):
        _ = plan_result(grasp(1, feasible=False)).best


def test_grasps_are_selected() -> None:
    side = grasp(3, pregrasp={"palm": {"position": (0.1, 0.0, 0.2), "wxyz": (0.0, 1.0, 0.0, 0.0)}, "joints": {}})
    blocked = grasp(4, pregrasp=None, margin=None)
    result = plan_result(grasp(1, margin=0.2), grasp(2, held=True, margin=0.0), side, blocked, grasp(5, feasible=False))

    def ranks(**wanted: object) -> list[int]:
        return [one.rank for one in result.select(**wanted)]  # type: ignore[arg-type]

    assert ranks() == [1, 2, 3, 4]
    assert ranks(feasible=False) == [1, 2, 3, 4, 5]
    assert ranks(verified=True) == [2]
    assert ranks(margin=0.0) == [1, 2, 3]
    assert ranks(margin=0.1) == [1, 3]
    assert ranks(approach=(0, 0, -3)) == [1, 2]
    assert ranks(approach=(-1, 0, 0), within=0.1) == [3]
    assert ranks(approach=(-1, 0, -1), within=math.pi / 4 + 1e-9) == [1, 2, 3]
    upside_down = Transform(wxyz=(0.0, 1.0, 0.0, 0.0))
    assert ranks(approach=(0, 0, 1), within=0.1, frame_from_object=upside_down) == [1, 2]
    with pytest.raises(InvalidRequestError, match="without a scene"):
        ranks(clearance=0.01)
    with pytest.raises(InvalidRequestError, match="must not be zero"):
        ranks(approach=(0, 0, 0))


def test_a_scene_says_where_the_tool_is_and_what_is_near() -> None:
    pose = {"position": (0.5, 0.0, 0.3), "wxyz": (0.0, 1.0, 0.0, 0.0)}
    world = {"palm": pose, "tool": pose | {"position": (0.5, 0.0, 0.4)}, "pregrasp_tool": None}
    near = {"distance": 0.004, "link": "finger1_distal", "obstacle": "table"}
    free = grasp(3, world=world | {"pregrasp_tool": pose})
    result = plan_result(grasp(1, world=world, clearance=near), grasp(2, world=world), free)
    assert result.best.tool_pose == Transform((0.5, 0.0, 0.4), (0.0, 1.0, 0.0, 0.0))
    assert result.best.pregrasp_tool_pose is None
    assert result.grasps[2].pregrasp_tool_pose == Transform((0.5, 0.0, 0.3), (0.0, 1.0, 0.0, 0.0))
    assert [one.rank for one in result.select(clearance=0.003)] == [1, 2, 3]
    assert [one.rank for one in result.select(clearance=0.005)] == [2, 3]
    assert plan_result(grasp(1)).best.tool_pose is None


def test_a_result_is_saved_and_loaded(tmp_path: Path) -> None:
    result, path = plan_result(grasp(1), grasp(2)), tmp_path / "can.json"
    result.save(path)
    assert PlanResult.load(path) == result
    assert [file.name for file in tmp_path.iterdir()] == ["can.json"]
    path.write_text('{"grasps": 1}')
    with pytest.raises(FingersplitClientError, match=r"can\.json holds no result of this version"):
        PlanResult.load(path)


def test_a_loaded_result_asks_the_service_that_it_is_told(tmp_path: Path) -> None:
    path = tmp_path / "can.json"
    plan_result(grasp(1)).save(path)
    with pytest.raises(FingersplitClientError, match="with a client and its job_id"):
        PlanResult.load(path).picture()
    with scripted_server(answers(b"\x89PNG")) as server, Client(server.url) as client:
        result = PlanResult.load(path, client, "j/1")
        assert (result.picture(), result.picture(), result.job_id) == (b"\x89PNG", b"\x89PNG", "j/1")
        assert result.best.picture() == b"\x89PNG"
        assert [request.path for request in server.requests] == ["/v1/jobs/j%2F1/grasps/1/picture.png"] * 2


def test_results_are_copied_and_pickled_without_their_client() -> None:
    with Client() as client:
        result = plan_result(grasp(1)).linked(Link(client._mode(), "j"))
        assert copy.deepcopy(result) == result
        assert copy.deepcopy(result)._link is result._link
        thawed = pickle.loads(pickle.dumps(result))
    assert thawed == result
    assert (thawed.job_id, thawed._link.mode) == ("j", None)


def test_results_are_short_to_look_at() -> None:
    result = plan_result(grasp(1, held=True), grasp(2, feasible=False, margin=None)).linked(Link(None, "j"))
    assert repr(result) == str(result) == "<PlanResult barrett on <can>: 2 grasps, 1 of 1 starts feasible, job j>"
    assert [repr(one) for one in result.grasps] == [
        "<Grasp of rank 1: feasible, holding margin 1.00 N, held in simulation>",
        "<Grasp of rank 2: not feasible (converged)>",
    ]


def test_a_notebook_shows_the_picture() -> None:
    with scripted_server(answers(b"\x89PNG")) as server, Client(server.url) as client:
        shown = plan_result(grasp(1)).linked(Link(client._mode(), "j"))._repr_html_()
    assert 'src="data:image/png;base64,iVBORw=="' in shown
    assert "&lt;can&gt;" in shown
    assert "<can>" not in shown
    assert "<img" not in plan_result(grasp(1))._repr_html_()
    with Client(server.url) as client:  # which has gone
        assert "<td>yes</td>" in plan_result(grasp(1)).linked(Link(client._mode(), "j"))._repr_html_()


def test_without_numpy_everything_is_there_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "numpy", None)
    one = plan_result(grasp(1)).best
    assert one.in_frame(one.matrix).matrix[2] == pytest.approx((0.0, 0.0, 1.0, 0.0))
