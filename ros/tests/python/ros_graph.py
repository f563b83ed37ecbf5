"""A participant of ROS's graph over Cyclone DDS: topics, services and the node as a process."""

from __future__ import annotations

import itertools
import os
import random
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.internal import InvalidSample
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from interfaces import make, struct, with_header

T = TypeVar("T")
PROGRAMS = Path(os.environ["SONARFIX_ROS_PROGRAMS"])


def quality(reliable: bool = True, latched: bool = False, depth: int = 100) -> Qos:
    """Qualities of service."""
    return Qos(
        Policy.Reliability.Reliable(duration(seconds=1)) if reliable else Policy.Reliability.BestEffort,
        Policy.Durability.TransientLocal if latched else Policy.Durability.Volatile,
        Policy.History.KeepLast(depth),
    )


def wait_for(what: str, poll: Callable[[], T | None], seconds: float = 10.0) -> T:
    """What ``poll`` returns once it is not None."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        found = poll()
        if found is not None:
            return found
        time.sleep(0.002)
    raise AssertionError(f"no {what} within {seconds} s")


class Graph:
    """A participant."""

    def __init__(self) -> None:
        self.participant = DomainParticipant(0)
        self.writers: dict[str, DataWriter] = {}
        self.readers: dict[str, DataReader] = {}
        self.client = random.getrandbits(63)
        self.sequence = itertools.count(1)
        self.repeated = 0

    def close(self) -> None:
        """Leaves the graph."""
        self.writers.clear()
        self.readers.clear()
        del self.participant

    def writer(self, topic: str, name: str, qos: Qos | None = None) -> DataWriter:
        """A writer of a topic."""
        if topic not in self.writers:
            of = Topic(self.participant, "rt" + topic, struct(name))
            self.writers[topic] = DataWriter(self.participant, of, qos or quality())
        return self.writers[topic]

    def reader(self, topic: str, name: str, qos: Qos | None = None) -> DataReader:
        """A reader of a topic."""
        if topic not in self.readers:
            of = Topic(self.participant, "rt" + topic, struct(name))
            self.readers[topic] = DataReader(self.participant, of, qos or quality())
        return self.readers[topic]

    def matched(self, topic: str, readers: int = 1) -> None:
        """Waits until so many readers of a writer's topic are known."""
        writer = self.writers[topic]
        wait_for(f"reader of {topic}", lambda: len(writer.get_matched_subscriptions()) >= readers or None)

    def take(self, topic: str) -> list[Any]:
        """The messages of a reader since the last call."""
        # A writer that ends leaves a sample that is no message.
        return [sample for sample in self.readers[topic].take(N=1000) if not isinstance(sample, InvalidSample)]

    def next(self, topic: str, what: Callable[[Any], bool] = lambda _: True, seconds: float = 10.0) -> Any:
        """The next message that fulfils a condition."""
        return wait_for(topic, lambda: next((m for m in self.take(topic) if what(m)), None), seconds)

    def call(self, service: str, name: str, seconds: float = 10.0, **request: Any) -> Any:
        """Calls a service; asks again, because a request right after the discovery may get no response."""
        package, _, short = name.split("/")
        kinds = [with_header(f"{package}/msg/{short}_{end}") for end in ("Request", "Response")]
        key = f"service {service}"
        if key not in self.writers:
            asked, answered = (
                Topic(self.participant, f"{prefix}{service}{end}", kind)
                for prefix, end, kind in (("rq", "Request", kinds[0]), ("rr", "Reply", kinds[1]))
            )
            self.writers[key] = DataWriter(self.participant, asked, quality(depth=10))
            self.readers[key] = DataReader(self.participant, answered, quality(depth=10))
        writer, reader = self.writers[key], self.readers[key]
        wait_for(service, lambda: (writer.get_matched_subscriptions() and reader.get_matched_publications()) or None)
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            sequence = next(self.sequence)
            of = f"{package}/msg/{short}_Request"
            writer.write(make(of, request, kind=kinds[0], client=self.client, sequence=sequence))
            until = time.monotonic() + 1.0
            while time.monotonic() < until:
                for sample in reader.take(N=100):
                    if getattr(sample, "client", None) == self.client and sample.sequence == sequence:
                        return sample
                time.sleep(0.002)
            self.repeated += 1
            print(f"{service}: request {sequence} repeated")
        raise AssertionError(f"{service} does not answer")


class Process:
    """A program of the package."""

    def __init__(self, name: str, *arguments: str, log: Path) -> None:
        self.log = log.open("a")
        command = [str(PROGRAMS / name), *arguments]
        environment = {**os.environ, "RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp"}
        self.process = subprocess.Popen(command, stdout=self.log, stderr=self.log, env=environment)

    def is_running(self) -> bool:
        """Whether it runs."""
        return self.process.poll() is None

    def kill(self) -> None:
        """Ends it at once, as a crash does."""
        self.process.kill()
        self.process.wait()

    def resources(self) -> tuple[float, int]:
        """The processor's time, seconds, and the memory, kB, so far."""
        ticks = Path(f"/proc/{self.process.pid}/stat").read_text().rsplit(")", 1)[1].split()
        status = Path(f"/proc/{self.process.pid}/status").read_text()
        memory = next(line for line in status.splitlines() if line.startswith("VmRSS"))
        return (int(ticks[11]) + int(ticks[12])) / os.sysconf("SC_CLK_TCK"), int(memory.split()[1])
