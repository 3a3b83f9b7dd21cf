"""One recording as a file: opened, written, closed, and nothing of it left in the process."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from fingersplit.extras import extra

with extra("recording"):
    import rerun as rr
    import rerun.blueprint as rrb
    import rerun_bindings

__all__ = ["APPLICATION", "Layout", "recording_file"]

APPLICATION = "fingersplit"


class Layout(rrb.Blueprint):
    """A blueprint that can be let go of.

    rerun keeps the threads of a recording until it is told to look for orphans, and a blueprint that was handed over
    never becomes one: its memory and its stream hold each other (rerun-sdk 0.41). Each recording would leave four
    threads and 5 MB behind, and a worker that writes many would die of it.
    """

    def __init__(self, *parts: Any, **options: Any) -> None:
        super().__init__(*parts, **options)
        self._streams = list[rr.RecordingStream]()

    def _log_to_stream(self, stream: rr.RecordingStream) -> None:
        self._streams.append(stream)
        super()._log_to_stream(stream)

    def let_go(self) -> None:
        """Close what it was written to; its memory is free once orphans are looked for."""
        while self._streams:
            self._streams.pop().disconnect()


@contextmanager
def recording_file(path: Path, layout: Layout) -> Iterator[rr.RecordingStream]:
    """A recording that is written to a file; complete when the context ends.

    Args:
        path: The .rrd file to write.
        layout: How it opens.
    """
    rerun_bindings.flush_and_cleanup_orphaned_recordings()  # those before; this one is held by whoever writes it
    # Every message is its own chunk: rerun compresses one in the background while the next is made.
    stream = rr.RecordingStream(APPLICATION, batcher_config=rr.ChunkBatcherConfig(flush_num_rows=1))
    stream.save(path, default_blueprint=layout)
    layout.let_go()
    try:
        yield stream
        stream.flush()
    finally:
        stream.disconnect()
