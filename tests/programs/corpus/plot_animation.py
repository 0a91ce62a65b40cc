"""matplotlib's `FuncAnimation` whose frames ask the robot; it is written to memory, frame by frame."""

import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import serial
from matplotlib.animation import AbstractMovieWriter, FuncAnimation


class Frames(AbstractMovieWriter):
    """Counts frames in place of a film."""

    def setup(self, fig, outfile, dpi=None):
        super().setup(fig, outfile, dpi)
        self.count = 0

    def grab_frame(self, **_):
        self.count += 1

    def finish(self):
        print("frames:", self.count)


port = serial.Serial(sys.argv[1] if len(sys.argv) > 1 else "/dev/ttyUSB0", baudrate=38400, timeout=1)
figure, axes = plt.subplots(figsize=(2, 2))
bars = axes.bar(range(8), [0] * 8)
axes.set_ylim(0, 1023)
readings = []


def update(frame):
    port.write(b"N\n")
    values = [int(word) for word in port.readline().split(b",")[1:]]
    readings.append(values)
    for bar, value in zip(bars, values):
        bar.set_height(value)
    return bars


animation = FuncAnimation(figure, update, frames=20, interval=50, repeat=False, cache_frame_data=False)
animation.save("nowhere", writer=Frames(fps=20))
print("all in range:", all(0 <= value <= 1023 for values in readings for value in values))
print("bars show the last:", [bar.get_height() for bar in bars] == readings[-1])
port.close()
