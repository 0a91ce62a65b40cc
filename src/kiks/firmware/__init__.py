"""The Khepera's firmware: bytes in, bytes out. No sockets and no physics formulas."""
