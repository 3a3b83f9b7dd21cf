"""Torsional friction of soft pads against Hertz's pressure, summed up."""

import numpy as np
import pytest

from fingersplit.contacts.torsion import torsional_friction


@pytest.mark.parametrize(("force", "radius", "friction"), [(2.0, 0.007, 0.6), (10.0, 0.012, 0.3)])
def test_it_is_the_moment_of_hertz_pressure(force, radius, friction):
    modulus = 1.5e6
    patch = (3 * force * radius / (4 * modulus)) ** (1 / 3)
    r = (np.arange(20_000) + 0.5) / 20_000 * patch
    pressure = np.sqrt(1 - (r / patch) ** 2)
    ring = 2 * np.pi * r * patch / 20_000
    pressure *= force / (pressure * ring).sum()
    moment = (friction * pressure * r * ring).sum()
    found = torsional_friction(np.array([friction]), np.array([force]), np.array([radius]), modulus)
    assert found[0] == pytest.approx(moment / force, rel=1e-4)


def test_a_patch_is_never_larger_than_its_pad():
    hard, soft = (torsional_friction(np.ones(1), np.array([30.0]), np.array([0.005]), m)[0] for m in (1e9, 10.0))
    assert hard < soft == pytest.approx(3 * np.pi / 16 * 0.005)
