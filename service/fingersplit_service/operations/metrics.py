"""What Prometheus can ask for."""

from typing import TYPE_CHECKING

from prometheus_client import CONTENT_TYPE_LATEST, CollectorRegistry, Counter, Gauge, Histogram, generate_latest

if TYPE_CHECKING:
    from fingersplit_service.jobs.notifier import Notifier
    from fingersplit_service.jobs.outcome import JobOutcome
    from fingersplit_service.jobs.worker_pool import WorkerPool

__all__ = ["METRICS_TYPE", "Metrics"]

METRICS_TYPE = CONTENT_TYPE_LATEST
_BUCKETS = (0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0, 60.0, 300.0)


class Metrics:
    """Counters and histograms of one service.

    Attributes:
        requests: Answered requests by method, route and status.
        answered: Time of requests by route [s].
        waited: Time that jobs waited for a worker [s].
        ran: Time that jobs spent with a worker [s].
        stages: Time of the planner's stages [s].
        ended: Jobs by final state.
        verifications: Simulated grasps by outcome.
        answers_waited: Time that requests waited for a worker [s].
    """

    def __init__(self) -> None:
        self.registry = CollectorRegistry()
        registry = self.registry
        self.requests = Counter(
            "fingersplit_requests", "Answered requests.", ["method", "route", "status"], registry=registry
        )
        self.answered = Histogram(
            "fingersplit_request_seconds", "Time of requests.", ["route"], buckets=_BUCKETS, registry=registry
        )
        self.waited = Histogram(
            "fingersplit_job_wait_seconds", "Time that jobs waited for a worker.", buckets=_BUCKETS, registry=registry
        )
        self.ran = Histogram(
            "fingersplit_job_run_seconds", "Time that jobs spent with a worker.", buckets=_BUCKETS, registry=registry
        )
        self.stages = Histogram(
            "fingersplit_stage_seconds", "Time of the planner's stages.", ["stage"], buckets=_BUCKETS, registry=registry
        )
        self.ended = Counter("fingersplit_jobs_ended", "Jobs by final state.", ["state"], registry=registry)
        self.verifications = Counter(
            "fingersplit_verifications", "Simulated grasps by outcome.", ["outcome"], registry=registry
        )
        self.answers_waited = Histogram(
            "fingersplit_answer_wait_seconds",
            "Time that requests waited for a worker.",
            buckets=_BUCKETS,
            registry=registry,
        )
        self._waiting = Gauge("fingersplit_waiting_requests", "Requests that wait for a job.", registry=registry)
        self._waiting_answers = Gauge(
            "fingersplit_waiting_answers", "Requests that wait for a worker.", registry=registry
        )
        self._jobs = Gauge("fingersplit_jobs", "Jobs that have not ended.", ["state"], registry=registry)
        self._workers = Gauge("fingersplit_workers", "Worker processes.", ["state"], registry=registry)
        self._restarts = Gauge(
            "fingersplit_worker_restarts",
            "Worker processes that were replaced, by reason.",
            ["reason"],
            registry=registry,
        )

    def observe_result(self, outcome: "JobOutcome") -> None:
        """Count what a job's result tells: its stages and its simulations."""
        for stage, milliseconds in outcome.stage_ms.items():
            self.stages.labels(stage).observe(milliseconds / 1e3)
        for held in outcome.simulated:
            self.verifications.labels("held" if held else "failed").inc()

    def expose(self, pool: "WorkerPool", notifier: "Notifier", jobs: dict[str, int]) -> bytes:
        """The text that Prometheus reads; the numbers of jobs and workers are those of now."""
        for state, count in jobs.items():
            self._jobs.labels(state).set(count)
        self._waiting.set(notifier.waiting)
        self._waiting_answers.set(pool.waiting_answers)
        self._workers.labels("warm").set(pool.warm_workers)
        self._workers.labels("spare").set(pool.spare_workers)
        self._workers.labels("busy").set(pool.busy_workers)
        for reason, count in pool.restarts.items():
            self._restarts.labels(reason).set(count)
        return generate_latest(self.registry)
