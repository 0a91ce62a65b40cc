"""How pages carry large data: Base64 of zlib's format."""

from __future__ import annotations

import base64
import json
import zlib
from collections.abc import Iterable
from typing import Any


def packed_text(head: dict[str, Any], parts: Iterable[bytes]) -> str:
    """Return data as text: packed, the length of a JSON text, that text, and the parts."""
    text = json.dumps(head, separators=(",", ":")).encode()
    packer = zlib.compressobj(9)
    packed = [packer.compress(part) for part in (len(text).to_bytes(4, "little"), text, *parts)]
    return base64.b64encode(b"".join([*packed, packer.flush()])).decode()
