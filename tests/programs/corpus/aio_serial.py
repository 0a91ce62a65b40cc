"""aioserial: `await` on reads and writes, a worker that is fed by a queue, and a time limit that strikes."""

import asyncio
import sys

import aioserial


async def ask(port, command):
    await port.write_async(command + b"\n")
    return (await port.readline_async()).strip()


async def worker(port, orders, replies):
    while (order := await orders.get()) is not None:
        replies.append(await ask(port, order))
        orders.task_done()


async def main(name):
    port = aioserial.AioSerial(port=name, baudrate=19200, timeout=2)
    orders, replies = asyncio.Queue(), []
    working = asyncio.create_task(worker(port, orders, replies))
    for order in [b"D,5,5", *[b"N"] * 10, b"H", b"D,0,0"]:
        await orders.put(order)
    await orders.join()
    await orders.put(None)
    await working
    print(b"".join(reply[:1] for reply in replies).decode())

    port.timeout = 0.3
    try:
        # Nobody has asked anything: nothing comes.
        line = await asyncio.wait_for(port.readline_async(), timeout=1)
        print("nothing came:", line)
    except TimeoutError:
        print("too late")
    port.close()


if __name__ == "__main__":
    asyncio.run(main(sys.argv[1] if len(sys.argv) > 1 else "/dev/ttyACM0"))
