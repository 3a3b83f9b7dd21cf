"""OpenTelemetry traces, when a collector is configured."""

from collections.abc import Iterator
from contextlib import contextmanager

from opentelemetry import trace

__all__ = ["span", "tracing"]

_tracer = trace.get_tracer("fingersplit")  # does nothing until a provider is set


@contextmanager
def span(name: str, **attributes: str) -> Iterator[None]:
    """A span of the trace, with attributes."""
    with _tracer.start_as_current_span(name, attributes=attributes):
        yield


@contextmanager
def tracing(endpoint: str | None) -> Iterator[None]:
    """Send the spans made inside to a collector that speaks OTLP over HTTP."""
    if endpoint is None:
        yield
        return
    # Imported here, because hardly anybody configures it and it takes a while.
    from opentelemetry.exporter.otlp.proto.http.trace_exporter import OTLPSpanExporter
    from opentelemetry.sdk.resources import Resource
    from opentelemetry.sdk.trace import TracerProvider
    from opentelemetry.sdk.trace.export import BatchSpanProcessor

    provider = TracerProvider(resource=Resource.create({"service.name": "fingersplit"}))
    provider.add_span_processor(BatchSpanProcessor(OTLPSpanExporter(endpoint)))
    trace.set_tracer_provider(provider)
    try:
        yield
    finally:
        provider.shutdown()
