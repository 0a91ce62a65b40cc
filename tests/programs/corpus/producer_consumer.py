"""A producer asks the sensors, two consumers work on the readings, and `None` tells them that it is over."""

from __future__ import annotations

import argparse
from queue import Queue
from threading import Lock, Thread

import serial

SAMPLES = 30


class Producer(Thread):
    def __init__(self, port: serial.Serial, out: Queue, consumers: int) -> None:
        super().__init__(name="producer")
        self.port, self.out, self.consumers = port, out, consumers

    def run(self) -> None:
        for number in range(SAMPLES):
            self.port.write(b"N\n")
            values = [int(word) for word in self.port.readline().split(b",")[1:]]
            self.out.put((number, values))
        for _ in range(self.consumers):
            self.out.put(None)


class Consumer(Thread):
    def __init__(self, source: Queue, seen: set[int], lock: Lock) -> None:
        super().__init__()
        self.source, self.seen, self.lock = source, seen, lock

    def run(self) -> None:
        while (item := self.source.get()) is not None:
            number, values = item
            assert len(values) == 8, values
            with self.lock:
                self.seen.add(number)
            self.source.task_done()
        self.source.task_done()


parser = argparse.ArgumentParser()
parser.add_argument("port", nargs="?", default="/dev/ttyS0")
args = parser.parse_args()

with serial.Serial(args.port, 38400, timeout=2) as port:
    readings: Queue = Queue(maxsize=4)
    seen: set[int] = set()
    lock = Lock()
    workers = [Producer(port, readings, 2), Consumer(readings, seen, lock), Consumer(readings, seen, lock)]
    for worker in workers:
        worker.start()
    readings.join()
    for worker in workers:
        worker.join()
print(f"{len(seen)} readings, the last is {max(seen)}, queue empty: {readings.empty()}")
