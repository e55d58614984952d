"""Runs the stages of a recipe: uses cached artifacts, makes the others, and keeps checkpoints of interrupted ones."""

import contextlib
import time
import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from socket import gethostname

from iowbc.errors import Damaged, Interrupted, IowbcError, PipelineFailed
from iowbc.full_disk import is_disk_full, what_is_full
from iowbc.pipeline.code import changed_code, versions
from iowbc.pipeline.console.display import Display, StageView
from iowbc.pipeline.console.wording import short
from iowbc.pipeline.planner import Planner
from iowbc.pipeline.stage import Job, Stage
from iowbc.pipeline.stage_plan import StagePlan
from iowbc.pipeline.store.artifact import Artifact, describe, read_artifact, seal
from iowbc.pipeline.store.last_used import remember
from iowbc.pipeline.store.locks import key_lock
from iowbc.pipeline.store.workspace import Workspace
from iowbc.pipeline.tracking.tracker import Tracker
from iowbc.processes import available_cores
from iowbc.recipe.reading.document import as_yaml


@dataclass
class StageReport:
    """The `Report` that a stage receives: to the console, to the tracking journal, and to its record on disk."""

    view: StageView
    display: Display
    tracker: Tracker | None
    workspace: Workspace

    def metrics(self, values: Mapping[str, float], step: int) -> None:
        """Record named values at a step; the first name is the stage's main metric."""
        if not values:
            return
        main = self.view.record.metric
        name = main if main in values else next(iter(values))
        self.view.measured(name, step, float(values[name]))
        if self.tracker is not None:
            self.tracker.metrics(self.view.name, values, step)
        self.display.moved(self.view)

    def progress(self, done: float, total: float, note: str = "") -> None:
        self.view.progress(done, total, note)
        self.workspace.progress(done, total, note)
        self.display.moved(self.view)

    def say(self, text: str) -> None:
        prefix = f"{self.view.name}: "
        self.display.say(prefix + text.removeprefix(prefix))


def run_here(stage: Stage, job: Job) -> None:
    """Run a stage in this process."""
    stage.run(job)


@dataclass(eq=False)
class Runner:
    """One run of a recipe."""

    planner: Planner
    display: Display
    tracker: Tracker | None
    interrupted: Callable[[], bool]
    command: Callable[[], str] = lambda: ""
    """Command that resumes this run after the stages in `made`; recorded with each stage while it runs."""
    execute: Callable[[Stage, Job], None] = run_here
    """Runs a stage: here, or on a cluster with the same result."""
    workers: int = 0
    """Worker processes of a stage if neither options nor recipe set them; 0: one per core."""
    artifacts: dict[str, Artifact] = field(default_factory=dict)
    made: list[str] = field(default_factory=list)
    """Stages that were not cached."""

    def __post_init__(self) -> None:
        self.loaded, self.store, self.options = self.planner.loaded, self.planner.store, self.planner.options
        asked = self.options.workers or self.loaded.recipe.execution.workers
        self.workers = asked or self.workers or available_cores()
        self.views = {stage.name: StageView(stage.name) for stage in self.planner.stages}

    def run(self) -> dict[str, Artifact]:
        """Bring every stage's artifact about. Raises `PipelineFailed` or `Interrupted`."""
        self.display.begin(list(self.views.values()))
        try:
            for stage in self.planner.stages:
                if self.interrupted():
                    raise Interrupted
                self.artifacts[stage.name] = self._artifact(stage)
                remember(self.store.runs, self.loaded, self.artifacts[stage.name])
        except Exception as error:
            if isinstance(error, (PipelineFailed, Interrupted)) or not is_disk_full(error):
                raise
            raise PipelineFailed(
                f"{stage.name} failed: no space is left: {what_is_full(error, (self.store.runs.root,))}. "
                "What is finished is kept, and so is the last checkpoint; make some (`iowbc gc` removes what you name)"
            ) from error
        finally:
            self.display.end()
        return self.artifacts

    def _artifact(self, stage: Stage, *, whole: bool = False) -> Artifact:
        """The stage's artifact: the stored one where it can be used, else a new one. whole: see `Planner.decide`."""
        step = self._decide(stage, whole)
        if step.cached:
            self._clear(stage, step.key)
            return self._reused(step)
        for read in self.planner.stages:
            if read.name in stage.reads(self.loaded.recipe) and not self.artifacts[read.name].whole:
                self.artifacts[read.name] = self._artifact(read, whole=True)
                remember(self.store.runs, self.loaded, self.artifacts[read.name])
                step = self._decide(stage, whole)

        def waits(holder: object) -> None:
            self._show(stage.name, "waits", f"{holder} is making it")
            self.display.say(f"{stage.name}: busy, held by {holder}; waiting for it, to use what it makes")

        with key_lock(self.store.runs, step.key, waits, self.interrupted) as held:
            if not held:
                raise Interrupted
            workspace = Workspace(self.store.runs, stage.name, step.key)
            self._finish_adding(workspace)
            step = self._decide(stage, whole)
            if step.cached:
                workspace.remove()
                return self._reused(step)
            if step.damage:
                aside = self.store.set_aside(stage.name, step.key)
                self.display.say(f"{stage.name}: its artifact is damaged ({step.damage}); set aside in {aside}")
            return self._made(step, workspace)

    def _clear(self, stage: Stage, key: str) -> None:
        """Remove the work folder of a process that died after storing this artifact."""
        workspace = Workspace(self.store.runs, stage.name, key)
        if workspace.leftover:
            with key_lock(self.store.runs, key, lambda holder: None, lambda: True) as held:
                if held and workspace.leftover:
                    workspace.remove()

    def _decide(self, stage: Stage, whole: bool) -> StagePlan:
        read = {name: self.artifacts[name] for name in stage.reads(self.loaded.recipe)}
        for name, artifact in self.planner.borrowed(stage).items():
            if artifact is None:
                origin = self.planner.origins[stage.name, name].loaded.file
                raise PipelineFailed(f"{stage.name} reads an artifact of {origin}; first `iowbc run {origin}`")
            read[name] = artifact
        return self.planner.decide(stage, read, whole=whole)

    def _reused(self, step: StagePlan) -> Artifact:
        assert step.artifact is not None
        self._show(step.stage.name, "cached", "; ".join(("published", *step.notes) if step.published else step.notes))
        if self.tracker is not None:
            self.tracker.finished(step.stage.name, step.artifact, cached=True)
        return step.artifact

    def _finish_adding(self, workspace: Workspace) -> None:
        """Store output that was already sealed when its process died."""
        with contextlib.suppress(Damaged):
            if workspace.out.is_dir():
                read_artifact(workspace.out, workspace.stage, workspace.key).verify()
                self.store.add(workspace.out, workspace.stage, workspace.key)
                workspace.remove()

    def _made(self, step: StagePlan, workspace: Workspace) -> Artifact:
        stage, key, view = step.stage, workspace.key, self.views[step.stage.name]
        ingredients, resolved = step.ingredients, as_yaml(self.loaded.recipe)
        forced = stage.name in self.options.force
        name, code, same_code = self.loaded.recipe.name, dict(step.code), self.options.same_code
        earlier = workspace.begin(name, forced, code, self.command(), same_code=same_code)
        describe(workspace.root, ingredients, resolved)
        view.record, view.began = workspace.state, time.monotonic() - workspace.seconds
        self._show(stage.name, "runs", short(step.notes or step.reasons, 1))
        view.note = ""
        changed = changed_code(earlier.code, step.code) if earlier else []
        if changed:
            self.display.say(f"{stage.name}: code changed since its first attempt: {', '.join(changed)}")
        if self.tracker is not None:
            self.tracker.stage(stage.name, key, ingredients["recipe"], earlier is not None, self.artifacts)
        job = Job(
            recipe=self.loaded.recipe,
            key=key,
            robot=self.planner.robot,
            inputs={name: artifact.folder for name, artifact in step.inputs.items()},
            out=workspace.out,
            work=workspace.scratch,
            workers=self.workers,
            report=StageReport(view, self.display, self.tracker, workspace),
            interrupted=self.interrupted,
            predecessor=None if step.predecessor is None else step.predecessor.folder,
        )
        try:
            self.execute(stage, job)
            details = {
                "stage": stage.name,
                "version": stage.version,
                "key": key,
                "recipe": self.loaded.recipe.name,
                "seconds": workspace.seconds + (step.predecessor.manifest.seconds if step.predecessor else 0.0),
                "attempts": workspace.state.attempts,
                "workers": self.workers,
                "host": gethostname(),
                "code": dict(step.code),
                "versions": versions(),
            }
            seal(workspace.out, stage.results, details, ingredients, resolved)
            artifact = self.store.add(workspace.out, stage.name, key)
            workspace.remove()
        except (Interrupted, KeyboardInterrupt) as error:
            self._ended(workspace, "stopped", "KILLED", str(error))
            text = str(error).removeprefix(f"{stage.name}: ")
            raise Interrupted(f"{stage.name}: {text or 'aborted'}") from error
        except IowbcError as error:
            self._ended(workspace, "failed", "FAILED", str(error))
            raise PipelineFailed(f"{stage.name} failed: {error}") from error
        except Exception as error:
            if is_disk_full(error):
                self._ended(workspace, "failed", "FAILED", "no space left")
                raise
            details_file = workspace.root / "error.txt"
            with contextlib.suppress(OSError):
                details_file.write_text(traceback.format_exc(), encoding="utf-8")
            summary = f"{type(error).__name__}: {error}"
            self._ended(workspace, "failed", "FAILED", summary)
            self.display.say(traceback.format_exc())
            raise PipelineFailed(f"{stage.name} failed: {summary}\nthe traceback is also in {details_file}") from error
        self.made.append(stage.name)
        view.seconds = artifact.manifest.seconds
        self._show(stage.name, "done")
        if self.tracker is not None:
            self.tracker.finished(stage.name, artifact, cached=False)
        return artifact

    def _show(self, stage: str, state: str, note: str = "") -> None:
        view = self.views[stage]
        view.state, view.note = state, note
        self.display.changed(view)

    def _ended(self, workspace: Workspace, state: str, status: str, message: str) -> None:
        with contextlib.suppress(OSError):  # a full disk must not hide why the stage ended
            workspace.write()
        self.views[workspace.stage].seconds = workspace.seconds
        self._show(workspace.stage, state)
        if self.tracker is not None:
            with contextlib.suppress(OSError):
                self.tracker.end(workspace.stage, status, message)
