"""The driver's side: a connection to Ray, on whose nodes stages run."""

import atexit
import os
import secrets
import shutil
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import closing, contextmanager, suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from iowbc.errors import Interrupted, IowbcError, StageFailed, UsageError
from iowbc.pipeline.cluster.folders import Files, SharedFolder, files_of, write_files
from iowbc.pipeline.cluster.spread import POLL, TRIES, NodeSpread
from iowbc.pipeline.cluster.stage_task import TOKEN, Event, Mailbox, Order, execute
from iowbc.pipeline.machine import identity
from iowbc.pipeline.stage import Job, Stage
from iowbc.pipeline.store.digests import folder_digest
from iowbc.processes import available_cores

ABORT_PATIENCE = 5.0
"""Seconds that Ray has to end a task that is aborted."""
SETTINGS = {
    "RAY_USAGE_STATS_ENABLED": "0",
    "RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO": "0",
    "RAY_worker_niceness": "0",
}
"""Environment of Ray: it sends nothing to its makers, leaves accelerators' variables as they are, and its workers have
the priority that those of a local run have."""
LOCAL = "local"
"""Address of a cluster of this machine alone, which listens on 127.0.0.1 and ends with this process."""
ALONE = {"RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER": "0", "RAY_AUTH_MODE": "token"}
"""Environment in which Ray listens on 127.0.0.1 (on Linux it otherwise takes an address that others reach), to those
alone who know a token."""
OBJECT_STORE = 1 << 30
"""Bytes of memory for objects in such a cluster; what is more goes to disk."""
STARTS = 4
"""Attempts to start it: on a busy machine Ray's own processes give each other up after 15 to 30 s."""
HEAD = "node:__internal_head__"
"""Resource that Ray gives to the head node alone."""


class Lost(Exception):
    """The node or worker of a stage is gone."""


class Cluster:
    """A connection to Ray. Runs stages on its nodes; several threads may ask for one each."""

    def __init__(self, address: str, *, copy: bool) -> None:
        """address: `local`, `auto`, `host:port` or `ray://host:port`. copy: nodes keep to their own disks.

        Raises `UsageError` where Ray does not answer.
        """
        self.copy = copy
        self.aborted = False
        self._folders: dict[Path, SharedFolder] = {}
        self._ray = _initialised(address)
        remote = self._ray.remote
        self._mailbox = remote(num_cpus=0, resources={HEAD: 0.001}, max_concurrency=1)(Mailbox).remote()
        self._execute = remote(max_retries=0, scheduling_strategy="SPREAD")(execute)

    @property
    def cores(self) -> int:
        """Cores of all nodes together."""
        return int(self._ray.cluster_resources().get("CPU", 1))

    @property
    def largest(self) -> int:
        """Cores of the largest node."""
        return max((int(node["Resources"].get("CPU", 0)) for node in self._alive()), default=1)

    @property
    def text(self) -> str:
        """Address and size in a line."""
        count = len(self._alive())
        nodes = f"{count} node{'s' if count != 1 else ''}"
        return f"Ray at {self._ray.get_runtime_context().gcs_address}: {nodes}, {self.cores} cores"

    def run(self, stage: Stage, job: Job) -> None:
        """Run a stage on a node, as `stage.run(job)` would here. A lost node costs what it had not reported yet.

        Raises what the stage raises; RuntimeError with the node's traceback for an unexpected error.
        """
        token = secrets.token_hex(8)
        (job.work / TOKEN).write_text(token, encoding="utf-8")
        try:
            for _ in range(TRIES):
                try:
                    write_files(job.out, self._attempt(stage, job, token) or {})
                    return
                except Lost:
                    job.report.say("its node or worker was lost; it goes on elsewhere")
                    shutil.rmtree(job.out)
                    job.out.mkdir()
            raise StageFailed(f"lost its node or worker {TRIES} times; is there too little memory for it?")
        finally:
            (job.work / TOKEN).unlink(missing_ok=True)

    def spread(self, paths: Iterable[Path]) -> NodeSpread:
        """The nodes for calls that read these folders of this machine."""
        return NodeSpread({path: self._folder(path) for path in paths}, lambda: False, lambda text: None)

    def abort(self) -> None:
        """End all that runs, at once."""
        self.aborted = True

    def close(self) -> None:
        """End all tasks and the connection."""
        self._ray.shutdown()

    def _attempt(self, stage: Stage, job: Job, token: str) -> Files | None:
        """One attempt; the stage's output, or None where the node wrote it here. Raises `Lost`."""
        ray = self._ray
        order = Order(
            task=secrets.token_hex(8),
            run=stage.run,
            recipe=job.recipe,
            key=job.key,
            robot=self._folder(job.robot),
            inputs={name: self._folder(path) for name, path in job.inputs.items()},
            predecessor=None if job.predecessor is None else self._folder(job.predecessor),
            out=str(job.out.absolute()),
            work=str(job.work.absolute()),
            token=token,
            workers=min(job.workers, self.largest),
        )
        scratch = (ray.put({name: content for name, content in files_of(job.work).items() if name != TOKEN}),)
        # One that only waits for its pieces must not keep them waiting.
        cores = 0 if stage.spreads(job.recipe) else order.workers
        task = self._execute.options(num_cpus=cores, name=stage.name).remote(order, scratch, self._mailbox)
        begun = stopping = False
        try:
            while True:
                ready, _ = ray.wait([task], timeout=POLL)
                for event in ray.get(self._mailbox.collect.remote(order.task)):
                    begun = True
                    _pass_on(job, event)
                if ready:
                    output: Files | None = ray.get(task)
                    return output
                if self.aborted:
                    raise KeyboardInterrupt
                if job.interrupted() and not begun:
                    raise Interrupted("waited for a node")
                if job.interrupted() and not stopping:
                    stopping = True
                    ray.get(self._mailbox.stop.remote(order.task))
        except ray.exceptions.RayError as error:
            cause = getattr(error, "cause", None)
            if isinstance(cause, IowbcError):
                raise cause from None
            if isinstance(error, ray.exceptions.RayTaskError) and not isinstance(cause, ray.exceptions.RayError):
                raise RuntimeError(f"on a node:\n{error}") from None
            raise Lost from error
        except BaseException:
            ray.cancel(task, force=True)
            ray.wait([task], timeout=ABORT_PATIENCE)
            raise

    def _folder(self, path: Path) -> SharedFolder:
        """A folder that nodes can fetch; each goes into the object store once."""
        if path not in self._folders:
            files = (self._ray.put(files_of(path)),)
            self._folders[path] = SharedFolder(
                str(path.absolute()), folder_digest(path), files, identity(), copy=self.copy
            )
        return self._folders[path]

    def _alive(self) -> list[dict[str, Any]]:
        return [node for node in self._ray.nodes() if node["Alive"]]


@contextmanager
def connected(address: str, *, copy: bool) -> Iterator[Cluster]:
    """A connection to the end of the block; so long lives a local cluster, too. Raises `UsageError`."""
    if find_spec("ray") is None:
        raise UsageError("Ray is needed, which this installation leaves out: `pip install 'iowbc[cluster]'`")
    for name, value in SETTINGS.items():
        os.environ.setdefault(name, value)
    with closing(Cluster(address, copy=copy)) as cluster:
        yield cluster


def _initialised(address: str) -> Any:
    """Ray, connected. Raises `UsageError`."""
    if address != LOCAL:
        return _connected(address)
    os.environ.update(ALONE)
    os.environ.setdefault("RAY_AUTH_TOKEN", secrets.token_hex(32))  # Ray reads a token once in a process
    settings = {"num_cpus": available_cores(), "object_store_memory": OBJECT_STORE, "include_dashboard": False}
    folder = tempfile.mkdtemp(prefix="iowbc-ray-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    for _ in range(STARTS - 1):
        with suppress(UsageError):
            return _connected(address, **settings, _temp_dir=folder)
    return _connected(address, **settings, _temp_dir=folder)


def _connected(address: str, **settings: Any) -> Any:
    import ray

    try:
        ray.init(address=address, log_to_driver=False, logging_level="ERROR", **settings)
    except Exception as error:  # Ray raises this and that
        ray.shutdown()
        raise UsageError(
            f"--address {address}: {str(error).strip().splitlines()[0]}; valid: local (this machine alone), auto (the "
            "one that `ray start` began here), HOST:PORT, or ray://HOST:PORT"
        ) from error
    return ray


def _pass_on(job: Job, event: Event) -> None:
    """Pass on what a task has reported."""
    kind, *rest = event
    if kind == "files":
        write_files(job.work, rest[0])
    elif kind == "shown":
        job.report.files(job.work / rest[0])
    else:
        getattr(job.report, kind)(*rest)
