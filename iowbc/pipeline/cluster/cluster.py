"""The driver's side: stages that run on the nodes of the cluster to which this process is connected."""

import secrets
import shutil
from functools import partial
from pathlib import Path
from typing import Any

import ray

from iowbc.errors import Interrupted, IowbcError, StageFailed
from iowbc.files import folder_digest
from iowbc.pipeline.cluster.folders import Files, SharedFolder, files_of, write_files
from iowbc.pipeline.cluster.spread import POLL, TRIES, raised
from iowbc.pipeline.cluster.stage_task import Event, Mailbox, execute, marker
from iowbc.pipeline.code import identity
from iowbc.pipeline.stage import Job, Stage

ABORT_PATIENCE = 5.0
"""Seconds that Ray has to end a task that is aborted."""
HEAD = "node:__internal_head__"
"""Ray resource that only the head node has."""


class Cluster:
    """The nodes of a Ray cluster. Several threads may run a stage each."""

    def __init__(self, *, copy: bool) -> None:
        """copy: nodes use local copies of folders even where they see the driver's disk."""
        self.copy = copy
        self.aborted = False
        self._folders: dict[Path, SharedFolder] = {}
        self._mailbox = ray.remote(num_cpus=0, resources={HEAD: 0.001}, max_concurrency=1)(Mailbox).remote()
        self._execute = ray.remote(max_retries=0, scheduling_strategy="SPREAD")(execute)

    @property
    def cores(self) -> int:
        """Cores of all nodes together."""
        return int(ray.cluster_resources().get("CPU", 1))

    @property
    def largest(self) -> int:
        """Cores of the largest node."""
        return max((int(node["Resources"].get("CPU", 0)) for node in self._alive()), default=1)

    @property
    def text(self) -> str:
        """Address and size in a line."""
        count = len(self._alive())
        nodes = f"{count} node{'s' if count != 1 else ''}"
        return f"Ray at {ray.get_runtime_context().gcs_address}: {nodes}, {self.cores} cores"

    def run(self, stage: Stage, job: Job) -> None:
        """Run a stage on a node as `stage.run(job)` would here; if it is lost, again from its last reported checkpoint.
        Raises what the stage raises; RuntimeError with the node's traceback for an unexpected error."""
        for _ in range(TRIES):
            if (output := self._attempt(stage, job)) is not None:
                return write_files(job.out, output)
            job.report.say("its node or worker was lost; it goes on elsewhere")
            shutil.rmtree(job.out)
            job.out.mkdir()
        raise StageFailed(f"lost its node or worker {TRIES} times; is there too little memory for it?")

    def abort(self) -> None:
        self.aborted = True

    def close(self) -> None:
        ray.shutdown()

    def _attempt(self, stage: Stage, job: Job) -> Files | None:
        """One attempt: the output that the node did not write here itself; None where node or worker is lost."""
        task, workers = secrets.token_hex(8), min(job.workers, self.largest)
        # A stage that only waits for its pieces reserves no core, so that they can run.
        cores = 0 if stage.spreads(job.recipe) else workers
        scratch = (ray.put(files_of(job.work)),)
        marker(job.work, task).touch()
        running = self._execute.options(num_cpus=cores, name=stage.name).remote(
            stage.run,
            partial(Job, recipe=job.recipe, key=job.key, workers=workers),
            robot=self.folder(job.robot),
            inputs={read: self.folder(path) for read, path in job.inputs.items()},
            predecessor=None if job.predecessor is None else self.folder(job.predecessor),
            out=job.out.absolute(),
            work=job.work.absolute(),
            scratch=scratch,
            task=task,
            mailbox=self._mailbox,
        )
        begun = False
        try:
            while True:
                ready, _ = ray.wait([running], timeout=POLL)
                for event in ray.get(self._mailbox.collect.remote(task)):
                    begun = True
                    _pass_on(job, event)
                if ready:
                    output: Files = ray.get(running)
                    return output
                if self.aborted:
                    raise KeyboardInterrupt
                if job.interrupted():
                    if not begun:
                        raise Interrupted("waited for a node")
                    ray.get(self._mailbox.stop.remote(task))
        except ray.exceptions.RayError as error:
            if (cause := raised(error)) is None:
                return None
            if isinstance(cause, IowbcError):
                raise cause from None
            raise RuntimeError(f"on a node:\n{error}") from None
        except BaseException:
            ray.cancel(running, force=True)
            ray.wait([running], timeout=ABORT_PATIENCE)
            raise
        finally:
            marker(job.work, task).unlink(missing_ok=True)

    def folder(self, path: Path) -> SharedFolder:
        """A folder that nodes can fetch; each goes into the object store once."""
        if path not in self._folders:
            files = (ray.put(files_of(path)),)
            self._folders[path] = SharedFolder(
                str(path.absolute()), folder_digest(path), files, identity(), copy=self.copy
            )
        return self._folders[path]

    def _alive(self) -> list[dict[str, Any]]:
        return [node for node in ray.nodes() if node["Alive"]]


def _pass_on(job: Job, event: Event) -> None:
    kind, *rest = event
    if kind == "files":
        write_files(job.work, rest[0])
    else:
        getattr(job.report, kind)(*rest)
