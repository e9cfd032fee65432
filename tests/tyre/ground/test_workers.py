"""Worker processes: prepared, silent when interrupted on their way, gone when the process that started them is."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tyre.ground import InputError, worker_pool

ROOT = Path(__file__).parents[3]
INTERRUPTED = """
import os, signal
from tyre.ground import InputError

if __name__ == "__mp_main__":  # a worker that is still importing
    os.kill(os.getpid(), signal.SIGINT)

if __name__ == "__main__":
    from tyre.ground import worker_pool
    try:
        with worker_pool(2) as pool:
            print(pool.submit(abs, -1).result())
    except InputError as error:
        print("the workers went" if "a worker process died" in str(error) else error)
"""


def test_a_worker_is_prepared_and_hears_an_interrupt_once_it_is_there():
    with worker_pool(1, prepare=sys.setrecursionlimit, arguments=(1234,)) as pool:
        assert pool.submit(sys.getrecursionlimit).result() == 1234
        assert pool.submit(os.getenv, "OMP_NUM_THREADS").result() == "1"
        assert signal.SIGINT not in pool.submit(signal.pthread_sigmask, signal.SIG_BLOCK, ()).result()
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, ())  # and this process hears it as before


def test_a_worker_that_is_interrupted_while_it_starts_goes_without_a_traceback(tmp_path):
    (script := tmp_path / "script.py").write_text(INTERRUPTED)
    done = subprocess.run(
        [sys.executable, script], cwd=ROOT, env={**os.environ, "PYTHONPATH": str(ROOT)}, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert (done.stdout, done.stderr) == ("the workers went\n", "")


def test_a_worker_that_is_killed_ends_in_one_line():
    with (
        pytest.raises(InputError, match=r"^a worker process died \(killed, or out of memory\)$"),
        worker_pool(1) as pool,
    ):
        pool.submit(os._exit, 9).result()


PARENT = """
import sys
from tyre.ground import worker_pool
if __name__ == "__main__":
    import os
    with worker_pool(2) as pool:
        print(*{future.result() for future in [pool.submit(os.getpid) for _ in range(8)]}, flush=True)
        work = [pool.submit(%s, %s) for _ in range(2)]
        sys.stdin.read()  # wait for the kill
"""


def alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    with open(f"/proc/{process}/stat", encoding="utf-8") as stat:
        return stat.read().rpartition(")")[2].split()[0] != "Z"


@pytest.mark.skipif(not os.path.exists("/proc/self/stat"), reason="needs Linux")
@pytest.mark.parametrize(("busy", "argument"), [("os.getpgid", "0"), ("__import__('time').sleep", "600")])
def test_workers_end_when_their_parent_is_killed(tmp_path, busy, argument):
    script = tmp_path / "parent.py"
    script.write_text(PARENT % (busy, argument))
    with subprocess.Popen([sys.executable, script], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as parent:
        workers = [int(word) for word in parent.stdout.readline().split()]
        assert workers
        assert all(alive(worker) for worker in workers)
        parent.send_signal(signal.SIGKILL)
    for _ in range(600):  # a minute, should the machine be busy
        if not any(alive(worker) for worker in workers):
            break
        time.sleep(0.1)
    left = [worker for worker in workers if alive(worker)]
    for worker in left:
        os.kill(worker, signal.SIGKILL)
    assert left == []
