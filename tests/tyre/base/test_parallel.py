"""Worker processes: prepared before their work, and silent when they are interrupted on their way."""

import os
import signal
import subprocess
import sys
from pathlib import Path

from tyre.base.parallel import worker_pool

ROOT = Path(__file__).parents[3]
INTERRUPTED = """
import os, signal
from concurrent.futures.process import BrokenProcessPool

if __name__ == "__mp_main__":  # a worker that is still importing
    os.kill(os.getpid(), signal.SIGINT)

if __name__ == "__main__":
    from tyre.base.parallel import worker_pool
    try:
        with worker_pool(2) as pool:
            print(pool.submit(abs, -1).result())
    except BrokenProcessPool:
        print("the workers went")
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
