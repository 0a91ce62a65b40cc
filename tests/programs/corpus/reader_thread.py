"""A reader thread puts lines into a queue; the main thread asks and looks them up there. The commonest way of all."""

import queue
import sys
import threading
import time

import serial

PORT = sys.argv[1] if len(sys.argv) > 1 else "/dev/ttyUSB0"

ser = serial.Serial(PORT, 9600, timeout=0.1)
lines = queue.Queue()
running = True


def reader():
    while running:
        line = ser.readline()
        if line:
            lines.put(line.decode("ascii").strip())


thread = threading.Thread(target=reader)
thread.start()

ser.write(b"D,4,4\n")
print("drive:", lines.get(timeout=2))

counts = {}
end = time.time() + 1.5
while time.time() < end:
    ser.write(b"N\n")
    reply = lines.get(timeout=2)
    counts[reply[0]] = counts.get(reply[0], 0) + 1
    time.sleep(0.1)

ser.write(b"D,0,0\n")
print("stop:", lines.get(timeout=2))
print("only sensors:", list(counts) == ["n"], "about ten a second:", 8 <= counts["n"] <= 15)
running = False
thread.join()
print("left over:", lines.qsize(), "threads:", threading.active_count())
ser.close()
