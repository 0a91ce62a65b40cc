/* Wander about, in C: any language that opens a serial port can drive the robot.

   cc -o wander wander.c
   kiks serve --link /tmp/khepera &
   ./wander /tmp/khepera 60        (on the real robot: ./wander /dev/ttyUSB0 60) */

#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <unistd.h>

static int port;

/* Send a command, and read its reply up to the end of the line. */
static void ask(const char *command, char *reply, size_t size)
{
    size_t length = 0;
    char c = 0;

    if (write(port, command, strlen(command)) < 0) {
        perror("write");
        exit(1);
    }
    while (c != '\n' && length + 1 < size) {
        if (read(port, &c, 1) != 1) {
            fprintf(stderr, "the robot is silent\n");
            exit(1);
        }
        reply[length++] = c;
    }
    reply[length] = 0;
}

int main(int argc, char **argv)
{
    struct termios settings;
    char reply[100];
    int n[8], steps, turns = 0;

    if (argc < 3) {
        fprintf(stderr, "usage: %s PORT STEPS\n", argv[0]);
        return 2;
    }
    port = open(argv[1], O_RDWR | O_NOCTTY);
    if (port < 0 || tcgetattr(port, &settings) < 0) {
        perror(argv[1]);
        return 1;
    }
    cfmakeraw(&settings);
    settings.c_cflag |= CSTOPB | CLOCAL | CREAD;
    settings.c_cc[VMIN] = 0;
    settings.c_cc[VTIME] = 20; /* wait two seconds at most */
    cfsetspeed(&settings, B9600);
    tcsetattr(port, TCSAFLUSH, &settings);

    for (steps = atoi(argv[2]); steps > 0; steps--) {
        ask("N\n", reply, sizeof reply);
        if (sscanf(reply, "n,%d,%d,%d,%d,%d,%d", n, n + 1, n + 2, n + 3, n + 4, n + 5) != 6) {
            fprintf(stderr, "not a reply to N: %s", reply);
            return 1;
        }
        if (n[1] > 200 || n[2] > 200 || n[3] > 200 || n[4] > 200) {
            ask("D,4,-4\n", reply, sizeof reply);
            turns++;
        } else
            ask("D,6,6\n", reply, sizeof reply);
    }
    ask("D,0,0\n", reply, sizeof reply);
    printf("turned %d times\n", turns);
    return 0;
}
