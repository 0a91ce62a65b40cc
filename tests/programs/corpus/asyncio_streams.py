"""Streams of pyserial-asyncio, and tasks that share them by a lock: one steers, one watches, one keeps time."""

import asyncio
import sys
import time

import serial_asyncio


class Robot:
    def __init__(self, reader, writer):
        self.reader, self.writer = reader, writer
        self.lock = asyncio.Lock()

    async def ask(self, command):
        async with self.lock:
            self.writer.write(command.encode() + b"\n")
            await self.writer.drain()
            return (await self.reader.readuntil(b"\r\n")).decode().strip()


async def watch(robot, seen):
    while True:
        seen.append(await robot.ask("N"))
        await asyncio.sleep(0.1)


async def steer(robot):
    for left, right in ((4, 4), (4, -4), (-4, -4)):
        assert await robot.ask(f"D,{left},{right}") == "d"
        await asyncio.sleep(0.5)
    return "steered"


async def main():
    port = sys.argv[1] if len(sys.argv) > 1 else "COM5"
    robot = Robot(*await serial_asyncio.open_serial_connection(url=port, baudrate=19200))
    seen = []
    began = time.monotonic()
    watching = asyncio.create_task(watch(robot, seen))
    try:
        # A task, so that it takes its turn after `watching`, as in each version of Python.
        print(await asyncio.wait_for(asyncio.create_task(steer(robot)), timeout=10))
    finally:
        watching.cancel()
        print(await asyncio.gather(watching, return_exceptions=True))
    # What was asked before the watch was cancelled may still come.
    robot.writer.write(b"D,0,0\n")
    while await robot.reader.readline() != b"d\r\n":
        pass
    print("1.5 s:", 1.4 < time.monotonic() - began < 20, "sensors:", len(seen) > 8, {each[0] for each in seen})
    robot.writer.close()


asyncio.run(main())
