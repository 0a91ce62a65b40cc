"""The Khepera's mind: bytes in, bytes out. No sockets and no physics formulas."""
