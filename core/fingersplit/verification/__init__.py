"""Proof in simulation: a grasp is squeezed, lifted, pulled or shaken in MuJoCo, and the report says what happened."""

from fingersplit.verification.report import Simulation, Verification
from fingersplit.verification.verifying import verify

__all__ = ["Simulation", "Verification", "verify"]
