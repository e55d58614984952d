"""Objects that a stage holds on other nodes, one a core: asked side by side, remade where their node is lost."""

import time
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from iowbc.errors import Interrupted, IowbcError, StageFailed, WorkerFailed
from iowbc.pipeline.cluster.folders import Folder, placed
from iowbc.pipeline.cluster.identity import Identity, identity
from iowbc.pipeline.cluster.stragglers import straggler
from iowbc.pipeline.stage import Member

TRIES = 5
"""Times in a row that a member is remade whose node or worker is lost, before the stage counts as failed."""
POLL = 0.2
"""Seconds between two looks at the members."""
CORE_PATIENCE = 30.0
"""Seconds after which a member that waits for a core shares one: those that are there may be held by pools that wait
for this one's, or may have gone for good."""


@dataclass(frozen=True)
class Origin:
    """How the members of an actor pool are made."""

    driver: Identity
    make: Callable[..., Member]
    folders: Mapping[str, Folder]
    copy: bool


class ActorHost:
    """What Ray holds on a node: one member, made from these arguments."""

    def __init__(self, origin: Origin, arguments: tuple[Any, ...]) -> None:
        self._origin, self._arguments = origin, arguments
        self._member: Member | None = None

    def host(self) -> str:
        """Name of the node, once it runs there."""
        return identity().host

    def ask(self, state: Any, message: Any, changes: bool) -> tuple[bool, Any, Any]:
        """Whether the request went well; the answer, or what was wrong; and the state after it, where it changes any.

        `state`: from which a member that is not made yet goes on. Raises what Ray raises where inputs are lost.
        """
        import ray

        try:
            if self._member is None:
                self._member = self._made()
                if state is not None:
                    self._member.restore(state)
            answer = self._member.ask(message)
            return True, answer, self._member.state() if changes else None
        except ray.exceptions.RayError:
            raise
        except IowbcError as error:
            return False, str(error), None
        except Exception:
            return False, traceback.format_exc(), None

    def _made(self) -> Member:
        import ray

        origin = self._origin
        if different := origin.driver.mismatch(identity()):
            raise StageFailed(f"a node is not as the driver: {different}; install the same on both")
        here = {name: placed(folder, ray.get, copy=origin.copy) for name, folder in origin.folders.items()}
        return origin.make(*self._arguments, **here)


@dataclass(eq=False)
class Place:
    """Where a member is, as far as is known."""

    arguments: tuple[Any, ...]
    actor: Any = None
    host: str = ""
    """Empty as long as it waits for a core."""
    since: float = 0.0
    """When it was sent to its node, or asked."""
    state: Any = None
    """Of the last request that changed it."""
    answer: Any = None
    losses: int = 0
    """In a row."""
    shares: bool = False
    """Whether it takes no core of its own."""
    made: bool = False
    """Whether it has answered where it is now."""
    took: float | None = None
    """Seconds from being asked to its answer; None where it was made meanwhile."""
    straggles: bool = False
    """Whether it was named for being slow."""
    waiting: dict[Any, str] = field(default_factory=dict)
    """Ray's references to what it has not answered yet."""


class NodeActorPool:
    """Members on the nodes of the cluster. See `ActorPool`."""

    def __init__(
        self,
        called: str,
        origin: Origin,
        calls: Sequence[tuple[Any, ...]],
        interrupted: Callable[[], bool],
        say: Callable[[str], None],
    ) -> None:
        """called: what users know a member as. calls: the arguments that make each. say: is told of members that are
        lost, share a core, or are slow."""
        import ray

        self._called = called
        self._origin, self._interrupted, self._say = origin, interrupted, say
        self._request: tuple[Sequence[Any], bool] = ((), False)
        self._patience = 0.0
        self._holder = ray.remote(ActorHost)
        self._places = [Place(arguments) for arguments in calls]
        for place in self._places:
            self._send(place)

    @property
    def states(self) -> list[Any]:
        """See `ActorPool`."""
        return [place.state for place in self._places]

    def ask(self, messages: Sequence[Any], *, changes: bool = True, patience: float = 600.0) -> None:
        """See `ActorPool`."""
        self._request, self._patience = (messages, changes), patience
        for index in range(len(self._places)):
            self._begin(index)

    def answers(self) -> list[Any]:
        """See `ActorPool`."""
        import ray

        while waiting := {one: place for place in self._places for one in place.waiting}:
            over, late = ray.wait(list(waiting), num_returns=len(waiting), timeout=POLL)
            for reference in over:
                place = waiting[reference]
                if reference in place.waiting:  # it was not lost meanwhile
                    self._hear(place, reference)
            if late:
                self._look()
        self._name_stragglers()
        return [place.answer for place in self._places]

    def close(self) -> None:
        """See `ActorPool`."""
        import ray

        for place in self._places:
            ray.kill(place.actor)
        self._places = []

    def _send(self, place: Place) -> None:
        """Has a member made on some node."""
        options = {"num_cpus": 0 if place.shares else 1, "scheduling_strategy": "SPREAD", "max_restarts": 0}
        place.actor = self._holder.options(**options).remote(self._origin, place.arguments)
        place.host, place.since, place.made = "", time.monotonic(), False
        place.waiting = {place.actor.host.remote(): "host"}

    def _begin(self, index: int) -> None:
        """Asks a member; one that is remade goes on from its last state."""
        messages, changes = self._request
        place = self._places[index]
        asked = place.actor.ask.remote(None if place.host else place.state, messages[index], changes)
        place.waiting[asked] = "answer"
        place.since, place.took = time.monotonic(), None

    def _hear(self, place: Place, reference: Any) -> None:
        import ray

        try:
            found = ray.get(reference)
        except ray.exceptions.RayError as error:
            cause = getattr(
                error, "cause", None
            )  # of an error in the member: inputs that were lost, or no node's fault
            if isinstance(error, ray.exceptions.RayTaskError) and not isinstance(cause, ray.exceptions.RayError):
                raise
            self._lost(place, str(error).strip().splitlines()[0])
            return
        if place.waiting.pop(reference) == "host":
            place.host, place.since = found, time.monotonic()
            return
        fine, place.answer, state = found
        index = self._places.index(place)
        if not fine:
            raise WorkerFailed(
                f"{self._called} {index + 1} of {len(self._places)}, on {place.host}:\n{place.answer.rstrip()}"
            )
        place.losses = 0
        place.took = time.monotonic() - place.since if place.made else None
        place.made = True
        if self._request[1]:
            place.state = state

    def _look(self) -> None:
        """What to do about members that do not answer."""
        now = time.monotonic()
        homeless = [place for place in self._places if not place.host]
        if any(place.state is None for place in homeless) and self._interrupted():
            raise Interrupted("members had not begun yet")
        late = [place for place in homeless if not place.shares and now - place.since > CORE_PATIENCE]
        if late:
            self._say(f"{len(late)} of {len(self._places)} {self._called}s find no core of their own, and share one")
        for place in late:
            place.shares = True
            self._again(place)
        for place in self._places:
            settled = bool(place.host) or place.shares
            if settled and place.waiting and now - place.since > self._patience:
                self._lost(place, f"no answer for {self._patience:.0f} s")

    def _name_stragglers(self) -> None:
        """Names who is slow, once for as long as it lasts."""
        for place in self._places:
            if place.took is None:
                continue
            others = [one.took for one in self._places if one is not place and one.took is not None]
            told = straggler(f"{self._called} {self._places.index(place) + 1}", place.host, place.took, others)
            if told and not place.straggles:
                self._say(told)
            place.straggles = bool(told)

    def _lost(self, place: Place, why: str) -> None:
        """Remakes a member whose node or worker is lost, or that hangs."""
        place.losses += 1
        if place.losses > TRIES:
            raise StageFailed(f"lost a {self._called} {place.losses} times in a row, the last time: {why}")
        self._say(f"a {self._called} was lost{f' on {place.host}' if place.host else ''}; another one takes its place")
        place.shares = False
        self._again(place)

    def _again(self, place: Place) -> None:
        """Sends a member anew, and asks it what it was asked."""
        import ray

        ray.kill(place.actor)
        asked = "answer" in place.waiting.values()
        self._send(place)
        if asked:
            self._begin(self._places.index(place))
