"""Record8 numbers in one instruction: vectors, masks and records of eight worlds, as types of the compiler."""
