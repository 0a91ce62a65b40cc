"""A game loop: `Clock.tick` makes its rate, keys would steer, a timer event ends it."""

import os
import sys

os.environ.setdefault("SDL_VIDEODRIVER", "dummy")
os.environ["PYGAME_HIDE_SUPPORT_PROMPT"] = "1"

import pygame
import serial

FPS = 20
KEYS = {pygame.K_UP: (5, 5), pygame.K_LEFT: (-3, 3), pygame.K_RIGHT: (3, -3)}

port = serial.Serial(sys.argv[1] if len(sys.argv) > 1 else "/dev/rfcomm0", 19200, timeout=1)
pygame.init()
screen = pygame.display.set_mode((200, 200))
clock = pygame.time.Clock()
pygame.time.set_timer(pygame.QUIT, 1500, loops=1)

frames, sensors, running = 0, 0, True
port.write(b"D,2,2\n")
port.readline()
while running:
    for event in pygame.event.get():
        if event.type == pygame.QUIT:
            running = False
        elif event.type == pygame.KEYDOWN and event.key in KEYS:
            port.write(b"D,%d,%d\n" % KEYS[event.key])
            port.readline()
    port.write(b"N\n")
    reading = [int(word) for word in port.readline().split(b",")[1:]]
    sensors += len(reading)
    screen.fill((0, 0, 0))
    for place, value in enumerate(reading):
        pygame.draw.rect(screen, (255, 255, 0), (place * 25, 200 - value // 6, 20, value // 6))
    pygame.display.flip()
    frames += 1
    clock.tick(FPS)
port.write(b"D,0,0\n")
print(port.readline().decode().strip())
pygame.quit()
print("eight sensors a frame:", sensors == 8 * frames)
print("at most 20 frames a second:", 5 <= frames <= 34)
