"""Blocking pyserial in an asyncio program: `run_in_executor` and `to_thread` keep the loop free for a heartbeat."""

import asyncio
import concurrent.futures
import functools
import sys

import serial

beats = 0


async def heartbeat():
    global beats
    while True:
        await asyncio.sleep(0.1)
        beats += 1


def exchange(port, command):
    port.write(command + b"\n")
    return port.read_until(b"\r\n").decode().strip()


async def main():
    loop = asyncio.get_running_loop()
    port = serial.Serial(sys.argv[1] if len(sys.argv) > 1 else "/dev/ttyUSB1", 9600, timeout=3)
    heart = loop.create_task(heartbeat())
    with concurrent.futures.ThreadPoolExecutor(max_workers=1) as pool:
        ask = functools.partial(loop.run_in_executor, pool, exchange, port)
        print(await ask(b"D,6,6"))
        for _ in range(4):
            await asyncio.sleep(0.25)
            reply = await ask(b"H")
        left, right = map(int, reply.split(",")[1:])
        print("straight:", abs(left - right) <= 5, "far enough:", left > 400)
        # All at once: one worker takes them in turn.
        print([reply[0] for reply in await asyncio.gather(*(ask(command) for command in (b"N", b"O", b"H", b"D,0,0")))])
    print((await asyncio.to_thread(exchange, port, b"B"))[:2])
    heart.cancel()
    print("the heart beat on:", 9 <= beats <= 20)
    port.close()


asyncio.run(main())
