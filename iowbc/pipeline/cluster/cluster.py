"""The driver's side: a connection to Ray, on whose nodes stages run."""

import os
import secrets
import shutil
from collections.abc import Iterable, Iterator, Sequence
from contextlib import closing, contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from iowbc.errors import Interrupted, StageFailed, UsageError
from iowbc.pipeline.cluster import loopback
from iowbc.pipeline.cluster.folders import Folder, files_of, write_files
from iowbc.pipeline.cluster.identity import identity
from iowbc.pipeline.cluster.mailbox import Event, Mailbox
from iowbc.pipeline.cluster.remote import TOKEN, Order, StageOutcome, execute
from iowbc.pipeline.cluster.spread import NodeSpread
from iowbc.pipeline.stage import Job, Stage
from iowbc.pipeline.store.digests import folder_digest

TRIES = 5
"""Times that a stage is begun whose node or worker is lost, before it counts as failed."""
POLL = 0.2
"""Seconds between two looks at a task."""
ABORT_PATIENCE = 5.0
"""Seconds that Ray has to end a task that is aborted."""
SETTINGS = {
    "RAY_USAGE_STATS_ENABLED": "0",
    "RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO": "0",
    "RAY_worker_niceness": "0",
}
"""Environment of Ray: it sends nothing to its makers, leaves accelerators' variables as they are, and its workers have
the priority that those of a local run have."""
HEAD = "node:__internal_head__"
"""Resource that Ray gives to the head node alone."""


class Cluster:
    """A connection to Ray. Runs stages on its nodes; several threads may ask for one each."""

    def __init__(self, address: str, *, copy: bool) -> None:
        """address: `auto`, `host:port` or `ray://host:port`. copy: nodes keep to their own disks.

        Raises `UsageError` where Ray does not answer, or a node is not as this machine.
        """
        self.copy = copy
        self.aborted = False
        self._folders: dict[Path, Folder] = {}
        self._begun: dict[str, bool] = {}
        self._ray = _initialised(address)
        remote = self._ray.remote
        self._mailbox = remote(num_cpus=0, resources={HEAD: 0.001}, max_concurrency=1)(Mailbox).remote()
        self._execute = remote(max_retries=0, scheduling_strategy="SPREAD")(execute)
        self._require_alike()

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
        """Where it listens and how large it is, in a line."""
        address = self._ray.get_runtime_context().gcs_address
        return f"Ray at {address}: {self._nodes()}, {self.cores} cores"

    @property
    def load(self) -> str:
        """How much of it is in use, in a line."""
        free, whole = self._ray.available_resources(), self._ray.cluster_resources()
        store = whole.get("object_store_memory", 0.0)
        used = store - free.get("object_store_memory", store)
        cores = whole.get("CPU", 0.0)
        stages = list(self._begun.values())
        return (
            f"{self._nodes()}, {cores - free.get('CPU', 0.0):g} of {cores:g} cores, {used / 1e6:.0f} MB of objects; "
            f"stages: {sum(stages)} run, {len(stages) - sum(stages)} wait for cores"
        )

    def run(self, stage: Stage, job: Job) -> None:
        """Run a stage on a node, as `stage.run(job)` would here. A lost node costs what it had not told yet.

        Raises what the stage raises; RuntimeError with the node's traceback for what nobody foresaw.
        """
        token = secrets.token_hex(8)
        (job.work / TOKEN).write_text(token, encoding="utf-8")
        try:
            for _ in range(TRIES):
                outcome = self._tried(stage, job, token)
                if outcome is not None:
                    self._conclude(stage, job, outcome)
                    return
                job.report.say("its node or worker was lost; it goes on elsewhere")
                shutil.rmtree(job.out)
                job.out.mkdir()
            raise StageFailed(f"lost its node or worker {TRIES} times; is there too little memory for it?")
        finally:
            (job.work / TOKEN).unlink(missing_ok=True)

    def spread(self, paths: Iterable[Path]) -> NodeSpread:
        """Shares out pieces that read these folders of this machine."""
        folders = {path: self._folder(path) for path in paths}
        return NodeSpread(identity(), folders, lambda: False, lambda slow: None, copy=self.copy)

    def abort(self) -> None:
        """End all that runs, at once."""
        self.aborted = True

    def close(self) -> None:
        """End all tasks and the connection."""
        self._ray.shutdown()

    def _tried(self, stage: Stage, job: Job, token: str) -> StageOutcome | None:
        """One attempt; None where its node or worker was lost."""
        ray = self._ray
        order = Order(
            task=secrets.token_hex(8),
            identity=identity(),
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
            copy=self.copy,
        )
        scratch = (ray.put({name: content for name, content in files_of(job.work).items() if name != TOKEN}),)
        # One that only waits for its pieces must not keep them waiting.
        cores = 0 if stage.spreads(job.recipe) else order.workers
        task = self._execute.options(num_cpus=cores, name=stage.name).remote(order, scratch, self._mailbox)
        self._begun[order.task] = told = False
        try:
            while True:
                ready, _ = ray.wait([task], timeout=POLL)
                for event in ray.get(self._mailbox.collect.remote(order.task)):
                    self._begun[order.task] = True
                    _tell(job, event)
                if ready:
                    outcome: StageOutcome = ray.get(task)
                    return outcome
                if self.aborted:
                    raise KeyboardInterrupt
                if job.interrupted() and not self._begun[order.task]:
                    raise Interrupted("waited for a node")
                if job.interrupted() and not told:
                    told = True
                    ray.get(self._mailbox.stop.remote(order.task))
        except ray.exceptions.RayTaskError:
            raise
        except ray.exceptions.RayError:
            return None
        except BaseException:
            ray.cancel(task, force=True)
            ray.wait([task], timeout=ABORT_PATIENCE)
            raise
        finally:
            del self._begun[order.task]

    def _conclude(self, stage: Stage, job: Job, outcome: StageOutcome) -> None:
        if outcome.state == "mismatch":
            raise StageFailed(f"a node is not as this machine: {outcome.text}; install the same on both")
        if outcome.state == "stopped":
            raise Interrupted(outcome.text)
        if outcome.state == "failed":
            raise StageFailed(outcome.text)
        if outcome.state == "error":
            raise RuntimeError(f"on a node:\n{outcome.text}")
        if outcome.out is not None:
            write_files(job.out, outcome.out)

    def _folder(self, path: Path) -> Folder:
        """A folder that nodes can fetch; each goes into the object store once."""
        if path not in self._folders:
            files = self._ray.put(files_of(path))
            self._folders[path] = Folder(str(path.absolute()), folder_digest(path), (files,))
        return self._folders[path]

    def _nodes(self) -> str:
        count = len(self._alive())
        return f"{count} node{'s' if count != 1 else ''}"

    def _alive(self) -> list[dict[str, Any]]:
        return [node for node in self._ray.nodes() if node["Alive"]]

    def _require_alike(self) -> None:
        """Raises `UsageError` naming each node whose packages or code differ from this machine's.

        A node that dies while it is asked is as one that died before.
        """
        from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy

        ask = self._ray.remote(num_cpus=0, max_retries=0)(identity)
        nodes = self._alive()
        asked = [
            ask.options(scheduling_strategy=NodeAffinitySchedulingStrategy(node["NodeID"], soft=False)).remote()
            for node in nodes
        ]
        problems = []
        for node, reference in zip(nodes, asked, strict=True):
            try:
                different = identity().mismatch(self._ray.get(reference))
            except self._ray.exceptions.RayError as error:
                if node["NodeID"] not in [one["NodeID"] for one in self._alive()]:
                    continue
                different = f"cannot run iowbc: {str(error).strip().splitlines()[-1]}"
            if different:
                problems.append(f"node {node['NodeManagerAddress']}: {different}")
        if problems:
            self.close()
            raise UsageError("\n".join([*problems, "install the same version of iowbc on all nodes"]))


@contextmanager
def connected(address: str, *, copy: bool) -> Iterator[Cluster]:
    """A connection to the end of the block; so long lives a local cluster, too. Raises `UsageError`."""
    if shares := loopback.shares(address):
        with begun_here(shares, copy=copy) as cluster:
            yield cluster
        return
    _require_ray()
    with closing(Cluster(address, copy=copy)) as cluster:
        yield cluster


@contextmanager
def begun_here(cores: Sequence[int], *, copy: bool) -> Iterator[Cluster]:
    """A cluster of this machine alone to the end of the block, with the cores of each node. Raises `UsageError`."""
    _require_ray()
    os.environ.update(loopback.ALONE)
    for name, value in loopback.secured().items():
        os.environ.setdefault(name, value)  # Ray reads a token once in a process
    with loopback.nodes(cores) as address, closing(Cluster(address, copy=copy)) as cluster:
        yield cluster


def _require_ray() -> None:
    """Raises `UsageError` where it is not installed; else sets it up as iowbc wants it."""
    if find_spec("ray") is None:
        raise UsageError("Ray is needed, which this installation leaves out: `pip install 'iowbc[cluster]'`")
    for name, value in SETTINGS.items():
        os.environ.setdefault(name, value)


def _initialised(address: str) -> Any:
    import ray

    try:
        ray.init(address=address, log_to_driver=False, logging_level="ERROR")
    except Exception as error:  # Ray raises this and that
        raise UsageError(
            f"--address {address}: {str(error).strip().splitlines()[0]}; valid: local, or local:NODES (this machine "
            "alone), auto (the one that `ray start` began here), HOST:PORT, or ray://HOST:PORT"
        ) from error
    return ray


def _tell(job: Job, event: Event) -> None:
    """Pass on what a task has told."""
    kind, *rest = event
    if kind == "metrics":
        job.report.metrics(*rest)
    elif kind == "progress":
        job.report.progress(*rest)
    elif kind == "say":
        job.report.say(*rest)
    elif kind == "shown":
        job.report.files(job.work / rest[0])
    else:
        write_files(job.work, rest[0])
