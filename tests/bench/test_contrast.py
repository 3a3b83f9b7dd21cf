"""The table that sets slippery worlds, initial grasps and half the time step side by side."""

from types import SimpleNamespace

import pytest

from fingersplit_bench.contrast import TOP, contrast_table, measure_contrast, time_step_sentence, worlds


def verdict(grasp, protocol, friction):
    """Split grasps hold where friction is planned, all fall where it is not; the third lift hangs on the time step."""
    if grasp == "split2" and protocol.name == "lift" and protocol.time_step < 0.003:
        return False
    return grasp.startswith("split") and friction == 0.6


@pytest.mark.parametrize("fingers", [3, 5])
def test_counts_are_those_of_the_verdicts(fingers):
    runs = [SimpleNamespace(final=f"split{rank}", initial=f"initial{rank}") for rank in range(TOP + 2)]
    rows = [measure_contrast(runs, fingers, verdict), measure_contrast(runs[:1], fingers, verdict)]
    lines = contrast_table(rows).splitlines()
    assert f"| lift, 0.6 | 2/2 | {TOP + 1}/{TOP + 1} | 0/{TOP + 1} |" in lines
    assert f"| lift, 0.05 | 0/2 | 0/{TOP + 1} | 0/{TOP + 1} |" in lines
    assert f"| gravity_six, finger {fingers} without friction | 0/2 | 0/{TOP + 1} | 0/{TOP + 1} |" in lines
    labels = tuple(f"| {world.label} |" for world in worlds(fingers))
    assert sum(line.startswith(labels) for line in lines) == len(labels) == 11 + fingers
    sentence = time_step_sentence(rows)
    assert f"`lift`: 1 of {TOP + 1} verdicts change (25.0%), of the {TOP + 1} that held 1;" in sentence
    assert f"`gravity_six`: 0 of {TOP + 1}" in sentence
