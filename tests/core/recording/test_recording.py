"""Recordings, read back from the file: entities, rows, values, and rerun's own check."""

import subprocess
import sys
from dataclasses import fields, replace

import numpy as np
import pyarrow as pa
import pytest
import trimesh
from rerun.chunk import RrdReader
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from fingersplit.contacts.metric import GraspState
from fingersplit.contacts.metrics import available_metrics
from fingersplit.contacts.wrench_space import WrenchSpace
from fingersplit.objects.convex_pieces import decompose
from fingersplit.objects.mesh import Mesh
from fingersplit.objects.parametric import cylinder
from fingersplit.objects.preparing import prepare_object
from fingersplit.planning.planning import plan
from fingersplit.recording.looks import posed_looks
from fingersplit.recording.posing import hand_links
from fingersplit.recording.replay import replay
from fingersplit.recording.run_recording import write_recording
from fingersplit.splitting.trace import PHASE_NAMES, QUALITY
from fingersplit.splitting.trace_kernel import CPO
from fingersplit.transforms import wxyz_from_rotation
from fingersplit.verification import SimulationFrames, simulate

FRAMES = 40


def measure(name: str, space: WrenchSpace) -> float | None:
    return available_metrics()[name].function(GraspState(space, np.zeros(3)))


class Recording:
    """All columns of a recording by entity and component, in the order of their steps."""

    def __init__(self, path):
        check = subprocess.run(
            [sys.executable, "-m", "rerun_cli", "rrd", "verify", str(path)], capture_output=True, text=True
        )
        assert check.returncode == 0, check.stderr
        self.chunks = RrdReader(path).stream().to_chunks()
        self.entities = {str(chunk.entity_path) for chunk in self.chunks}

    def batches(self, entity, component):
        """Record batches of an entity that hold the component."""
        found = []
        for chunk in self.chunks:
            batch = chunk.to_record_batch()
            names = [name for name in batch.schema.names if name.endswith(f":{component}") or name == component]
            if str(chunk.entity_path) == entity and names:
                found.append((batch, batch.column(names[0])))
        return found

    def rows(self, entity, component, timeline="step"):
        """Steps (n,), and the value of each row as a list of instances."""
        rows = [
            (int(step), values)
            for batch, column in self.batches(entity, component)
            if timeline in batch.schema.names
            for step, values in zip(
                batch.column(timeline).cast(pa.int64()).to_pylist(), column.to_pylist(), strict=True
            )
        ]
        rows.sort(key=lambda row: row[0])
        return [step for step, _ in rows], [values for _, values in rows]

    def scalars(self, entity):
        steps, rows = self.rows(entity, "scalars")
        return np.array(steps), np.array(rows, dtype=float)[:, 0]


@pytest.fixture(scope="module")
def model():
    return prepare_object(cylinder(), "cylinder")


@pytest.fixture(scope="module")
def planned(model, barrett):
    return plan(model, barrett, starts=16, top_k=3, seed=3)


@pytest.fixture(scope="module")
def replayed(planned, model, barrett):
    return replay(planned, 1, model, barrett)


@pytest.fixture(scope="module")
def recording(replayed, model, barrett, tmp_path_factory):
    path = tmp_path_factory.mktemp("recording") / "run.rrd"
    write_recording(path, replayed, model, barrett)
    return Recording(path)


def simulated(final, *, drops, frames=FRAMES):
    """A series as the verification gives it: lifted by 0.1 m, in the second half dropped or held."""
    times, height = np.arange(frames) / 100, np.linspace(0, 0.1, frames)
    up = np.outer(height, (0, 0, 1))
    held = np.ones(frames) if not drops else (np.arange(frames) < frames // 2).astype(float)
    forces = -2.0 * final.normals * held[:, None, None]
    return SimulationFrames(
        times=times,
        phases=(np.arange(frames) >= frames // 2).astype(np.int64),
        phase_names=("squeeze", "lift"),
        palm_positions=final.object_from_palm[:3, 3] + up,
        palm_wxyz=np.tile(wxyz_from_rotation(final.object_from_palm[:3, :3]), (frames, 1)),
        joints=np.tile(final.joints, (frames, 1)),
        object_positions=up * held[:, None],
        object_wxyz=np.tile((1.0, 0.0, 0.0, 0.0), (frames, 1)),
        contact_positions=final.contacts + up[:, None],
        contact_forces=forces,
    )


def test_every_state_is_a_row_and_the_curve_is_that_of_the_trace(recording, replayed):
    trace = replayed.trace
    steps, quality = recording.scalars("/quality/Q")
    np.testing.assert_array_equal(steps, np.arange(len(trace)))
    np.testing.assert_array_equal(quality, trace.scores[:, QUALITY])
    _, colors = recording.rows("/quality/Q", "colors")
    by_phase = {}
    for phase, color in zip(trace.phases, colors, strict=True):
        by_phase.setdefault(PHASE_NAMES[phase], set()).update(color)
    assert by_phase["cpo"] == {0xF2C230FF}  # yellow
    assert by_phase["ppo"] == {0x4F8FD0FF}  # blue
    assert recording.rows("/quality/Q", "scalars", "iteration")[0] == steps.tolist()


def test_the_last_pose_is_the_planned_grasp(recording, replayed, barrett):
    final = replayed.grasp.for_hand(barrett)
    looks = posed_looks(barrett, final.joints)
    drawn = [[], []]
    for link in hand_links(barrett):
        entity = f"/world/hand/{link.name}"
        ((batch, column),) = recording.batches(entity, "vertex_positions")
        assert len(batch) == 1  # meshes are there once
        local = np.array(column.to_pylist()[0])
        (translation,) = recording.rows(entity, "translations")[1][-1]
        (xyzw,) = recording.rows(entity, "quaternions")[1][-1]
        drawn[0].append(Rotation.from_quat(xyzw).apply(local) + translation)
    for _, in_palm in looks:
        drawn[1].append(in_palm @ final.object_from_palm[:3, :3].T + final.object_from_palm[:3, 3])
    there, expected = (cKDTree(np.vstack(points)) for points in drawn)
    assert there.query(expected.data)[0].max() < 1e-6  # every vertex of every look, and no other
    assert expected.query(there.data)[0].max() < 1e-6
    contacts = recording.rows("/world/contacts", "positions")[1][-1]
    np.testing.assert_allclose(contacts, replayed.trace.contacts[-1], atol=1e-7)


def test_tangent_and_reference_steps_stand_on_the_rows_of_cpo_only(recording, replayed, model):
    trace = replayed.trace
    steps, arrows = recording.rows("/world/cpo/tangent_steps", "vectors")
    references = recording.rows("/world/cpo/reference_points", "positions")[1]
    assert steps == list(range(len(trace)))
    assert (trace.phases == CPO).sum() > 3
    for row, phase in enumerate(trace.phases):
        assert len(arrows[row]) == len(references[row]) == (3 if phase == CPO else 0)
        if phase == CPO:
            np.testing.assert_allclose(arrows[row], trace.contact_steps[row], atol=1e-7)
            tangent = np.abs((trace.contact_steps[row] * trace.normals[row - 1]).sum(axis=1))
            assert tangent.max() < 1e-9
            reached = trace.contacts[row - 1] + trace.contact_steps[row]
            nearest = model.mesh.trimesh.nearest.on_surface(reached)[0]
            np.testing.assert_allclose(references[row], nearest, atol=1e-3)  # samples, not triangles


def test_points_in_collision_are_inside_the_hand(replayed, model, barrett, tmp_path):
    trace = replayed.trace
    pushed = np.array(trace.palm_positions)
    pushed[-1] = model.center_of_mass - trace.palm_rotations[-1] @ (0, 0, 0.04)  # the palm stands in the object
    scores = np.array(trace.scores)
    scores[:, 3] = 0.0
    scores[-1, 3] = 0.02
    changed = replace(replayed, trace=replace(trace, palm_positions=pushed, scores=scores))
    write_recording(tmp_path / "run.rrd", changed, model, barrett)
    rows = Recording(tmp_path / "run.rrd").rows("/world/collision_points", "positions")[1]
    assert all(len(row) == 0 for row in rows[:-1])
    in_palm = (np.array(rows[-1]) - pushed[-1]) @ trace.palm_rotations[-1]
    base = (np.hypot(in_palm[:, 0], in_palm[:, 1]) < 0.0446) & (in_palm[:, 2] > -1e-6) & (in_palm[:, 2] < 0.0796)
    assert base.sum() > 50


def test_metrics_of_rows_are_those_of_the_grasp_metrics(recording, replayed, model):
    trace = replayed.trace
    isotropies, volumes = recording.scalars("/metrics/Q_iso")[1], recording.scalars("/metrics/Q_vol")[1]
    for row in (0, len(trace) // 2, len(trace) - 1):
        space = WrenchSpace(trace.contacts[row], trace.normals[row], 0.6, model.center_of_mass, model.radius)
        assert isotropies[row] == pytest.approx(measure("isotropy", space))
        assert volumes[row] == pytest.approx(measure("volume", space))
    steps, values = recording.scalars("/metrics/ferrari_canny")
    assert steps[0] == 0
    assert steps[-1] == len(trace) - 1
    for row, value in zip(steps, values, strict=True):
        space = WrenchSpace(trace.contacts[row], trace.normals[row], 0.6, model.center_of_mass, model.radius)
        assert value == pytest.approx(measure("ferrari_canny", space))


def test_every_number_is_finite(recording):
    numbers = 0
    for chunk in recording.chunks:
        for column in chunk.to_record_batch().columns:
            flat = column
            while pa.types.is_list(flat.type) or pa.types.is_fixed_size_list(flat.type):
                flat = flat.flatten()
            if pa.types.is_floating(flat.type):
                values = flat.to_numpy(zero_copy_only=False)
                assert np.isfinite(values).all(), chunk.entity_path
                numbers += len(values)
    assert numbers > 10_000


def test_the_log_says_how_it_went_and_ended(recording, replayed):
    steps, texts = recording.rows("/log", "text")
    said = [text for row in texts for text in row]
    assert said[0].startswith("Mapped start")
    assert steps[-1] == len(replayed.trace) - 1
    assert replayed.grasp.advice in said[-1]
    assert sum(text.startswith("CPO") for text in said) >= 1
    states = [state for row in recording.rows("/phase", "state")[1] for state in row]
    assert states[:2] == ["map", "cpo"]


def test_the_simulation_goes_on_after_the_planning_with_both_grasps_side_by_side(replayed, model, barrett, tmp_path):
    states, path, final = len(replayed.trace), tmp_path / "lift.rrd", replayed.grasp.for_hand(barrett)
    report = simulate(final, barrett, model, decompose(model.mesh)).report
    slipped = replace(report, passed=False, reason="slipped", explanation="The object slipped.")
    initial = replace(replayed.grasp.initial, verification=slipped)
    run = replace(
        replayed,
        grasp=replace(replayed.grasp, verification=replace(report, explanation="Held."), initial=initial),
        frames=simulated(final, drops=False),
        initial_frames=simulated(final, drops=True, frames=FRAMES // 2 + 5),
    )
    write_recording(path, run, model, barrett)
    recording = Recording(path)
    steps, places = recording.rows("/world/object", "translations")
    assert steps == [0, *range(states, states + FRAMES)]
    assert {len(place) for place in places} == {2}  # split, and initial beside it
    split, beside = np.array(places[-1])
    np.testing.assert_allclose(split, (0, 0, 0.1), atol=1e-7)
    assert np.linalg.norm(beside[:2]) > 2 * model.radius
    assert beside[2] == pytest.approx(0)
    palm_rows = recording.rows("/world/hand/palm", "translations")[0]
    assert palm_rows == list(range(states + FRAMES))
    arrows = recording.rows("/world/forces/split", "vectors")[1]
    assert [len(row) for row in arrows] == [3] * FRAMES
    dropped = recording.rows("/world/forces/initial", "vectors")[1]
    assert len(dropped[-1]) == 0
    assert recording.scalars("/simulation/force_N/split/finger1")[1].max() == pytest.approx(2.0)
    assert recording.scalars("/simulation/slip_mm/split")[1].max() < 1e-6
    assert recording.scalars("/simulation/slip_mm/initial")[1].max() > 10
    times = recording.rows("/simulation/slip_mm/split", "scalars", "sim_time")[0]
    np.testing.assert_allclose(np.array(times) / 1e9, np.arange(FRAMES) / 100, atol=1e-9)
    said = [text for row in recording.rows("/log", "text")[1] for text in row]
    assert said[-2] == "Split grasp: held (lift). Held."
    assert said[-1] == "Parallel grasp: not held (lift). The object slipped."


def test_an_unstable_simulation_is_shown_up_to_its_first_bad_frame(replayed, model, barrett, tmp_path):
    series = simulated(replayed.grasp.for_hand(barrett), drops=False)
    series.object_positions[FRAMES // 2] = np.nan
    write_recording(tmp_path / "run.rrd", replace(replayed, frames=series), model, barrett)
    assert len(Recording(tmp_path / "run.rrd").scalars("/simulation/slip_mm/split")[0]) == FRAMES // 2


def test_many_states_of_a_large_object_with_its_simulation_are_a_small_file(barrett, tmp_path):
    model = prepare_object(cylinder(), "cylinder")
    run = replay(plan(model, barrett, starts=8, top_k=1, seed=3), 1, model, barrett)
    steps = np.linspace(0, len(run.trace) - 1, 121).round().astype(int)
    trace = type(run.trace)(**{c.name: getattr(run.trace, c.name)[steps] for c in fields(run.trace)})
    series = simulated(run.grasp.for_hand(barrett), drops=False, frames=250)
    fine = replace(model, mesh=uneven_sphere(20_000))
    write_recording(tmp_path / "run.rrd", replace(run, trace=trace, frames=series), fine, barrett)
    assert (tmp_path / "run.rrd").stat().st_size <= 1.5e6


def uneven_sphere(vertices):
    """A ball with a rough surface, as a scan has it: about so many vertices, none like another."""
    rows = int(np.sqrt(vertices / 2))
    ball = trimesh.creation.uv_sphere(radius=0.035, count=[rows, rows])
    rough = 1 + 0.003 * np.random.default_rng(1).normal(size=(len(ball.vertices), 1))
    assert abs(len(ball.vertices) - vertices) < 0.1 * vertices
    return Mesh(ball.vertices * rough, ball.faces)
