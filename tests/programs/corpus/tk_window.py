"""A window with labels and a stop button; everything happens in functions that `after` calls again and again."""

import sys
import tkinter as tk

import serial


class Panel(tk.Tk):
    def __init__(self, port):
        super().__init__()
        self.title("Khepera")
        self.port = port
        self.ticks = 0
        self.replies = 0
        self.label = tk.Label(self, text="no reading yet")
        self.label.pack()
        tk.Button(self, text="Stop", command=self.stop).pack()
        self.protocol("WM_DELETE_WINDOW", self.stop)
        self.ask("D,3,3")
        self.after(50, self.tick)
        self.after(1500, self.stop)

    def ask(self, command):
        self.port.write(command.encode() + b"\n")
        return self.port.readline().decode().strip()

    def tick(self):
        self.ticks += 1
        reply = self.ask("N")
        self.replies += reply.startswith("n,")
        self.label["text"] = f"front: {reply.split(',')[3]}"
        self.after(50, self.tick)

    def stop(self):
        print("label:", self.label["text"].split(":")[0])
        print("last:", self.ask("D,0,0"))
        self.destroy()


with serial.Serial(sys.argv[1] if len(sys.argv) > 1 else "COM1", 19200, timeout=1) as port:
    panel = Panel(port)
    panel.mainloop()
print("all answered:", panel.ticks == panel.replies, "many:", panel.ticks > 10)
