"""A live plot: `plt.pause` draws and waits between two readings; at the end the curve is looked at."""

import sys
import time

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import serial

ser = serial.Serial(sys.argv[1] if len(sys.argv) > 1 else "COM4", 19200, timeout=1)


def encoders():
    ser.write(b"H\n")
    return [int(word) for word in ser.readline().decode().strip().split(",")[1:]]


plt.ion()
figure, axes = plt.subplots(figsize=(2, 2))
(curve,) = axes.plot([], [])
times, positions = [], []

ser.write(b"G,0,0\n")
ser.readline()
ser.write(b"D,3,3\n")
ser.readline()
start = time.time()
while time.time() - start < 1.5:
    times.append(time.time() - start)
    positions.append(encoders()[0])
    curve.set_data(times, positions)
    axes.relim()
    axes.autoscale_view()
    plt.pause(0.1)
ser.write(b"D,0,0\n")
ser.readline()
figure.canvas.draw()
print("rising:", positions == sorted(positions), "points enough:", len(curve.get_xdata()) >= 2)
print("speed as sent:", 2 < positions[-1] / times[-1] / 100 < 6)
plt.close("all")
ser.close()
