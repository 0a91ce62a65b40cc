"""Threads that log, each with its own `threading.local` counters; the log is kept in memory and counted."""

import logging
import logging.handlers
import sys
import threading
import time

import serial

memory = logging.handlers.BufferingHandler(10_000)
logging.basicConfig(level=logging.DEBUG, handlers=[memory], format="%(asctime)s %(threadName)s %(message)s")
log = logging.getLogger("khepera")
own = threading.local()
own.count = -1
port = serial.Serial(sys.argv[1] if len(sys.argv) > 1 else "COM2", 38400, timeout=1)
mutex = threading.Lock()
start = time.time()


def ask(command):
    own.count += 1
    with mutex:
        port.write(command.encode() + b"\n")
        reply = port.readline().decode().strip()
    log.info("%s -> %s", command, reply)
    return reply


def job(command, count):
    own.count = 0
    for _ in range(count):
        ask(command)
        time.sleep(0.03)
    log.warning("asked %d times", own.count)


threads = [threading.Thread(target=job, args=pair, name=pair[0]) for pair in (("N", 10), ("O", 15), ("H", 20))]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
print(ask("D,0,0"), "count of the main thread:", own.count)
records = memory.buffer
for thread in threads:
    mine = [record for record in records if record.threadName == thread.name]
    print(thread.name, len(mine), mine[-1].getMessage())
print("in order:", [r.created for r in records] == sorted(r.created for r in records))
print("of this run:", all(start <= record.created <= time.time() for record in records))
port.close()
