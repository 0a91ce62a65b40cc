"""A robot's serial line: characters become commands, commands act when they are due, replies are sent."""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable
from typing import Annotated, Any

from pydantic import Field

from kiks.clock.serial_timing import SerialTiming
from kiks.errors import shown
from kiks.firmware.firmware import Firmware
from kiks.firmware.receiver import LINE_LIMIT
from kiks.firmware.robot_kind import robot_kind
from kiks.model.checks import CLOCK_END_NS
from kiks.model.data_file import Switch, Whole, record
from kiks.model.robot import Baud
from kiks.sim.run_log import ACT, DROP, HANG_UP, SEND, SET_BAUD, THINK, TYPE, NotedEntry, WireRecorder
from kiks.sim.wire_log import TimeShares, WireLog
from kiks.units import ns_from_s

_log = logging.getLogger("kiks.robot")

SILENCE_NS = 500_000_000
"""For how long a program waits for an answer to a command without an end of line before it gets a hint [ns]."""

OnReply = Callable[[bytes, int], None]
"""A callback that takes a reply, and when its last character arrives [ns]."""


Instant = Annotated[Whole, Field(ge=-CLOCK_END_NS, le=2 * CLOCK_END_NS)]
Count = Annotated[Whole, Field(ge=0, le=2**62)]
Characters = Annotated[str, Field(max_length=LINE_LIMIT + 1, pattern=r"^[\x00-\xff]*$")]
"""Bytes of a line, as characters of Latin-1."""


@record
class SavedWire:
    """All that a wire and its firmware remember besides the robot's record, as JSON can hold it.

    Attributes:
        line: Of `SerialTiming.save`.
        robot_baud: Speed at which the robot speaks [bit/s].
        selected_baud: Speed that the mode selector asks for [bit/s].
        wakes_ns: When the robot acts next without a command [ns]; None if it never does.
        partial: The command that is not complete.
        pending: Commands on their way: when each acts [ns], its line, and whether the host does not get the reply.
        free_ns: When the robot is free for another one [ns].
        orphan_count: Number of replies to come that are dropped.
        keeps_baud: Whether programs cannot change the speed.
    """

    line: tuple[Baud, Instant, Instant, Instant]
    robot_baud: Baud
    selected_baud: Baud
    wakes_ns: Instant | None
    partial: Characters
    pending: tuple[tuple[Instant, Characters, Switch], ...]
    free_ns: Instant
    orphan_count: Count
    keeps_baud: Switch = False


def ignore_reply(_reply: bytes, _arrival_ns: int) -> None:
    """Take a reply whose reader is gone."""


class Wire:
    """One robot's line, its firmware, and the commands that have been sent but have not acted yet.

    Args:
        firmware: The robot's.
        add_event: Is called with the time [ns] of the next event of this line and the robot's index when it is known.
        index: The robot's index.

    Attributes:
        kind: What kind of robot it leads to.
        holder: Name of the program that has opened the port; None while it is free.
        log: Records what goes over the line; None while it is not watched.
        recorder: Records the whole run; None while nothing does.
        on_act: Called with what the robot does, an entry of the kind ACT; None if unused.
        pending: Commands on their way: when each acts [ns], its line, and what takes the reply in place of the host.
        keeps_baud: Whether the line keeps its speed, whatever a program asks for.
        thinks_since_ns: Since when a real program has the port, whose every gap counts as thinking [ns]; else None.
        next_ns: When the robot does something next [ns], or None while it only waits for characters.
    """

    def __init__(self, firmware: Firmware, add_event: Callable[[tuple[int, int]], None], index: int) -> None:
        self.firmware = firmware
        self._add_event = add_event
        self._index = index
        self.line = line = SerialTiming(firmware.baud, firmware.spec.firmware.bits_per_character)
        firmware.unread_count = lambda: len(line.waiting)
        self.holder: str | None = None
        self.next_ns: int | None = None
        self.kind = robot_kind(firmware.spec.kind)
        self._processing_ns = ns_from_s(firmware.spec.firmware.processing_ms * 1e-3)
        self.pending: deque[tuple[int, bytes, OnReply | None]] = deque()
        self.log: WireLog | None = None
        self.recorder: WireRecorder | None = None
        self.on_act: Callable[[NotedEntry], object] | None = None
        self._watcher_count = 0
        self.keeps_baud = False
        self.thinks_since_ns: int | None = None
        self._free_ns = 0
        self._orphan_count = 0

    def set_baud(self, baud: int) -> None:
        """Set both ends of the line to a baud rate [bit/s], as the robot's mode selector does, unless it is kept."""
        # A case may fix the speed, whatever the program asks for.
        if self.keeps_baud:
            return
        self._note(SET_BAUD, baud)
        self.firmware.baud = self.firmware.selected_baud = baud
        self.line.set_baud(baud)

    def send(self, data: bytes, at_ns: int, on_reply: OnReply | None = None) -> None:
        """Put characters on the line; each command acts when its terminator has arrived and been processed.

        Args:
            data: The characters.
            at_ns: When they are sent [ns].
            on_reply: A callback for the replies; the host reads them if left out.
        """
        start_ns = self.line.send(len(data), at_ns)
        if (recorder := self.recorder) is not None:
            kind = SEND if on_reply is None else TYPE
            recorder.note((kind, recorder.clock.now_ns, self._index, at_ns, start_ns, data))
        character_ns = self.line.character_ns
        lines = self.firmware.receiver.feed(data)
        for index, line in lines:
            arrival_ns = start_ns + (index + 1) * character_ns
            # The robot carries out one command at a time: what arrives while it works waits.
            act_ns = max(arrival_ns, self._free_ns) + self._processing_ns
            self._free_ns = act_ns + self.firmware.busy_ns(line)
            self.pending.append((act_ns, line, on_reply))
            # The event loop gets an entry only if this line's next event has become sooner.
            if self.next_ns is None or act_ns < self.next_ns:
                self.next_ns = act_ns
                self._add_event((self.next_ns, self._index))
        if (log := self.log) is not None:
            due = list(self.pending)[len(self.pending) - len(lines) :] if lines else []
            acts = [(k, each[0]) for (k, _), each in zip(lines, due, strict=True)]
            log.send(data, start_ns, character_ns, acts, self._air_ns(at_ns, start_ns))

    def _air_ns(self, at_ns: int, start_ns: int) -> int:
        """Return for how long a piece was on a link that is not a cable [ns]."""
        return 0 if self.line.delay is None else start_ns - at_ns

    def arrived_count(self, now_ns: int) -> int:
        """Return how many characters have arrived at a time [ns] and were not read, for a program that asks."""
        count = self.line.arrived_count(now_ns)
        if not count:
            self.note_wait(now_ns)
        return count

    def note_wait(self, now_ns: int) -> None:
        """Say once that a program waits for an answer to a command that has no end of line."""
        unfinished, hinted = self.unfinished(), self.firmware.hinted
        # Commands may come in pieces: only after a long silence has the end been forgotten.
        if (
            unfinished
            and self.kind.commands
            and b"" not in hinted
            and now_ns - self.line.sending_until_ns >= SILENCE_NS
        ):
            hinted.add(b"")
            text, end, character = unfinished
            hint = "robot %d waits for the end of the line %s. A command ends in %s, the one character %s."
            _log.warning(hint, self._index + 1, text, end, character)

    def unfinished(self) -> tuple[str, str, str] | None:
        """Return what has come of a command, the name of what would end it, and that character, for messages.

        None if no command has begun.
        """
        receiver = self.firmware.receiver
        # Some receivers remember that a terminator has come before any command.
        begun = receiver.partial.strip(b"\r\n")
        if not begun:
            return None
        end = ("a line feed", r"'\n'") if receiver.closing() == b"\n" else ("a 0", r"'\0'")
        return (shown(begun.decode() if begun.isascii() else begun), *end)

    def act(self, now_ns: int) -> None:
        """Do what is due."""
        on_reply, is_command = None, bool(self.pending) and self.pending[0][0] <= now_ns
        if is_command:
            _, line, on_reply = self.pending.popleft()
            reply = self.firmware.execute(line, now_ns)
        else:
            reply = self.firmware.wake(now_ns)
        start_ns = None
        # A person has typed it: the reply takes its time on the line, but the program does not read it.
        if on_reply is not None:
            start_ns = self.line.carry(len(reply), now_ns)
            on_reply(reply, start_ns + len(reply) * self.line.character_ns)
        # The replies to the commands of a client that has hung up are dropped; the next client must not get them.
        elif not self._orphan_count:
            start_ns = self.line.answer(reply, now_ns)
        if is_command and self._orphan_count:
            self._orphan_count -= 1
            self.firmware.leave()
        if (log := self.log) is not None and start_ns is not None:
            log.answer(reply, start_ns, self.line.character_ns, now_ns, self._air_ns(now_ns, start_ns))
        if self.on_act is not None:
            sent_ns = now_ns if start_ns is None else start_ns
            self.on_act((ACT, now_ns, self._index, sent_ns, self.line.character_ns, reply))
        # The tool `serial` changes the speed behind its own reply.
        if self.firmware.baud != self.line.baud:
            self.line.set_baud(self.firmware.baud)
        self._plan()

    def is_busy(self, now_ns: int) -> bool:
        """Return whether the robot is still carrying out what it has begun before a time [ns]."""
        return now_ns < self._free_ns

    @property
    def may_speak(self) -> bool:
        """Whether something may come without another command."""
        return bool(self.pending) or self.firmware.will_speak

    def _note(self, kind: int, number: int = 0, other: int = 0) -> None:
        """Note an entry of the run, if it is recorded."""
        if (recorder := self.recorder) is not None:
            recorder.note((kind, recorder.clock.now_ns, self._index, number, other, b""))

    def _plan(self) -> None:
        """Schedule the robot's next event."""
        command_ns = self.pending[0][0] if self.pending else None
        wakes_ns = self.firmware.wakes_ns
        if wakes_ns is None or command_ns is None:
            self.next_ns = command_ns if wakes_ns is None else wakes_ns
        else:
            self.next_ns = min(command_ns, wakes_ns)
        if self.next_ns is not None:
            self._add_event((self.next_ns, self._index))

    def watch(self, now_ns: int) -> WireLog:
        """Record what goes over the line from now [ns] on; call `unwatch` once for each call."""
        self._watcher_count += 1
        log = self.log
        if log is None:
            log = self.log = WireLog(now_ns)
        return log

    def unwatch(self) -> None:
        """Stop watching; the record ends with the last watcher."""
        self._watcher_count -= 1
        if self._watcher_count == 0:
            self.log = None

    def restart_log(self, now_ns: int) -> None:
        """Begin the record of a watched line anew, as the world has gone to another time [ns]."""
        if self.log is not None:
            self.log = WireLog(now_ns)

    def think(self, from_ns: int, until_ns: int) -> None:
        """Record that the program has thought, if the line is watched or recorded."""
        if (log := self.log) is not None:
            log.think(from_ns, until_ns)
        self._note(THINK, from_ns, until_ns)

    def shares(self, from_ns: int, until_ns: int) -> TimeShares | None:
        """Return where the time of a window went; None if the line is not watched."""
        log = self.log
        return None if log is None else log.shares(from_ns, until_ns, thinks_since_ns=self.thinks_since_ns)

    def enter_client(self, holder: str, now_ns: int) -> None:
        """Give the line to a real program: all time between a reply and its next command is thinking."""
        self.holder = holder
        self.thinks_since_ns = now_ns

    def leave_client(self, now_ns: int) -> None:
        """Free the line."""
        self.holder = None
        if self.thinks_since_ns is not None:
            self.think(self.thinks_since_ns, now_ns)
        self.thinks_since_ns = None

    def stop(self, now_ns: int) -> None:
        """Stop the wheels while a program may be using the line, for a person; the program gets no reply to that."""
        # First what ends a command of which the program has sent a part.
        self.send(self.firmware.receiver.closing() + self.kind.stop, now_ns, ignore_reply)

    def halt(self, now_ns: int) -> None:
        """Stop the wheels and free the line, for a program that a user has stopped."""
        # Before it, what the program has begun to send; behind it, the reply, which is not read.
        self.hang_up()
        self.send(self.kind.stop, now_ns)
        self.hang_up()

    def drop_after(self, until_ns: int, now_ns: int) -> int:
        """Drop the host's commands that would act late, and all replies; return how many commands.

        Args:
            until_ns: Commands up to this time still act [ns].
            now_ns: The time [ns]: from now on the line is free for replies.
        """
        self._note(DROP, until_ns, now_ns)
        # What a person has typed acts all the same: it is not the host's.
        kept = [each for each in self.pending if each[0] <= until_ns or each[2] is not None]
        dropped_count = len(self.pending) - len(kept)
        if dropped_count:
            self.pending = deque(kept)
            self._free_ns = kept[-1][0] + self.firmware.busy_ns(kept[-1][1]) if kept else now_ns
            self._plan()
        self.line.cut_short(until_ns, now_ns)
        return dropped_count

    def hang_up(self) -> None:
        """Drop what the host left behind: an unfinished command, and replies that will not be read.

        Commands that were sent whole still act, and the robot drives on (khepera-protocol.md 11.3).
        """
        self._note(HANG_UP)
        self._orphan_count = len(self.pending)
        self.firmware.receiver.clear()
        self.firmware.leave()
        self.line.forget()

    def save(self) -> dict[str, Any]:
        """Return the fields of a `SavedWire`; replies that wait are not in it."""
        firmware, pending = self.firmware, self.pending
        return {
            "line": self.line.save(),
            "robot_baud": firmware.baud,
            "selected_baud": firmware.selected_baud,
            "keeps_baud": self.keeps_baud,
            "wakes_ns": firmware.wakes_ns,
            "partial": firmware.receiver.partial.decode("latin-1"),
            "pending": [(act_ns, line.decode("latin-1"), on_reply is not None) for act_ns, line, on_reply in pending],
            "free_ns": self._free_ns,
            "orphan_count": self._orphan_count,
        }

    def restore(self, saved: SavedWire) -> None:
        """Go back to what was saved; replies that came before are dropped."""
        firmware = self.firmware
        self.line.restore(*saved.line)
        firmware.baud, firmware.selected_baud = saved.robot_baud, saved.selected_baud
        self.keeps_baud = saved.keeps_baud
        firmware.wakes_ns = saved.wakes_ns
        firmware.receiver.partial = saved.partial.encode("latin-1")
        self.pending = deque(
            (act_ns, line.encode("latin-1"), ignore_reply if is_typed else None)
            for act_ns, line, is_typed in saved.pending
        )
        self._free_ns, self._orphan_count = saved.free_ns, saved.orphan_count
        self._plan()
