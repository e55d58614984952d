"""Members on nodes that are busy, lost, slow or hang, on a stand-in for Ray with a clock of its own."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import pytest

pytest.importorskip("ray", reason="the extra `cluster` brings Ray")

import ray
from ray import exceptions

from iowbc.errors import Damaged, Interrupted, StageFailed, WorkerFailed
from iowbc.pipeline.cluster import actor_pool as module
from iowbc.pipeline.cluster import stragglers
from iowbc.pipeline.cluster.actor_pool import CORE_PATIENCE, TRIES, ActorHost, NodeActorPool, Origin
from iowbc.pipeline.cluster.identity import identity

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
    """What a request of an actor gives, from a moment on; never where its actor hangs."""

    actor: "Actor"
    method: str
    arguments: tuple[Any, ...]
    begun: float | None = None


@dataclass(eq=False)
class Actor:
    """A holder, on a core of its own unless it asks for none."""

    holder: ActorHost
    cores: int
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
    """Ray with so many cores. Each request takes `seconds`, by the number of the actor in the order of being made."""

    cores: int
    clock: float = 0.0
    actors: list[Actor] = field(default_factory=list)
    seconds: dict[int, float] = field(default_factory=dict)
    lost: set[int] = field(default_factory=set)
    """Actors whose node is lost while they are asked."""

    def remote(self, holder: type[ActorHost]) -> Any:
        nodes = self

        class Options:
            @staticmethod
            def options(*, num_cpus: int, **settings: Any) -> Any:
                class Made:
                    @staticmethod
                    def remote(*arguments: Any) -> Actor:
                        nodes.actors.append(Actor(holder(*arguments), num_cpus))
                        return nodes.actors[-1]

                return Made

        return Options

    def wait(self, calls: list[Call], num_returns: int, timeout: float) -> tuple[list[Call], list[Call]]:
        self.clock += timeout
        self._place()
        over = [call for call in calls if self._over(call)]
        return over, [call for call in calls if call not in over]

    def get(self, call: Call) -> Any:
        number = self.actors.index(call.actor)
        if call.method == "host":
            return f"node{number}"
        if number in self.lost:
            raise exceptions.ActorDiedError()
        return getattr(call.actor.holder, call.method)(*call.arguments)

    def kill(self, actor: Actor) -> None:
        actor.killed = True
        actor.placed = False

    def _place(self) -> None:
        for actor in self.actors:
            free = self.cores - sum(one.cores for one in self.actors if one.placed)
            if not actor.placed and not actor.killed and actor.cores <= free:
                actor.placed = True

    def _over(self, call: Call) -> bool:
        if not call.actor.placed:
            return False
        call.begun = self.clock if call.begun is None else call.begun
        number = self.actors.index(call.actor)
        return call.method == "host" or self.clock - call.begun >= self.seconds.get(number, 0.0)


@dataclass
class Watch:
    """An actor pool on some nodes, and what it says."""

    nodes: Nodes
    origin: Origin
    said: list[str] = field(default_factory=list)
    stop: bool = False

    def pool(self, *starts: int) -> NodeActorPool:
        return NodeActorPool("helper", self.origin, [(start,) for start in starts], lambda: self.stop, self.said.append)

    def added(self, pool: NodeActorPool, *values: int | str, patience: float = 60.0) -> list[int]:
        pool.ask(values, patience=patience)
        return pool.answers()


@pytest.fixture
def watch(monkeypatch: pytest.MonkeyPatch) -> Iterator[Watch]:
    """Two nodes of one core."""
    nodes = Nodes(2)
    for name in ("remote", "wait", "get", "kill"):
        monkeypatch.setattr(ray, name, getattr(nodes, name))
    monkeypatch.setattr(module.time, "monotonic", lambda: nodes.clock)
    return Watch(nodes, Origin(identity(), Adder, {}, copy=False))


def test_members_answer_in_order_and_go_on_from_what_they_were(watch: Watch) -> None:
    pool = watch.pool(10, 20)
    assert watch.added(pool, 1, 2) == [11, 22]
    assert watch.added(pool, 1, 2) == [12, 24]
    assert pool.states == [12, 24]
    assert watch.said == []
    pool.close()
    assert all(actor.killed for actor in watch.nodes.actors)


def test_who_finds_no_core_shares_one_after_a_while(watch: Watch) -> None:
    pool = watch.pool(10, 20, 30)
    assert watch.added(pool, 1, 2, 3) == [11, 22, 33]
    assert watch.nodes.clock == pytest.approx(CORE_PATIENCE, abs=1.0)
    assert watch.said == ["1 of 3 helpers find no core of their own, and share one"]
    assert [actor.cores for actor in watch.nodes.actors if not actor.killed] == [1, 1, 0]


def test_a_lost_member_goes_on_elsewhere_from_its_last_state(watch: Watch) -> None:
    pool = watch.pool(10, 20)
    watch.added(pool, 1, 2)
    watch.nodes.lost = {1}
    assert watch.added(pool, 1, 2) == [12, 24]
    assert watch.said == ["a helper was lost on node1; another one takes its place"]


def test_a_member_that_hangs_is_lost_once_its_patience_is_over(watch: Watch) -> None:
    pool = watch.pool(10, 20)
    watch.added(pool, 1, 2)
    before = watch.nodes.clock
    watch.nodes.seconds = {0: float("inf")}
    assert watch.added(pool, 1, 2, patience=7.0) == [12, 24]
    assert watch.nodes.clock - before == pytest.approx(7.0, abs=1.0)
    assert watch.said == ["a helper was lost on node0; another one takes its place"]


def test_one_that_shares_a_core_and_hangs_is_lost_too(watch: Watch) -> None:
    watch.nodes.cores = 0
    watch.nodes.seconds = {1: float("inf")}
    assert watch.added(watch.pool(10), 1, patience=7.0) == [11]
    assert watch.said[1].startswith("a helper was lost on node1")


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
    own = watch.origin.driver
    watch.origin = replace(watch.origin, driver=replace(own, versions={**own.versions, "mujoco": "3.0"}))
    with pytest.raises(WorkerFailed, match=rf"mujoco 3\.0 here, {own.versions['mujoco']} on .*; install the same"):
        watch.added(watch.pool(10), 1)


def test_a_stop_ends_the_wait_of_who_has_not_begun(watch: Watch) -> None:
    watch.stop, watch.nodes.cores = True, 1
    with pytest.raises(Interrupted, match="had not begun"):
        watch.added(watch.pool(10, 20), 1, 2)


def test_a_stop_waits_for_who_was_lost_so_that_a_checkpoint_can_be_written(watch: Watch) -> None:
    pool = watch.pool(10, 20)
    watch.added(pool, 1, 2)
    watch.stop, watch.nodes.cores, watch.nodes.lost = True, 1, {1}
    assert watch.added(pool, 1, 2) == [12, 24]


def test_who_is_slow_is_named_once_for_as_long_as_it_lasts(watch: Watch) -> None:
    pool = watch.pool(10, 20, 30)
    watch.nodes.cores = 3
    watch.nodes.seconds = {0: 2.0, 1: 2.0, 2: 9.0}
    for _ in range(3):
        watch.added(pool, 1, 2, 3)
    assert [text.startswith("helper 3 took 9.") for text in watch.said] == [True], watch.said
    assert " s on node2, the others 2." in watch.said[0]
    watch.nodes.seconds = {0: 2.0, 1: 2.0, 2: 2.0}
    watch.added(pool, 1, 2, 3)
    watch.nodes.seconds = {0: 2.0, 1: 9.0, 2: 2.0}
    watch.added(pool, 1, 2, 3)
    assert [text.split(" took")[0] for text in watch.said] == ["helper 3", "helper 2"]


def test_being_made_is_not_being_slow(watch: Watch) -> None:
    watch.nodes.seconds = {1: 9.0}
    pool = watch.pool(10, 20)
    watch.added(pool, 1, 2)
    assert watch.said == []


def test_what_is_short_varies_by_chance() -> None:
    assert stragglers.straggler("it", "here", 0.5, [0.01, 0.01]) == ""
    assert stragglers.straggler("it", "here", 10.0, []) == ""
    assert stragglers.straggler("it", "here", 10.0, [2.0, 2.0, 30.0]) == "it took 10.0 s on here, the others 2.0 s"
