"""The processes of a Ray cluster that a command has started."""

import contextlib
from collections.abc import Iterable

import psutil

RAYS = ("raylet", "gcs_server", "ray::")
HEALTH = {"RAY_health_check_failure_threshold": "3", "RAY_health_check_period_ms": "1000"}
"""Environment in which Ray looks three times in three seconds before it believes in a node's death, not five times in
fifteen."""


def below(parent: int) -> list[psutil.Process]:
    """The processes that a process has started, and theirs."""
    try:
        return list(psutil.Process(parent).children(recursive=True))
    except psutil.NoSuchProcess:
        return []


def rays(parent: int) -> list[psutil.Process]:
    """Those of Ray among them."""
    return [process for process in below(parent) if name(process).startswith(RAYS)]


def name(process: psutil.Process) -> str:
    """Empty once it has ended."""
    try:
        return "" if process.status() == psutil.STATUS_ZOMBIE else str(process.name())
    except psutil.NoSuchProcess:
        return ""


def listens_on(process: psutil.Process) -> set[str]:
    """Addresses of this machine; none once it has ended."""
    try:
        return {entry.laddr.ip for entry in process.net_connections("tcp") if entry.status == psutil.CONN_LISTEN}
    except psutil.NoSuchProcess:
        return set()


def kill(processes: Iterable[psutil.Process]) -> None:
    for process in processes:
        with contextlib.suppress(psutil.NoSuchProcess):
            process.kill()


def nodes(parent: int) -> list[psutil.Process]:
    """The nodes that are not the head."""
    found = [process for process in rays(parent) if name(process) == "raylet"]
    return [node for node in found if "--head" not in node.cmdline()]


def holds_an_actor(node: psutil.Process) -> bool:
    """Whether a training's rollouts are made there."""
    return any(name(process).startswith("ray::ActorHost") for process in below(node.pid))


def kill_a_node(node: psutil.Process) -> None:
    """Kills a node with all its processes."""
    kill([node, *below(node.pid)])
