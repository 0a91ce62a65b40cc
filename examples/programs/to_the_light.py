"""Turn to the brighter side and drive there. The light sensors read less where it is brighter.

kiks run --arena office to_the_light.py
"""

import time

import serial

robot = serial.Serial("/dev/ttyUSB0", 9600, timeout=1)


def ask(command):
    robot.write(f"{command}\r\n".encode("ascii"))
    return [int(word) for word in robot.readline().decode("ascii").split(",")[1:]]


brightest = 1023
for _ in range(400):
    light, near = ask("O"), ask("N")
    brightest = min(brightest, *light)
    if max(near[1:5]) > 300:
        ask("D,5,-5")
    else:
        turn = max(-4, min(4, (sum(light[:3]) - sum(light[3:6])) // 40))
        ask(f"D,{4 + turn},{4 - turn}")
    time.sleep(0.03)
ask("D,0,0")
print("brightest reading:", brightest)
