"""A program whose threads do steps from a list, with what `threading` and pyserial offer. What it sees goes to `seen`.

Steps: ["sleep", ms]; ["lock", number, timeout ms, steps]; ["put", queue, item]; ["get", queue, timeout ms];
["set", event]; ["clear", event]; ["wait", event, timeout ms]; ["ask", robot, command].
"""

import queue
import threading
import time

import serial
from tests.script import seen


def lock(number, index, ms, steps):
    if not locks[index].acquire(timeout=ms / 1000):
        return False
    run(number, steps)
    locks[index].release()
    return True


def get(number, index, ms):
    try:
        return queues[index].get(timeout=ms / 1000)
    except queue.Empty:
        return None


def ask(number, robot, command):
    with lines[robot - 1]:
        ports[robot - 1].write(command.encode())
        return ports[robot - 1].readline().decode()


DO = {
    "sleep": lambda number, ms: time.sleep(ms / 1000),
    "lock": lock,
    "put": lambda number, index, item: queues[index].put(item),
    "get": get,
    "set": lambda number, index: events[index].set(),
    "clear": lambda number, index: events[index].clear(),
    "wait": lambda number, index, ms: events[index].wait(ms / 1000),
    "ask": ask,
}


def run(number, steps):
    for kind, *rest in steps:
        seen.note(number, [kind, DO[kind](number, *rest)])


if __name__ == "__main__":
    programs = seen.program
    ports = [serial.Serial(f"/dev/ttyUSB{number}", timeout=60) for number in range(seen.robots)]
    lines = [threading.Lock() for _ in ports]
    locks = [threading.Lock() for _ in range(3)]
    queues = [queue.Queue() for _ in range(2)]
    events = [threading.Event() for _ in range(2)]

    threads = [threading.Thread(target=run, args=(number, steps)) for number, steps in enumerate(programs) if number]
    for thread in threads:
        thread.start()
    run(0, programs[0])
    for thread in threads:
        thread.join()
    seen.note(0, "end")
