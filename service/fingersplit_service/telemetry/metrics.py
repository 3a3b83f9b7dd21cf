"""What Prometheus can ask for."""

from collections.abc import Iterable, Mapping

from prometheus_client import CONTENT_TYPE_LATEST, CollectorRegistry, Counter, Gauge, Histogram, generate_latest

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

    def observe_result(self, stage_ms: Mapping[str, float], simulated: Iterable[bool]) -> None:
        """Count the time of a plan by stage [ms], and whether each simulated grasp held."""
        for stage, milliseconds in stage_ms.items():
            self.stages.labels(stage).observe(milliseconds / 1e3)
        for held in simulated:
            self.verifications.labels("held" if held else "failed").inc()

    def expose(
        self,
        *,
        jobs: Mapping[str, int],
        workers: Mapping[str, int],
        restarts: Mapping[str, int],
        waiting_requests: int,
        waiting_answers: int,
    ) -> bytes:
        """The text that Prometheus reads, with the numbers of now: jobs and workers by state, restarts by reason."""
        for gauge, counts in ((self._jobs, jobs), (self._workers, workers), (self._restarts, restarts)):
            for label, count in counts.items():
                gauge.labels(label).set(count)
        self._waiting.set(waiting_requests)
        self._waiting_answers.set(waiting_answers)
        return generate_latest(self.registry)
