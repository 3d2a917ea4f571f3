"""Events of the adaptive estimator, from the flags that its samples raise."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

from bench.identification import layout
from bench.identification.persistence import EVENT_KINDS, Event
from bench.identification.regressors import CHANNELS


@dataclass(frozen=True)
class EventLogSettings:
    """Numbers of `bench.identification.event_log`."""

    most: int = 1000
    """Most events kept; the oldest go first."""
    bits: int = (1 << len(EVENT_KINDS)) - 1
    """Those of the flags that are events."""


SETTINGS = EventLogSettings()


class EventLog:
    """The last events of a stream; the same kind in samples that follow each other is one event.

    Attributes:
        events: The last `EventLogSettings.most` events.
        made: How many there were.
        report_time: Time of the monitor's last report [s]; NaN before the first.
    """

    def __init__(self) -> None:
        self.events: deque[Event] = deque(maxlen=SETTINGS.most)
        self.made = 0
        self.report_time = math.nan
        self._last_seen: dict[str, int] = {}

    def note(self, flags: int, time: float, index: int) -> None:
        """Take what a sample raised.

        Args:
            flags: Bits of `bench.identification.layout`.
            time: Time stamp of the sample [s].
            index: Its count.
        """
        if flags & layout.REPORTED:
            self.report_time = time
        for bit, kind in enumerate(EVENT_KINDS):
            if not flags & (1 << bit):
                continue
            last = self._last_seen.get(kind)
            self._last_seen[kind] = index
            if last == index - 1 and self.events and self.events[-1].kind == kind:
                self.events[-1] = self.events[-1]._replace(count=self.events[-1].count + 1)
                continue
            reason = EVENT_KINDS[kind]
            if kind == "constant":
                still = [name for i, name in enumerate(CHANNELS) if flags & (layout.FIRST_CHANNEL << i)]
                reason = f"{reason}; channel: {', '.join(still)}"
            self.events.append(Event(time, kind, reason))
            self.made += 1
