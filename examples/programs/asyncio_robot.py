"""Two tasks of asyncio share a robot: one drives, the other reports every five seconds."""

import asyncio

import serial


class Robot:
    """A Khepera whose commands wait for each other."""

    def __init__(self, name):
        self.port = serial.Serial(name, 9600, timeout=1)
        self.lock = asyncio.Lock()

    def exchange(self, command):
        self.port.write(command.encode() + b"\n")
        return self.port.readline().decode().strip()

    async def ask(self, command):
        async with self.lock:
            reply = await asyncio.to_thread(self.exchange, command)
        return [int(word) for word in reply.split(",")[1:]]


async def drive(robot):
    while True:
        readings = await robot.ask("N")
        await robot.ask("D,4,-4" if max(readings[1:5]) > 200 else "D,5,5")
        await asyncio.sleep(0.05)


async def report(robot):
    while True:
        await asyncio.sleep(5)
        left, right = await robot.ask("H")
        print(f"wheels have turned {0.08 * left:.0f} and {0.08 * right:.0f} mm")


async def main():
    robot = Robot("/dev/ttyUSB0")
    try:
        await asyncio.wait_for(asyncio.gather(drive(robot), report(robot)), timeout=30)
    except asyncio.TimeoutError:
        await robot.ask("D,0,0")


asyncio.run(main())
