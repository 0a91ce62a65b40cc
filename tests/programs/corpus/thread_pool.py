"""`ThreadPoolExecutor`: jobs that share the port by a lock, a future with a callback, one that fails, and `map`."""

import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor, as_completed, wait

import serial

port = serial.Serial(sys.argv[1] if len(sys.argv) > 1 else "COM1", 38400, timeout=1)
lock = threading.Lock()


def ask(command):
    with lock:
        port.write(command.encode() + b"\n")
        return port.readline().decode().strip()


def mean_of(command, count):
    total = 0
    for _ in range(count):
        total += sum(map(int, ask(command).split(",")[1:]))
        time.sleep(0.02)
    return command, total / count / 8


def fail():
    time.sleep(0.1)
    raise ValueError(f"a reply must begin with x, but it was {ask('B')[:2]}")


told = []
with ThreadPoolExecutor(max_workers=3, thread_name_prefix="job") as pool:
    jobs = [pool.submit(mean_of, command, 15) for command in ("N", "O")]
    jobs.append(pool.submit(fail))
    jobs[0].add_done_callback(lambda job: told.append(job.result()[0]))
    for job in as_completed(jobs):
        error = job.exception()
        if error is not None:
            print(f"{type(error).__name__}: {error}")
    done, not_done = wait(jobs, timeout=1)
    print(len(done), len(not_done), told)
    print([0 <= job.result()[1] <= 1023 for job in jobs[:2]])
    print(list(pool.map(ask, ["D,1,1", "D,2,2", "D,0,0"])))
port.close()
