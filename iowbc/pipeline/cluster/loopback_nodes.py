"""The process that holds Ray's nodes of `loopback`: `python -m`, parent's number and cores of each node."""

import signal
import sys

from iowbc.processes import die_with_parent

STARTED = "all nodes run, address "
OBJECT_STORE = 1 << 30
"""Bytes of memory for objects on each node; what is more goes to disk."""


def main() -> None:
    """Start the nodes, say so, and hold them until SIGTERM, or until the parent ends."""
    parent, *cores = sys.argv[1:]
    die_with_parent(int(parent), number=signal.SIGTERM)

    from ray.cluster_utils import Cluster

    nodes = Cluster()
    for count in cores:
        nodes.add_node(
            num_cpus=int(count),
            object_store_memory=OBJECT_STORE,
            include_dashboard=False,
            include_log_monitor=False,
            no_monitor=True,
        )
    print(f"{STARTED}{nodes.address}", flush=True)
    while True:
        signal.pause()


if __name__ == "__main__":
    main()
