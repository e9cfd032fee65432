"""A sweep on a Slurm cluster: dask workers as jobs, this script as client.

Not tested on a cluster: adapt queue, account and prologue. Needs ``pip install 'velotyre[sweeps,fast]' dask-jobqueue``
on the login node and, by the same path, on the nodes; model and tyre files on a file system that all see. Run it where
it may stay for hours, itself as a small job if the login node does not allow that:

    python sweep_on_slurm.py sweep.toml result.zarr 100
"""

import subprocess
import sys

from dask_jobqueue import SLURMCluster

sweep, result, jobs = sys.argv[1], sys.argv[2], int(sys.argv[3])
cluster = SLURMCluster(
    queue="cpu",
    account="my_account",
    cores=8,  # of one job
    processes=8,  # one thread each: named modes and critical speeds hold the interpreter
    memory="8GB",
    walltime="04:00:00",
    job_script_prologue=["source ~/velotyre/bin/activate", "export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1"],
    worker_extra_args=["--lifetime", "3h50m", "--lifetime-stagger", "5m"],  # leave before Slurm kills
)
cluster.adapt(minimum_jobs=1, maximum_jobs=jobs)
client = cluster.get_client()
client.wait_for_workers(1)
command = ["velotyre", "sweep", sweep, "--out", result, "--scheduler", cluster.scheduler_address]
while subprocess.run(command, check=False).returncode == 2 and input("again? (y/n) ") == "y":
    client.wait_for_workers(1)  # what was finished is kept
