"""The result of planning as plain, typed data with its provenance: one reader, one writer, one definition."""

from fingersplit.result.files import read_result, write_result
from fingersplit.result.grasp import GraspResult
from fingersplit.result.plan import PlanResult, Provenance
from fingersplit.result.verification import Verification, VerificationSummary

__all__ = [
    "GraspResult",
    "PlanResult",
    "Provenance",
    "Verification",
    "VerificationSummary",
    "read_result",
    "write_result",
]
