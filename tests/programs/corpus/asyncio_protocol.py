"""pyserial-asyncio as its documentation has it: a protocol whose `data_received` gathers lines."""

import asyncio
import sys

import serial_asyncio


class KheperaProtocol(asyncio.Protocol):
    def __init__(self, done):
        self.done = done
        self.buffer = b""
        self.replies = []

    def connection_made(self, transport):
        self.transport = transport
        print("port opened, closing:", transport.is_closing())
        transport.write(b"D,3,3\n")

    def data_received(self, data):
        self.buffer += data
        while b"\n" in self.buffer:
            line, self.buffer = self.buffer.split(b"\n", 1)
            self.line_received(line.strip().decode())

    def line_received(self, line):
        self.replies.append(line)
        if len(self.replies) < 40:
            asyncio.get_running_loop().call_later(0.02, self.transport.write, b"N\n")
        elif len(self.replies) == 40:
            self.transport.write(b"D,0,0\n")
        else:
            self.transport.close()

    def connection_lost(self, exc):
        print("port closed:", exc)
        self.done.set_result(self.replies)


async def main(port):
    loop = asyncio.get_running_loop()
    done = loop.create_future()
    await serial_asyncio.create_serial_connection(loop, lambda: KheperaProtocol(done), port, baudrate=38400)
    replies = await asyncio.wait_for(done, 20)
    print(len(replies), "replies:", replies[0], replies[1][0], replies[-1])


asyncio.run(main(sys.argv[1] if len(sys.argv) > 1 else "/dev/ttyUSB0"))
