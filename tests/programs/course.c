/* Drives a short course, as a program for a real Khepera does, and prints the encoder counts. Argument: the port. */
#include <ctype.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <unistd.h>

static int port;
static char reply[512];

static const char *ask(const char *command) {
    size_t count = 0, length = strlen(command);
    if (write(port, command, length) != (ssize_t)length) exit(1);
    while (count == 0 || reply[count - 1] != '\n')
        if (read(port, reply + count++, 1) != 1 || count == sizeof reply - 1) exit(2);
    reply[count] = 0;
    if (reply[0] != tolower(command[0])) exit(3);
    return reply;
}

int main(int argc, char **argv) {
    struct termios settings;
    if (argc != 2 || (port = open(argv[1], O_RDWR | O_NOCTTY)) < 0) return 4;
    tcgetattr(port, &settings);
    cfmakeraw(&settings);
    settings.c_cflag |= CSTOPB;
    cfsetspeed(&settings, B9600);
    tcsetattr(port, TCSANOW, &settings);
    ask("D,8,5\n");
    for (int i = 0; i < 40; i++) ask("N\n");
    ask("D,0,0\n");
    ask("C,400,300\n");
    for (int i = 0; i < 60; i++) ask("E\n");
    printf("%s", ask("H\n"));
    return 0;
}
