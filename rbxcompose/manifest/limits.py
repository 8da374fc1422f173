"""How large a manifest may be: what lies above is a finding before it costs time or memory."""

FILE_BYTES = 2_000_000
ALL_BYTES = 8_000_000  # sum over the files of one robot
FILES = 500
NODES = 200_000  # per file
DEPTH = 64
ALIAS_NODES = 10_000  # reached through aliases and merge keys
TEXT = 64_000  # characters of one value
KEY = 200
NUMBER = 40
