"""How much is read of what comes from outside: files, requests and messages (the page "Security")."""

DATA_FILE_BYTES_MAX = 4 << 20
"""A data file of a kind that has no limit of its own."""

PROJECT_FILE_BYTES_MAX = 96 << 20
"""A project with its raster."""

MAT_FILE_BYTES_MAX = 48 << 20
"""A file of MATLAB, and what it unpacks to."""

PICTURE_FILE_BYTES_MAX = 256 << 20
"""A picture: the largest arena in colours, not compressed."""

REPLAY_FILE_BYTES_MAX = 64 << 20
"""A replay of thinking times."""

CHAMPION_FILE_BYTES_MAX = 32 << 20
"""A champion."""

RESULT_FILE_BYTES_MAX = 32 << 20
"""The result of an evolution."""

ARRAY_FILE_NUMBERS_MAX = 1 << 24
"""Numbers in all arrays of a file."""

SAMPLES_FILE_NUMBERS_MAX = 1 << 20
"""Numbers in a file of samples."""

RECORD_BYTES_MAX = 64 << 20
"""A record of a recording, and a chunk of it when it is expanded."""

TEXT_COLUMN_BYTES_MAX = 1 << 30
"""A table's column of texts, each of which takes as many bytes as the longest."""

UPLOAD_BYTES_MAX = 32 << 20
"""A file that a browser uploads."""

NOTEBOOK_BYTES_MAX = 32 << 20
"""A notebook of Jupyter, with the pictures in it."""

PROGRAM_BYTES_MAX = 200_000
"""A program in the desk's editor."""

REQUEST_BYTES_MAX = 64 << 20
"""The body of a browser's request: a compressed project of 64 million cells."""

MESSAGE_BYTES_MAX = 1 << 20
"""A message over a WebSocket: a program edited in the page is one."""
