"""The cache of arrays, with real processes that prepare, read, crash and evict at the same time."""

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from fingersplit.cache import ContentCache
from fingersplit.errors import CacheError

MEGABYTE = 1_000_000


def some_arrays(seed: int = 0) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(seed)
    record = np.zeros(3, np.dtype([("a", np.float64), ("b", np.int32, (2,))], align=True))
    record["b"] = rng.integers(9, size=(3, 2))
    return {
        "points": rng.normal(size=(1000, 3)),
        "faces": rng.integers(9, size=(70, 3), dtype=np.int32),
        "sideways": rng.normal(size=(4, 5)).T,
        "number": np.array(3.5),
        "nothing": np.empty((0, 3)),
        "flags": rng.random(7) < 0.5,
        "text": np.array("naïve"),
        "record": record,
    }


def never() -> dict[str, np.ndarray]:
    raise AssertionError("built although it is there")


def entry(cache: ContentCache, key: str) -> Path:
    return cache.folder / f"{key}.arrays"


def run(code: str, *arguments: object) -> "subprocess.Popen[str]":
    start = "import os, sys, time\nimport numpy as np\nfrom pathlib import Path\n"
    start += "from fingersplit.cache import ContentCache\n"
    command = [sys.executable, "-c", start + code, *map(str, arguments)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stdin=subprocess.PIPE, text=True)


@pytest.fixture
def cache(tmp_path) -> ContentCache:
    return ContentCache(tmp_path / "cache", 100 * MEGABYTE)


def test_arrays_come_back_as_they_were_read_only_and_mapped(cache):
    for fetched in cache.fetch("one", some_arrays), cache.fetch("one", never):
        assert list(fetched) == list(some_arrays())
        for name, array in some_arrays().items():
            assert (fetched[name].dtype, fetched[name].shape) == (array.dtype, array.shape), name
            np.testing.assert_array_equal(fetched[name], array)
            assert not fetched[name].flags.writeable
            assert fetched[name].flags.c_contiguous
            assert fetched[name].flags.aligned
        assert fetched["points"].base is not None
    assert [path.name for path in cache.folder.iterdir()] == ["one.arrays"]


def test_build_may_fetch_another_key(cache):
    outer = cache.fetch("outer", lambda: {"twice": 2 * cache.fetch("inner", some_arrays)["points"]})
    np.testing.assert_array_equal(outer["twice"], 2 * some_arrays()["points"])


def test_failed_build_leaves_nothing_and_the_next_one_runs(cache):
    def fail() -> dict[str, np.ndarray]:
        raise ValueError("no")

    with pytest.raises(ValueError, match="no"):
        cache.fetch("one", fail)
    assert list(cache.folder.iterdir()) == []
    assert cache.fetch("one", some_arrays)["number"] == 3.5


@pytest.mark.parametrize("key", ["", "../up", "a/b", ".hidden", "x" * 201, "a b"])
def test_keys_that_are_no_names_are_refused(cache, key):
    with pytest.raises(CacheError, match="must be 1 to 200"):
        cache.fetch(key, never)


def test_unusable_arguments_are_refused(cache, tmp_path):
    with pytest.raises(CacheError, match="limit_bytes is 0"):
        ContentCache(tmp_path, 0)
    (tmp_path / "file").touch()
    with pytest.raises(CacheError, match="cannot be made"):
        ContentCache(tmp_path / "file", 1)
    with pytest.raises(CacheError, match="'bad' holds Python objects"):
        cache.fetch("one", lambda: {"bad": np.array([object()])})


def test_every_damaged_byte_and_every_cut_is_found(cache):
    arrays = {"a": np.arange(5.0), "b": np.arange(3, dtype=np.int8)}
    cache.fetch("one", lambda: arrays)
    whole = entry(cache, "one").read_bytes()
    described = whole.index(b"}", whole.index(b'"length"')) + 1  # behind it up to the first array nothing is read
    rng, built = np.random.default_rng(0), 0

    def build() -> dict[str, np.ndarray]:
        nonlocal built
        built += 1
        return arrays

    places = [*range(0, described, 7), *range(len(whole) - 67, len(whole) - 27), *range(len(whole) - 3, len(whole))]
    damaged = [whole[:p] + bytes([whole[p] ^ (1 << rng.integers(8))]) + whole[p + 1 :] for p in places]
    damaged += [whole[:cut] for cut in range(0, len(whole), 11)] + [whole + b"\0", b"other" * 100]
    for number, data in enumerate(damaged, 1):
        entry(cache, "one").write_bytes(data)
        np.testing.assert_array_equal(cache.fetch("one", build)["a"], arrays["a"])
        assert built == number
    assert entry(cache, "one").read_bytes() == whole


def test_processes_that_ask_at_once_build_once(cache, tmp_path):
    code = """
def build():
    with open(sys.argv[3], "a") as log:
        log.write("built ")
    time.sleep(0.5)
    return {"data": np.arange(100_000.0)}

print("ready", flush=True)
sys.stdin.readline()
for key in ("one", "two"):
    print(ContentCache(Path(sys.argv[1]), int(sys.argv[2])).fetch(key, build)["data"].sum())
"""
    workers = [run(code, cache.folder, cache.limit_bytes, tmp_path / "log") for _ in range(4)]
    for worker in workers:
        assert worker.stdout.readline() == "ready\n"
    for worker in workers:
        worker.stdin.write("go\n")
        worker.stdin.flush()
    answers = [worker.communicate(timeout=60)[0].split() for worker in workers]
    assert answers == [[str(np.arange(100_000.0).sum())] * 2] * 4
    assert (tmp_path / "log").read_text().split() == ["built"] * 2
    assert sorted(path.name for path in cache.folder.iterdir()) == ["one.arrays", "two.arrays"]


def test_threads_that_ask_at_once_build_once(cache):
    built, fetched = [], []

    def build() -> dict[str, np.ndarray]:
        built.append(1)
        time.sleep(0.05)
        return some_arrays()

    threads = [threading.Thread(target=lambda: fetched.append(cache.fetch("one", build))) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert (len(built), len(fetched)) == (1, 8)


def test_builder_that_is_killed_holds_nobody_up(cache):
    code = """
def build():
    print("building", flush=True)
    time.sleep(60)

ContentCache(Path(sys.argv[1]), 1_000_000).fetch("one", build)
"""
    worker = run(code, cache.folder)
    assert worker.stdout.readline() == "building\n"
    worker.send_signal(signal.SIGKILL)
    worker.communicate()
    assert cache.fetch("one", some_arrays)["number"] == 3.5
    assert [path.name for path in cache.folder.iterdir()] == ["one.arrays"]


def megabyte(number: int) -> dict[str, np.ndarray]:
    return {"data": np.full(MEGABYTE // 8, float(number))}


def fetch_numbers(cache: ContentCache, *numbers: int) -> None:
    for number in numbers:
        cache.fetch(str(number), lambda number=number: megabyte(number))
        past = time.time() - 100 + number  # so that the order of use shows on clocks of any grain
        os.utime(entry(cache, str(number)), (past, past))


def test_least_recently_used_go_when_there_is_too_much(tmp_path):
    cache = ContentCache(tmp_path, 3 * MEGABYTE + MEGABYTE // 2)
    fetch_numbers(cache, 1, 2, 3)
    cache.fetch("1", never)
    cache.fetch("4", lambda: megabyte(4))
    assert sorted(path.stem for path in tmp_path.iterdir()) == ["1", "3", "4"]


def test_what_a_crashed_writer_left_goes_too(tmp_path):
    cache = ContentCache(tmp_path, 2 * MEGABYTE)
    (tmp_path / "old.partial").write_bytes(bytes(MEGABYTE))
    os.utime(tmp_path / "old.partial", (0, 0))
    fetch_numbers(cache, 1)
    cache.fetch("1", never)
    cache.fetch("2", lambda: {"data": np.zeros(10)})
    assert sorted(path.name for path in tmp_path.iterdir()) == ["1.arrays", "2.arrays"]


def test_what_is_read_by_anyone_stays(tmp_path):
    cache = ContentCache(tmp_path, 2 * MEGABYTE + MEGABYTE // 2)
    fetch_numbers(cache, 1, 2)
    code = """
data = ContentCache(Path(sys.argv[1]), 1).fetch("1", None)["data"]
os.utime(Path(sys.argv[1]) / "1.arrays", (0, 0))
print("reading", flush=True)
sys.stdin.readline()
print(data.sum())
"""
    reader = run(code, tmp_path)
    assert reader.stdout.readline() == "reading\n"
    mine = cache.fetch("2", never)["data"][5:]  # a view keeps the mapping, and the lock, too
    os.utime(entry(cache, "2"), (1, 1))
    cache.fetch("3", lambda: megabyte(3))
    assert sorted(path.stem for path in tmp_path.iterdir()) == ["1", "2", "3"]
    assert reader.communicate("stop\n", timeout=60)[0].split() == [str(float(MEGABYTE // 8))]
    cache.fetch("4", lambda: megabyte(4))
    assert sorted(path.stem for path in tmp_path.iterdir()) == ["2", "4"]
    assert mine.sum() == 2.0 * (MEGABYTE // 8 - 5)


def test_full_disk_costs_speed_only(cache):
    code = """
import resource
resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))
cache = ContentCache(Path(sys.argv[1]), 1_000_000)
for _ in range(2):
    data = cache.fetch("one", lambda: {"data": np.arange(100_000.0)})["data"]
    print(data.sum(), data.flags.writeable)
"""
    worker = run(code, cache.folder)
    answer = worker.communicate(timeout=60)[0].splitlines()
    assert answer == [f"{np.arange(100_000.0).sum()} False"] * 2
    assert list(cache.folder.iterdir()) == []


def test_folder_that_vanished_costs_speed_only(cache):
    cache.folder.rmdir()
    assert cache.fetch("one", some_arrays)["number"] == 3.5


def test_many_processes_on_a_tight_cache_always_read_whole_entries(tmp_path):
    code = """
cache = ContentCache(Path(sys.argv[1]), 300_000)
rng = np.random.default_rng(int(sys.argv[2]))
for _ in range(150):
    n = int(rng.integers(12))
    data = cache.fetch(str(n), lambda: {"data": np.full(8_000, float(n))})["data"]
    assert (data == n).all() and data.size == 8_000
"""
    workers = [run(code, tmp_path, seed) for seed in range(4)]
    for worker in workers:
        worker.communicate(timeout=120)
    assert [worker.returncode for worker in workers] == [0] * 4
    assert sum(path.stat().st_size for path in tmp_path.iterdir()) <= 300_000 + 4 * 65_000


def test_one_array_under_two_names_is_kept_once(tmp_path):
    cache, array = ContentCache(tmp_path, 10**9), np.arange(100_000.0)
    arrays = cache.fetch("twice", lambda: {"a": array, "b": array, "c": array[:10].copy()})
    assert arrays["a"] is arrays["b"]
    np.testing.assert_array_equal(arrays["b"], np.arange(100_000.0))
    np.testing.assert_array_equal(arrays["c"], np.arange(10.0))
    assert sum(path.stat().st_size for path in tmp_path.iterdir()) < 1.1 * array.nbytes
