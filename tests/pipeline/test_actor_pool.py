"""Members on nodes that are busy or lost, on a stand-in for Ray."""

import traceback
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import pytest

pytest.importorskip("ray", reason="the extra `cluster` brings Ray")

import ray
from ray import exceptions

from iowbc.errors import Damaged, Interrupted, StageFailed, WorkerFailed
from iowbc.pipeline.cluster.folders import SharedFolder
from iowbc.pipeline.cluster.spread import TRIES, ActorHost, NodeActorPool
from iowbc.pipeline.code import identity

pytestmark = pytest.mark.unit


class Adder:
    """A member: adds up what it is given."""

    def __init__(self, start: int) -> None:
        self.total = start

    def ask(self, message: int | str) -> int:
        if message == "refuse":
            raise Damaged("no such thing")
        if message == "break":
            raise ZeroDivisionError("nobody foresaw this")
        self.total += message
        return self.total

    def state(self) -> int:
        return self.total

    def restore(self, state: int) -> None:
        self.total = state


@dataclass(eq=False)
class Call:
    """What a request of an actor gives, from a moment on."""

    actor: "Actor"
    method: str
    arguments: tuple[Any, ...]


@dataclass(eq=False)
class Actor:
    """A holder, begun where a core is free."""

    holder: ActorHost
    placed: bool = False
    killed: bool = False
    last: Call | None = None

    def __getattr__(self, method: str) -> Any:
        class Method:
            @staticmethod
            def remote(*arguments: Any) -> Call:
                self.last = Call(self, method, arguments)
                return self.last

        return Method


@dataclass
class Nodes:
    """Ray with so many cores."""

    cores: int
    actors: list[Actor] = field(default_factory=list)
    lost: set[int] = field(default_factory=set)
    """Actors whose node is lost while they are asked."""

    def remote(self, holder: type[ActorHost]) -> Any:
        nodes = self

        class Options:
            @staticmethod
            def options(**settings: Any) -> Any:
                class Made:
                    @staticmethod
                    def remote(*arguments: Any) -> Actor:
                        nodes.actors.append(Actor(holder(*arguments)))
                        return nodes.actors[-1]

                return Made

        return Options

    def wait(self, calls: list[Call], num_returns: int, timeout: float) -> tuple[list[Call], list[Call]]:
        self._place()
        over = [call for call in calls if call.actor.placed]
        return over, [call for call in calls if call not in over]

    def get(self, call: Call) -> Any:
        number = self.actors.index(call.actor)
        if number in self.lost:
            raise exceptions.ActorDiedError()
        try:
            return getattr(call.actor.holder, call.method)(*call.arguments)
        except Exception as error:
            raise exceptions.RayTaskError("ask", traceback.format_exc(), error, ip=f"node{number}") from error

    def kill(self, actor: Actor) -> None:
        actor.killed = True
        actor.placed = False

    def _place(self) -> None:
        for actor in self.actors:
            actor.placed = not actor.killed and self.cores > 0


@dataclass
class Watch:
    """An actor pool on some nodes, and what it says."""

    nodes: Nodes
    folders: Mapping[str, SharedFolder] = field(default_factory=dict)
    said: list[str] = field(default_factory=list)
    stop: bool = False

    def pool(self, *starts: int) -> NodeActorPool:
        calls = [(start,) for start in starts]
        return NodeActorPool("helper", Adder, calls, self.folders, lambda: self.stop, self.said.append)

    def added(self, pool: NodeActorPool, *values: int | str) -> list[int]:
        pool.ask(values)
        return pool.answers()


@pytest.fixture
def watch(monkeypatch: pytest.MonkeyPatch) -> Iterator[Watch]:
    """Two nodes of one core."""
    nodes = Nodes(2)
    for name in ("remote", "wait", "get", "kill"):
        monkeypatch.setattr(ray, name, getattr(nodes, name))
    return Watch(nodes)


def test_members_answer_in_order_and_go_on_from_what_they_were(watch: Watch) -> None:
    pool = watch.pool(10, 20)
    assert watch.added(pool, 1, 2) == [11, 22]
    assert watch.added(pool, 1, 2) == [12, 24]
    assert pool.states == [12, 24]
    assert watch.said == []
    pool.close()
    assert all(actor.killed for actor in watch.nodes.actors)


def test_a_lost_member_goes_on_elsewhere_from_its_last_state(watch: Watch) -> None:
    pool = watch.pool(10, 20)
    watch.added(pool, 1, 2)
    watch.nodes.lost = {1}
    assert watch.added(pool, 1, 2) == [12, 24]
    assert watch.said == ["a helper was lost; another one takes its place"]


def test_losses_in_a_row_are_counted_and_the_last_reason_told(watch: Watch) -> None:
    pool = watch.pool(10)
    watch.nodes.lost = set(range(TRIES))
    assert watch.added(pool, 1) == [11], "as often is still well"
    watch.nodes.lost = set(range(100))
    with pytest.raises(StageFailed, match=rf"lost a helper {TRIES + 1} times in a row, the last time: The actor died"):
        watch.added(pool, 1)


@pytest.mark.parametrize(
    ("request_", "told"), [("refuse", r"no such thing$"), ("break", r"ZeroDivisionError: nobody foresaw this$")]
)
def test_what_a_member_raises_is_told_with_its_place(watch: Watch, request_: str, told: str) -> None:
    with pytest.raises(WorkerFailed, match=rf"(?s)^helper 1 of 2, on node0:.*{told}"):
        watch.added(watch.pool(10, 20), request_, request_)


def test_a_node_with_another_version_is_refused_with_both(watch: Watch) -> None:
    own = identity()
    driver = {**own, "mujoco": "3.0"}
    watch.folders = {"robot": SharedFolder("", "", (), driver, copy=False)}
    with pytest.raises(WorkerFailed, match=rf"mujoco 3\.0 here, {own['mujoco']} on .*; install the same"):
        watch.added(watch.pool(10), 1)


def test_a_stop_ends_the_wait_of_who_has_not_begun(watch: Watch) -> None:
    watch.stop, watch.nodes.cores = True, 0
    with pytest.raises(Interrupted, match="had not begun"):
        watch.added(watch.pool(10, 20), 1, 2)


def test_a_stop_waits_for_who_was_lost_so_that_a_checkpoint_can_be_written(watch: Watch) -> None:
    pool = watch.pool(10, 20)
    watch.added(pool, 1, 2)
    watch.stop, watch.nodes.cores, watch.nodes.lost = True, 1, {1}
    assert watch.added(pool, 1, 2) == [12, 24]
