"""
1600 robots at once
===================

How fast should a robot drive, and how strongly turn away from what is near? A batch tries 1600 pairs of
values, each in a world of its own, for half a minute: together 13 hours of robot's time.
"""

import matplotlib.pyplot as plt
import numpy as np

import kiks


@kiks.controller(parameters=2)
def vehicle(sensors, memory, parameters, wheels):
    near = sensors[1] + 2 * sensors[2] - 2 * sensors[3] - sensors[4]
    wheels[0] = parameters[0] + parameters[1] * near
    wheels[1] = parameters[0] - parameters[1] * near


speeds, gains = np.linspace(1, 20, 40), np.linspace(0, 0.03, 40)
pairs = np.array([(speed, gain) for gain in gains for speed in speeds])
batch = kiks.Batch(kiks.Arena.load("pillars"), worlds=len(pairs), seed=1)
rollouts = batch.run(vehicle, pairs, seconds=30, measures=[kiks.measures.roaming, kiks.measures.contacts])
roaming, contacts = rollouts.values[:, 0].T.reshape(2, 40, 40)
speed, gain = pairs[roaming.argmax()]
print(f"Robots get around most with speed {speed:.1f} and gain {gain:.4f}. {np.mean(contacts == 0):.0%} touch nothing.")

figure, axes = plt.subplots(1, 2, figsize=(9, 4), sharey=True, layout="constrained")
for panel, values, title in zip(axes, (roaming, contacts), ("how well robots get around", "contacts")):
    mesh = panel.pcolormesh(8 * speeds, gains, values, vmax=np.percentile(values, 99), shading="nearest")
    panel.set(xlabel="speed [mm/s]", title=title)
    figure.colorbar(mesh, ax=panel)
axes[0].set_ylabel("gain of the turn [pulses/10 ms a count]")
figure.savefig("thousands.png", dpi=150)
