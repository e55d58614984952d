"""Work of a stage that other nodes do: calls of functions, and objects that it holds there.

Ray begins an actor on a node with a free core and reserves none for it afterwards: pools never wait for one another.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import ray

from iowbc.errors import Interrupted, IowbcError, StageFailed, WorkerFailed
from iowbc.pipeline.cluster.folders import SharedFolder, placed

Result = TypeVar("Result")
TRIES = 5
"""Consecutive retries of a call or an actor, and attempts at a stage, whose node or worker is lost; then it fails."""
POLL = 0.2
"""Polling interval [s]."""


def raised(error: Exception) -> BaseException | None:
    """The exception of the code on a node, from Ray's error; None where the node or worker is lost."""
    cause: BaseException | None = error.cause if isinstance(error, ray.exceptions.RayTaskError) else None
    return None if isinstance(cause, ray.exceptions.RayError) else cause


class ActorHost:
    """Ray's actor on a node: one member, made at its first request. It is any object with `ask(message)`, which returns
    the answer, `state()`, its complete state, and `restore(state)`, so that it can be remade elsewhere."""

    def __init__(self, make: Callable[[], Any]) -> None:
        self._make = make
        self._member: Any = None

    def ask(self, state: Any, message: Any, changes: bool) -> tuple[Any, Any]:
        """The answer, and the new state if it changes. `state`: initial state of a member that is created now."""
        if self._member is None:
            self._member = self._make()
            if state is not None:
                self._member.restore(state)
        answer = self._member.ask(message)
        return answer, self._member.state() if changes else None


@dataclass(eq=False)
class Place:
    """A member's actor, and its last request, state and answer."""

    make: Callable[[], Any]
    actor: Any = None
    """Made at the next request where there is none."""
    request: tuple[Any, bool] = (None, True)
    """The message, and whether it changes the state."""
    state: Any = None
    """State after the last request that changed it."""
    answer: Any = None
    losses: int = 0
    """Consecutive losses of its actor."""


class NodeActorPool:
    """Members that work in parallel. A lost one is recreated in its last known state, and its request is repeated."""

    def __init__(
        self,
        called: str,
        make: Callable[..., Any],
        calls: Sequence[tuple[Any, ...]],
        folders: Mapping[str, SharedFolder],
        interrupted: Callable[[], bool],
        say: Callable[[str], None],
    ) -> None:
        """See `NodeSpread.actor_pool`. say: prints a line about members that are lost."""
        self._called, self._interrupted, self._say = called, interrupted, say
        self._host = ray.remote(ActorHost)
        self._asked: dict[Any, Place] = {}
        """Members that have not answered yet, by Ray's references to their answers."""
        self._places = [Place(partial(_called, make, arguments, folders)) for arguments in calls]

    @property
    def states(self) -> list[Any]:
        """The state of each member after the last request that changed it."""
        return [place.state for place in self._places]

    def ask(self, messages: Sequence[Any], *, changes: bool = True) -> None:
        """Send each member its message. `changes`: whether that changes states."""
        for place, message in zip(self._places, messages, strict=True):
            place.request = message, changes
            self._send(place)

    def answers(self) -> list[Any]:
        """The members' answers, in order. Raises `WorkerFailed` if a member raises, `StageFailed` if one is lost too
        often, `Interrupted` if a stop is requested while members have not started."""
        while self._asked:
            over, late = ray.wait(list(self._asked), num_returns=len(self._asked), timeout=POLL)
            for reference in over:
                self._hear(reference)
            if late and self._interrupted() and any(place.state is None for place in self._asked.values()):
                raise Interrupted("members had not begun yet")
        return [place.answer for place in self._places]

    def close(self) -> None:
        for place in self._places:
            if place.actor is not None:
                ray.kill(place.actor)
        self._places = []

    def _send(self, place: Place) -> None:
        """Send a member its request; a new actor also receives its state, which it then holds itself."""
        state = None
        if place.actor is None:
            place.actor = self._host.options(scheduling_strategy="SPREAD", max_restarts=0).remote(place.make)
            state = place.state
        self._asked[place.actor.ask.remote(state, *place.request)] = place

    def _hear(self, reference: Any) -> None:
        place = self._asked.pop(reference)
        try:
            place.answer, state = ray.get(reference)
        except ray.exceptions.RayError as error:
            if (cause := raised(error)) is not None:
                who = f"{self._called} {self._places.index(place) + 1} of {len(self._places)}, on {error.ip}"
                raise WorkerFailed(f"{who}:\n{cause if isinstance(cause, IowbcError) else error}") from None
            place.losses += 1
            if place.losses > TRIES:
                lost = f"lost a {self._called} {place.losses} times in a row"
                raise StageFailed(f"{lost}, the last time: {str(error).strip().splitlines()[0]}") from None
            self._say(f"a {self._called} was lost; another one takes its place")
            ray.kill(place.actor)
            place.actor = None
            self._send(place)
            return
        place.losses = 0
        place.state = state if place.request[1] else place.state


class NodeSpread:
    """A stage's access to the nodes of the cluster."""

    def __init__(
        self, folders: Mapping[Path, SharedFolder], interrupted: Callable[[], bool], say: Callable[[str], None]
    ) -> None:
        """folders: what the stage reads, by its place on this machine. say: prints a line about lost actors."""
        self._folders, self._interrupted, self._say = folders, interrupted, say

    @property
    def width(self) -> int:
        """Calls that can run at the same time."""
        return max(1, int(ray.cluster_resources().get("CPU", 1)))

    def __call__(
        self, function: Callable[..., Result], calls: Sequence[tuple[Any, ...]], folders: Mapping[str, Path]
    ) -> Iterator[tuple[int, Result]]:
        """Call a module-level function with each of these arguments on any node, one core each. Yields index and result
        of each call as it ends. `folders`: passed by name as paths on the node. Raises `Interrupted` after a stop
        request."""
        own = {name: self._folders[path] for name, path in folders.items()}
        piece = ray.remote(num_cpus=1, max_retries=TRIES, scheduling_strategy="SPREAD")(_called)
        waiting = {piece.remote(function, arguments, own): place for place, arguments in enumerate(calls)}
        try:
            while waiting:
                if self._interrupted():
                    raise Interrupted("finished pieces are kept")
                for task in ray.wait(list(waiting), timeout=POLL)[0]:
                    yield waiting.pop(task), ray.get(task)
        finally:
            for task in waiting:
                ray.cancel(task, force=True)

    def actor_pool(
        self, called: str, make: Callable[..., Any], calls: Sequence[tuple[Any, ...]], folders: Mapping[str, Path]
    ) -> NodeActorPool:
        """Members on any nodes, each made as a call above is. `called`: the members' name in messages."""
        own = {name: self._folders[path] for name, path in folders.items()}
        return NodeActorPool(called, make, calls, own, self._interrupted, self._say)


def _called(function: Callable[..., Result], arguments: tuple[Any, ...], folders: Mapping[str, SharedFolder]) -> Result:
    """Result of a function on this node, with the folders at their places here."""
    return function(*arguments, **{name: placed(folder) for name, folder in folders.items()})
