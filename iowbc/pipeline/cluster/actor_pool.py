"""Objects that a stage holds on other nodes, one a core: asked side by side, remade where their node is lost."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from iowbc.errors import Interrupted, IowbcError, StageFailed, WorkerFailed
from iowbc.pipeline.cluster.folders import SharedFolder, placed
from iowbc.pipeline.stage import Member

TRIES = 5
"""Times in a row that a member is remade whose node or worker is lost, before the stage counts as failed."""
POLL = 0.2
"""Seconds between two looks at the members."""
CORE_PATIENCE = 30.0
"""Seconds after which a member that waits for a core shares one: those that are there may be held by pools that wait
for this one's, or may have gone for good."""


class ActorHost:
    """Ray's actor on a node: one member, made from these arguments at its first request."""

    def __init__(
        self, make: Callable[..., Member], arguments: tuple[Any, ...], folders: Mapping[str, SharedFolder]
    ) -> None:
        self._make, self._arguments, self._folders = make, arguments, folders
        self._member: Member | None = None

    def ask(self, state: Any, message: Any, changes: bool) -> tuple[Any, Any]:
        """The answer, and the state after it where it changes any. `state`: of a member that is not made yet."""
        if self._member is None:
            self._member = self._make(
                *self._arguments, **{name: placed(folder) for name, folder in self._folders.items()}
            )
            if state is not None:
                self._member.restore(state)
        answer = self._member.ask(message)
        return answer, self._member.state() if changes else None


@dataclass(eq=False)
class Place:
    """A member's actor, its last state, and Ray's references to what it has not answered yet."""

    arguments: tuple[Any, ...]
    actor: Any = None
    starting: Any = None
    """None once the actor runs on a node."""
    asked: Any = None
    made: bool = False
    """True once this actor has answered: it holds its state itself."""
    since: float = 0.0
    """Start of the wait for a core [s]."""
    state: Any = None
    """After the last request that changed it."""
    answer: Any = None
    losses: int = 0
    """In a row."""
    shares: bool = False
    """True where it takes no core of its own."""


class NodeActorPool:
    """Members that are asked side by side. One that is lost is remade in the state after its last request."""

    def __init__(
        self,
        called: str,
        make: Callable[..., Member],
        calls: Sequence[tuple[Any, ...]],
        folders: Mapping[str, SharedFolder],
        interrupted: Callable[[], bool],
        say: Callable[[str], None],
    ) -> None:
        """See `NodeSpread.actor_pool`. say: prints a line about members that are lost or share a core."""
        import ray

        self._called, self._make, self._folders = called, make, folders
        self._interrupted, self._say = interrupted, say
        self._host = ray.remote(ActorHost)
        self._messages: Sequence[Any] = ()
        self._changes = False
        self._places = [Place(arguments) for arguments in calls]
        for place in self._places:
            self._start(place)

    @property
    def states(self) -> list[Any]:
        """The state of each member after the last request that changed it."""
        return [place.state for place in self._places]

    def ask(self, messages: Sequence[Any], *, changes: bool = True) -> None:
        """Send each member its message. `changes`: whether that changes states."""
        self._messages, self._changes = messages, changes
        for place in self._places:
            self._request(place)

    def answers(self) -> list[Any]:
        """The members' answers, in order.

        Raises WorkerFailed with what a member raised, StageFailed where one is lost again and again, and `Interrupted`
        where members have not begun yet when the job is asked to stop.
        """
        import ray

        while waiting := {
            one: place for place in self._places for one in (place.starting, place.asked) if one is not None
        }:
            over, late = ray.wait(list(waiting), num_returns=len(waiting), timeout=POLL)
            for reference in over:
                if reference in (waiting[reference].starting, waiting[reference].asked):  # else it was lost meanwhile
                    self._hear(waiting[reference], reference)
            if late:
                self._look()
        return [place.answer for place in self._places]

    def close(self) -> None:
        """End the members."""
        import ray

        for place in self._places:
            ray.kill(place.actor)
        self._places = []

    def _start(self, place: Place) -> None:
        options = {"num_cpus": 0 if place.shares else 1, "scheduling_strategy": "SPREAD", "max_restarts": 0}
        place.actor = self._host.options(**options).remote(self._make, place.arguments, self._folders)
        place.starting, place.made, place.since = place.actor.__ray_ready__.remote(), False, time.monotonic()

    def _request(self, place: Place) -> None:
        message, state = self._messages[self._places.index(place)], None if place.made else place.state
        place.asked = place.actor.ask.remote(state, message, self._changes)

    def _hear(self, place: Place, reference: Any) -> None:
        import ray

        try:
            found = ray.get(reference)
        except ray.exceptions.RayError as error:
            cause = getattr(error, "cause", None)
            if isinstance(error, ray.exceptions.RayTaskError) and not isinstance(cause, ray.exceptions.RayError):
                who = f"{self._called} {self._places.index(place) + 1} of {len(self._places)}, on {error.ip}"
                raise WorkerFailed(f"{who}:\n{cause if isinstance(cause, IowbcError) else error}") from None
            self._lost(place, str(error).strip().splitlines()[0])
            return
        if reference == place.starting:
            place.starting = None
            return
        place.asked, place.made, place.losses = None, True, 0
        place.answer, state = found
        if self._changes:
            place.state = state

    def _look(self) -> None:
        """Treat members that have not begun yet."""
        now = time.monotonic()
        starting = [place for place in self._places if place.starting is not None]
        if any(place.state is None for place in starting) and self._interrupted():
            raise Interrupted("members had not begun yet")
        late = [place for place in starting if not place.shares and now - place.since > CORE_PATIENCE]
        if late:
            self._say(f"{len(late)} of {len(self._places)} {self._called}s find no core of their own, and share one")
        for place in late:
            place.shares = True
            self._remake(place)

    def _lost(self, place: Place, why: str) -> None:
        """Remake a member whose node or worker is lost."""
        place.losses += 1
        if place.losses > TRIES:
            raise StageFailed(f"lost a {self._called} {place.losses} times in a row, the last time: {why}")
        self._say(f"a {self._called} was lost; another one takes its place")
        place.shares = False
        self._remake(place)

    def _remake(self, place: Place) -> None:
        import ray

        ray.kill(place.actor)
        self._start(place)
        if place.asked is not None:
            self._request(place)
