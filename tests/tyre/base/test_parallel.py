"""Worker processes: they end with the process that started them, even where that is killed."""

import os
import signal
import subprocess
import sys
import time

import pytest

from tyre.base.parallel import worker_pool

PARENT = """
import sys
from tyre.base.parallel import worker_pool
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


def test_what_is_prepared_and_the_end_of_a_pool(tmp_path):
    before = os.getcwd()
    with worker_pool(1, prepare=os.chdir, arguments=(tmp_path,)) as pool:
        assert pool.submit(os.getcwd).result() == str(tmp_path)
        assert pool.submit(os.getenv, "OMP_NUM_THREADS").result() == "1"
    assert os.getcwd() == before
