"""Grasps in simulation: squeezed, lifted, pulled or shaken in MuJoCo, with a report of what happened."""

from fingersplit.verification.frames import SimulationFrames
from fingersplit.verification.ranked import verify_ranked
from fingersplit.verification.verifying import Simulated, repeat_simulation, simulate, verify

__all__ = ["Simulated", "SimulationFrames", "repeat_simulation", "simulate", "verify", "verify_ranked"]
