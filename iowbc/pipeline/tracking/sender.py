"""The process that sends journals to MLflow: `python -m iowbc.pipeline.tracking.sender RUNS`.

One at a time works on a `runs/` folder. It stays as long as a journal's process lives, ends the runs of processes that
died as KILLED, and leaves what a server does not take for the next one.
"""

import os
import sys
import time
from pathlib import Path

from iowbc.pipeline.store.locks import named_lock
from iowbc.pipeline.store.runs import Runs
from iowbc.pipeline.tracking.delivery import Delivery

POLL = 0.5
"""Seconds between two looks at the journals of living processes."""
RETRIES, RETRY_WAIT = 3, 2.0
"""Attempts at a server that does not answer, after the last living process has gone, and seconds between them."""


def main(root: Path) -> int:
    """Send until nothing is left and no process writes any more; 0 where MLflow has everything."""
    os.environ["MLFLOW_DISABLE_TELEMETRY"] = "true"
    os.environ.setdefault("MLFLOW_HTTP_REQUEST_TIMEOUT", "10")
    os.environ.setdefault("MLFLOW_HTTP_REQUEST_MAX_RETRIES", "1")
    runs, deliveries = Runs(root), dict[Path, Delivery]()
    with named_lock(runs.tracking / "sender.lock"):
        failures = 0
        while True:
            paths = sorted(runs.tracking.glob("*.jsonl"))
            deliveries = {path: deliveries.get(path) or Delivery(runs, path) for path in paths}
            living, failed = False, False
            for delivery in deliveries.values():
                living |= delivery.lives()
                failed |= not delivery.advance()
            failures = failures + 1 if failed else 0
            if not living and (failures == 0 or failures >= RETRIES):
                return 1 if failed else 0
            time.sleep(RETRY_WAIT if failed else POLL)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
