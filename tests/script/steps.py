"""A program whose threads do steps from a list, with what `threading` and pyserial offer. What it sees goes to `seen`.

Steps: ["sleep", ms]; ["lock", number, timeout ms, steps]; ["put", queue, item]; ["get", queue, timeout ms];
["set", event]; ["clear", event]; ["wait", event, timeout ms]; ["ask", robot, command].
"""

import queue
import threading
import time

import serial
from tests.script import seen


def do(number, kind, *rest):
    if kind == "sleep":
        time.sleep(rest[0] / 1000)
    elif kind == "lock":
        index, ms, steps = rest
        if not locks[index].acquire(timeout=ms / 1000):
            return False
        run(number, steps)
        locks[index].release()
        return True
    elif kind == "put":
        queues[rest[0]].put(rest[1])
    elif kind == "get":
        try:
            return queues[rest[0]].get(timeout=rest[1] / 1000)
        except queue.Empty:
            return None
    elif kind == "set":
        events[rest[0]].set()
    elif kind == "clear":
        events[rest[0]].clear()
    elif kind == "wait":
        return events[rest[0]].wait(rest[1] / 1000)
    elif kind == "ask":
        robot, command = rest
        with lines[robot - 1]:
            ports[robot - 1].write(command.encode())
            return ports[robot - 1].readline().decode()
    return None


def run(number, steps):
    for step in steps:
        result = do(number, *step)
        seen.note(number, [step[0], result])


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
