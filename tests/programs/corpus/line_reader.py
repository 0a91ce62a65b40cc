"""`serial.threaded`: a LineReader whose `handle_line` fills a queue, run by a ReaderThread."""

import queue
import sys
import traceback

import serial
import serial.threaded


class KheperaLines(serial.threaded.LineReader):
    TERMINATOR = b"\r\n"

    def __init__(self):
        super().__init__()
        self.replies = queue.Queue()

    def connection_made(self, transport):
        super().connection_made(transport)
        print("connected")

    def handle_line(self, line):
        self.replies.put(line)

    def connection_lost(self, exc):
        if exc:
            traceback.print_exception(exc)
        print("disconnected")

    def command(self, text):
        # The robot wants a line feed alone.
        self.transport.write(text.encode() + b"\n")
        return self.replies.get(timeout=2)


ser = serial.serial_for_url(sys.argv[1] if len(sys.argv) > 1 else "/dev/ttyUSB0", baudrate=19200, timeout=1)
with serial.threaded.ReaderThread(ser, KheperaLines) as robot:
    print(robot.command("D,4,4"))
    counts = [robot.command("N").count(",") for _ in range(15)]
    print(set(counts), len(counts))
    print(robot.command("D,0,0"))
print(ser.is_open)
