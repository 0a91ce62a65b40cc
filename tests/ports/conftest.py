"""Clients that do not sleep."""

import time
from types import SimpleNamespace

import pytest


@pytest.fixture(autouse=True)
def _quick_clients(monkeypatch: pytest.MonkeyPatch) -> None:
    """Shorten the sleeps of pyserial's clients: 0.05 s between two polls, 0.3 s after closing."""
    quick = SimpleNamespace(sleep=lambda seconds: time.sleep(min(seconds, 0.002)), time=time.time)
    for module in ("serial.rfc2217", "serial.urlhandler.protocol_socket"):
        monkeypatch.setattr(f"{module}.time", quick)
