"""The wire types: every document the service reads or writes; the service imports them from here.

Lengths are in metres, angles in radians, forces in newtons. Points and directions are in the object frame,
the frame of the uploaded mesh; quaternions are ``wxyz``. Surface normals point out of the object.
"""

from fingersplit_client.schemas.base import Document, Quaternion, Unit, Vector3
from fingersplit_client.schemas.jobs import Job, JobCreate, JobError, JobState, JobSummary
from fingersplit_client.schemas.plan import (
    Contact,
    Grasp,
    GraspTimings,
    InitialState,
    Iterations,
    Metrics,
    Palm,
    ParallelGrasp,
    PlannedObject,
    PlanResult,
    PlanSummary,
    PlanTimings,
    Termination,
)
from fingersplit_client.schemas.problem import InvalidField, Problem
from fingersplit_client.schemas.resources import (
    CloudReport,
    HandFinger,
    HandInfo,
    HandJoint,
    Health,
    IntakeReport,
    ObjectInfo,
    ObjectOptions,
    Readiness,
)
from fingersplit_client.schemas.verification import (
    Proof,
    Verification,
    VerificationBranch,
    VerificationGrip,
    VerificationPhase,
    VerificationReason,
)

__all__ = [
    "CloudReport",
    "Contact",
    "Document",
    "Grasp",
    "GraspTimings",
    "HandFinger",
    "HandInfo",
    "HandJoint",
    "Health",
    "InitialState",
    "IntakeReport",
    "InvalidField",
    "Iterations",
    "Job",
    "JobCreate",
    "JobError",
    "JobState",
    "JobSummary",
    "Metrics",
    "ObjectInfo",
    "ObjectOptions",
    "Palm",
    "ParallelGrasp",
    "PlanResult",
    "PlanSummary",
    "PlanTimings",
    "PlannedObject",
    "Problem",
    "Proof",
    "Quaternion",
    "Readiness",
    "Termination",
    "Unit",
    "Vector3",
    "Verification",
    "VerificationBranch",
    "VerificationGrip",
    "VerificationPhase",
    "VerificationReason",
]
