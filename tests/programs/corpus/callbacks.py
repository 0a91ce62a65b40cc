"""A driver class of a laboratory: a daemon thread reads and calls back whoever has subscribed to a kind of reply."""

import collections
import sys
import threading
import time

import serial


class Khepera:
    def __init__(self, port="COM3", baudrate=19200):
        self.serial = serial.Serial(port=port, baudrate=baudrate, timeout=0.2)
        self.subscribers = collections.defaultdict(list)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._listen, daemon=True)
        self._thread.start()

    def on(self, letter, callback):
        self.subscribers[letter].append(callback)

    def send(self, *words):
        self.serial.write((",".join(map(str, words)) + "\n").encode())

    def _listen(self):
        while not self._stop.is_set():
            reply = self.serial.readline().decode().rstrip("\r\n")
            if reply:
                letter, *values = reply.split(",")
                for callback in self.subscribers[letter]:
                    callback(*map(int, values))

    def close(self):
        self._stop.set()
        self._thread.join()
        self.serial.close()


heard = collections.Counter()
way = []
robot = Khepera(*sys.argv[1:2])
robot.on("d", lambda: heard.update(["drive"]))
robot.on("h", lambda left, right: way.append((left, right)))
robot.on("n", lambda *values: heard.update({"sensors": len(values)}))
robot.send("G", 0, 0)
robot.send("D", 5, -5)
for _ in range(5):
    time.sleep(0.2)
    robot.send("H")
    robot.send("N")
robot.send("D", 0, 0)
time.sleep(0.3)
robot.close()
print(sorted(heard.items()))
print("turned:", all(left > 0 > right for left, right in way), "ever further:", way == sorted(way), len(way))
