"""The connection to Ray, which is set up before Ray is imported."""

import atexit
import os
import secrets
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from typing import TYPE_CHECKING, Any

from iowbc.errors import UsageError
from iowbc.processes import available_cores

if TYPE_CHECKING:
    from iowbc.pipeline.cluster.cluster import Cluster

SETTINGS = {"RAY_USAGE_STATS_ENABLED": "0", "RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO": "0", "RAY_worker_niceness": "0"}
"""Environment variables of Ray: no telemetry, accelerator variables unchanged, and workers with the priority of a local
run's."""
LOCAL = "local"
"""Address of a cluster of this machine alone, which listens on 127.0.0.1 and ends with this process."""
ALONE = {"RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER": "0", "RAY_AUTH_MODE": "token"}
"""Environment variables with which Ray listens on 127.0.0.1 only (by default, on Linux, on a reachable address) and
requires a token."""
OBJECT_STORE = 1 << 30
"""Object store of such a cluster [bytes]; the rest spills to disk."""
STARTS = 4
"""Attempts to start it: on a busy machine Ray's own processes give each other up after 15 to 30 s."""


@contextmanager
def connected(address: str, *, copy: bool) -> "Iterator[Cluster]":
    """A connection, and a local cluster, to the end of the block. Raises `UsageError`. address: `local`, `auto`,
    `host:port` or `ray://host:port`; copy: see `Cluster`."""
    for name, value in SETTINGS.items():
        os.environ.setdefault(name, value)
    if address == LOCAL:
        _start()
    else:
        _connect(address)
    from iowbc.pipeline.cluster.cluster import Cluster

    with closing(Cluster(copy=copy)) as cluster:
        yield cluster


def _start() -> None:
    """Start a cluster of this machine alone, and connect to it. Raises `UsageError`."""
    os.environ.update(ALONE)
    os.environ.setdefault("RAY_AUTH_TOKEN", secrets.token_hex(32))  # Ray reads the token once per process
    folder = tempfile.mkdtemp(prefix="iowbc-ray-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    settings = {"num_cpus": available_cores(), "object_store_memory": OBJECT_STORE, "include_dashboard": False}
    for _ in range(STARTS - 1):
        with suppress(UsageError):
            return _connect(LOCAL, **settings, _temp_dir=folder)
    return _connect(LOCAL, **settings, _temp_dir=folder)


def _connect(address: str, **settings: Any) -> None:
    import ray

    try:
        ray.init(address=address, log_to_driver=False, logging_level="ERROR", **settings)
    except Exception as error:  # Ray raises various types
        ray.shutdown()
        raise UsageError(
            f"--address {address}: {str(error).strip().splitlines()[0]}; valid: local (this machine alone), auto (the "
            "one that `ray start` began here), HOST:PORT, or ray://HOST:PORT"
        ) from error
