"""The G1's bus over Cyclone DDS. Records are sent as raw bytes, without intermediate objects."""

import contextlib
import json
import time
import types
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from cyclonedds.core import InstanceState, Policy, Qos, ReadCondition, SampleState, ViewState, WaitSet
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import IdlStruct, annotations
from cyclonedds.idl.types import array, float32, int16, int32, int64, sequence, uint8, uint16, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from iowbc.errors import UsageError
from iowbc.onboard import messages
from iowbc.onboard.messages import TOPICS, Record, from_cdr, to_cdr

SWITCHER = "rt/api/motion_switcher/"
"""Service of the robot that starts and stops its own controllers."""
CHECK_MODE = 1001
"""Request of that service that returns the active controller as `{"name": ...}`."""
KEPT = 64
"""Length of the receive queue [messages]: an eighth of a second at 500 Hz."""
NUMBERS = {"u1": uint8, "u2": uint16, "u4": uint32, "i2": int16, "i4": int32, "f4": float32}
LOOPBACK = """<General><AllowMulticast>false</AllowMulticast></General>
<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>
<Peers><Peer address="localhost"/></Peers></Discovery>"""
"""A loopback interface has no multicast: participants find each other at ports of localhost."""


def _struct(name: str, **members: Any) -> Any:
    made = types.new_class(
        name.rpartition(".")[2], (IdlStruct,), {"typename": name}, lambda space: space.update(__annotations__=members)
    )
    return annotations.final(annotations.autoid("sequential")(dataclass(made)))


def _idl_type(kind: np.dtype[np.void]) -> Any:
    annotated: dict[str, Any] = {}
    for name in kind.names or ():
        base, shape = kind[name].subdtype or (kind[name], ())
        number = NUMBERS.get(base.str[1:]) or _idl_type(base)
        annotated[name] = array[number, shape[0]] if shape else number
    return _struct(f"{messages.MODULE}.{messages.NAMES[kind]}", **annotated)


def _topic_type(kind: np.dtype[np.void]) -> Any:
    """The type with samples that hold CDR bytes as `data`."""
    made = _idl_type(kind)
    made.serialize = lambda sample, **_: sample.data
    made.deserialize = classmethod(_sample)
    return made


def _sample(kind: Any, data: bytes) -> Any:
    sample = object.__new__(kind)
    sample.data = data
    return sample


API = "unitree_api.msg.dds_"
RequestIdentity_ = _struct(f"{API}.RequestIdentity_", id=int64, api_id=int64)
RequestLease_ = _struct(f"{API}.RequestLease_", id=int64)
RequestPolicy_ = _struct(f"{API}.RequestPolicy_", priority=int32, noreply=bool)
RequestHeader_ = _struct(f"{API}.RequestHeader_", identity=RequestIdentity_, lease=RequestLease_, policy=RequestPolicy_)
Request_ = _struct(f"{API}.Request_", header=RequestHeader_, parameter=str, binary=sequence[uint8])
ResponseStatus_ = _struct(f"{API}.ResponseStatus_", code=int32)
ResponseHeader_ = _struct(f"{API}.ResponseHeader_", identity=RequestIdentity_, status=ResponseStatus_)
Response_ = _struct(f"{API}.Response_", header=ResponseHeader_, data=str, binary=sequence[uint8])


@cache
def _configured(domain: int, configuration: str) -> Domain:
    """The domain; a process can configure it only once, and it must outlive its participants."""
    return Domain(domain, configuration)


def _mode_name(response: Any) -> str | None:
    """Name of the controller in an answer of the motion switcher; None if it reports an error or no name."""
    with contextlib.suppress(ValueError):
        found = json.loads(response.data)
        if response.header.status.code == 0 and isinstance(found, dict) and isinstance(found.get("name"), str):
            return str(found["name"])
    return None


class DdsBus:
    """A participant of the bus; the kind of a message determines its topic."""

    def __init__(self, network: str, domain: int = 0) -> None:
        """`network`: interface such as `lo` or `eth0`. Raises UsageError if Cyclone DDS cannot use it."""
        extra = LOOPBACK if network == "lo" else ""
        interface = f'<General><Interfaces><NetworkInterface name="{network}"/></Interfaces></General>'
        try:
            _configured(domain, f"<CycloneDDS><Domain>{interface}{extra}</Domain></CycloneDDS>")
            self._participant = DomainParticipant(domain)
        except Exception as error:
            raise UsageError(f"--network {network}: Cyclone DDS cannot use it: {error}; see `ip link`") from error
        self._types = {kind: _topic_type(kind) for kind in TOPICS}
        self._topics = {kind: Topic(self._participant, name, self._types[kind]) for kind, name in TOPICS.items()}
        self._kept = Qos(Policy.History.KeepLast(KEPT), Policy.IgnoreLocal.Participant)
        self._readers: dict[Any, tuple[DataReader[Any], WaitSet]] = {}
        self._writers: dict[Any, DataWriter[Any]] = {}

    def publish(self, message: Record) -> None:
        kind = message.dtype
        if kind not in self._writers:
            self._writers[kind] = DataWriter(self._participant, self._topics[kind])
        self._writers[kind].write(_sample(self._types[kind], to_cdr(message)))

    def take(self, kind: np.dtype[np.void]) -> list[Record]:
        """Messages of one kind from others since the last call, oldest first."""
        samples = self._reader(kind)[0].take(KEPT)
        return [from_cdr(kind, sample.data) for sample in samples if isinstance(sample, self._types[kind])]

    def wait(self, kind: np.dtype[np.void], seconds: float) -> bool:
        """Waits for a message; False after the timeout [s]."""
        return bool(self._reader(kind)[1].wait(duration(seconds=seconds)) > 0)

    def _reader(self, kind: np.dtype[np.void]) -> tuple[DataReader[Any], WaitSet]:
        if kind not in self._readers:
            self._readers[kind] = self._listening(self._topics[kind])
        return self._readers[kind]

    def _listening(self, topic: Topic[Any]) -> tuple[DataReader[Any], WaitSet]:
        reader = DataReader(self._participant, topic, self._kept)
        waiting = WaitSet(self._participant)
        waiting.attach(ReadCondition(reader, ViewState.Any | SampleState.NotRead | InstanceState.Any))
        return reader, waiting

    def high_level_mode(self, seconds: float) -> str | None:
        """Name of the robot's active built-in controller: "" for none, None without an answer."""
        reader, waiting = self._listening(Topic(self._participant, f"{SWITCHER}response", Response_))
        writer = DataWriter(self._participant, Topic(self._participant, f"{SWITCHER}request", Request_))
        number, end = time.monotonic_ns(), time.monotonic() + seconds
        asked = RequestHeader_(RequestIdentity_(number, CHECK_MODE), RequestLease_(0), RequestPolicy_(0, False))
        while time.monotonic() < end:
            writer.write(Request_(asked, "{}", []))
            waiting.wait(duration(seconds=0.2))
            for sample in reader.take(KEPT):
                ours = isinstance(sample, Response_) and sample.header.identity.id == number
                if ours and (name := _mode_name(sample)) is not None:
                    return name
        return None

    def answer_mode_requests(self) -> None:
        """Answers mode requests as a robot without an active controller does; call it regularly."""
        if Request_ not in self._readers:
            self._readers[Request_] = self._listening(Topic(self._participant, f"{SWITCHER}request", Request_))
            topic = Topic(self._participant, f"{SWITCHER}response", Response_)
            self._writers[Request_] = DataWriter(self._participant, topic)
        for sample in self._readers[Request_][0].take(KEPT):
            if isinstance(sample, Request_):
                header = ResponseHeader_(sample.header.identity, ResponseStatus_(0))
                self._writers[Request_].write(Response_(header, '{"form": "0", "name": ""}', []))

    def close(self) -> None:
        self._readers.clear()
        self._writers.clear()
        del self._topics, self._participant
