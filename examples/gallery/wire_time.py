"""
Time on the wire
================

Each character takes 11 bit times on the line, and the robot drives on all the while. One loop of a program,
which reads the sensors (``N``) and sets the speeds (``D``), takes three times as long at 9600 baud as at
38400. A robot that drives at 400 mm/s is that much farther.
"""

import matplotlib.pyplot as plt

import kiks

figure, axes = plt.subplots(figsize=(9, 2.6), layout="constrained")
for row, baud in enumerate((38400, 19200, 9600)):
    sim = kiks.Simulation(seed=1)
    robot = kiks.Khepera(sim.url(1), baud=baud)
    with sim.record("wire.mcap"):
        robot.proximity()
        robot.set_speed(5, 5)
        loop_ms = 1000 * sim.time_s
    for line in kiks.Recording("wire.mcap").table("wire"):
        text, begin_ms = line["data"].decode().strip(), 1000 * line["time_s"]
        took_ms = 1000 * 11 * len(line["data"]) / baud
        axes.barh(row, took_ms, left=begin_ms, color="tab:blue" if line["is_sent"] else "tab:orange", height=0.5)
        if baud == 9600:
            axes.text(begin_ms + took_ms / 2, row + 0.3, text, ha="center", va="bottom", fontsize="small")
    axes.text(loop_ms + 0.5, row, f"{loop_ms:.0f} ms, {400 * loop_ms / 1000:.0f} mm", va="center")
    print(f"A loop takes {loop_ms:.1f} ms at {baud} baud.")
axes.set(xlabel="time [ms]", xlim=(0, 50), ylim=(-0.4, 2.7))
axes.set_yticks(range(3), ["38400 baud", "19200 baud", "9600 baud"])
axes.spines[["top", "right"]].set_visible(False)
axes.legend(axes.patches[:2], ["to the robot", "from the robot"], loc="lower right")
figure.savefig("wire_time.png", dpi=150)
