"""A sweep on Kubernetes through the dask operator.

Not tested on a cluster. Once, by whoever runs it:

    helm install --repo https://helm.dask.org --create-namespace -n dask-operator \\
        --generate-name dask-kubernetes-operator

Then, with ``pip install 'velotyre[sweeps,fast]' dask-kubernetes`` in the versions of the image:

    python sweep_on_kubernetes.py sweep.toml result.zarr registry.example.org/velotyre-worker:1 100
"""

import subprocess
import sys

from dask_kubernetes.operator import KubeCluster

sweep, result, image, workers = sys.argv[1], sys.argv[2], sys.argv[3], int(sys.argv[4])
with KubeCluster(
    name="velotyre",
    image=image,
    n_workers=workers,
    worker_command=["dask", "worker", "--nthreads", "1"],
    resources={"requests": {"cpu": "1", "memory": "1Gi"}, "limits": {"cpu": "1", "memory": "2Gi"}},
    env={"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
) as cluster:
    cluster.get_client().wait_for_workers(1)
    subprocess.run(["velotyre", "sweep", sweep, "--out", result, "--scheduler", cluster.scheduler_address], check=True)
