"""A thread reads all that the robot sends; the main thread decides. Many programs for robots are built so."""

import queue
import threading
import time

import serial

robot = serial.Serial("/dev/ttyUSB0", 9600, timeout=0.2)
readings = queue.Queue(maxsize=1)
running = True


def read():
    while running:
        reply = robot.readline().decode().strip()
        if reply.startswith("n,"):
            if readings.full():
                readings.get_nowait()
            readings.put([int(word) for word in reply.split(",")[1:]])


reader = threading.Thread(target=read)
reader.start()
for _ in range(200):
    robot.write(b"N\n")
    try:
        newest = readings.get(timeout=1)
    except queue.Empty:
        print("the robot is silent")
        break
    left, right = max(newest[0:3]), max(newest[3:6])
    robot.write(b"D,5,-2\n" if left > max(right, 150) else b"D,-2,5\n" if right > 150 else b"D,5,5\n")
    time.sleep(0.1)
robot.write(b"D,0,0\n")
time.sleep(0.2)
running = False
reader.join()
robot.close()
