"""`iowbc ui`: MLflow's web interface on the runs of this folder, for this machine alone."""

import json
import os
import subprocess
import sys
from typing import TYPE_CHECKING, Annotated

from typer import Exit, Option

from iowbc.commands import options
from iowbc.commands.printed import stdout_console, tell
from iowbc.commands.process import close_on_termination
from iowbc.errors import UsageError
from iowbc.pipeline.store.runs import Runs, require_writable_runs
from iowbc.pipeline.tracking.delivery import URI_VARIABLE, embedded_uri, open_experiment, tracking_uri
from iowbc.pipeline.tracking.tracker import backlog, start_sender
from iowbc.recipe.execution import Execution
from iowbc.stages.registry import STAGES

if TYPE_CHECKING:
    from mlflow.tracking import MlflowClient

VIEW = "iowbc"
"""Name of the shared view in MLflow."""


def ui(
    port: Annotated[int, Option(help="Local port.", min=1, max=65535)] = 5000,
    folder: options.RunsFolder = options.RUNS,
) -> None:
    """Serve until interrupted; exits with the server's code. Raises `UsageError` where it cannot begin."""
    runs, console = Runs(folder), stdout_console()
    options.require_extra("train", "iowbc ui")
    require_writable_runs(runs)
    if elsewhere := tracking_uri():
        raise UsageError(
            f"runs are recorded in {elsewhere} ({URI_VARIABLE}): open that server's page, or unset the variable to see "
            f"those recorded in {runs.database}"
        )
    options.require_free(port)
    close_on_termination()
    uri = embedded_uri(runs)
    mlflow, shown = opened(runs, uri)
    mlflow.set_experiment_tag(shown, f"mlflow.sharedViewState.{VIEW}", json.dumps(view()))
    if backlog(runs):
        start_sender(runs)
    page = f"http://{options.HOST}:{port}/#/experiments/{shown}/runs"
    console.print("MLflow's page of the runs, ready in about a quarter of a minute; Ctrl-C ends it:", highlight=False)
    tell(console, f"{page}?workflowType=machine_learning&viewStateShareKey={VIEW}")
    command = [sys.executable, "-m", "mlflow", "server", "--host", options.HOST, "--port", str(port), "--workers", "1"]
    command += ["--backend-store-uri", uri, "--artifacts-destination", runs.tracked_files.absolute().as_uri()]
    environment = {**os.environ, "MLFLOW_DISABLE_TELEMETRY": "true", "MLFLOW_SERVER_ENABLE_JOB_EXECUTION": "false"}
    environment.setdefault("PYTHONWARNINGS", "ignore")  # hides warnings about MLflow's own code
    with subprocess.Popen(command, env=environment) as server:
        try:
            raise Exit(server.wait())
        finally:
            server.terminate()


def opened(runs: Runs, uri: str) -> "tuple[MlflowClient, str]":
    """MLflow's client and the experiment shown. Raises `UsageError` where the database cannot be read."""
    from mlflow.exceptions import MlflowException
    from sqlalchemy.exc import SQLAlchemyError

    try:
        return open_experiment(runs, uri, Execution.model_fields["experiment"].default)
    except (MlflowException, SQLAlchemyError) as error:
        raise UsageError(
            f"MLflow cannot use {runs.database}: {str(error).splitlines()[0]}; if it is damaged, move it away: the "
            "next run begins another, and artifacts do not depend on it"
        ) from None


def view() -> dict[str, object]:
    """MLflow's view of the runs: newest first, stages within their run, with the columns that tell most."""
    metrics = [f"metrics.`{stage.name}/{name}`" for stage in STAGES.values() for name in stage.columns]
    return {
        "searchFilter": "",
        "orderByKey": "attributes.start_time",
        "orderByAsc": False,
        "startTime": "ALL",
        "lifecycleFilter": "Active",
        "selectedColumns": ["attributes.`Description`", *metrics, "tags.`iowbc.cached`"],
        "runsExpanded": {},
        "viewMaximized": True,
    }
