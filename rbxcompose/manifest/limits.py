"""How large a manifest may be: anything larger is reported before it costs time or memory."""

FILE_BYTES = 2_000_000
URDF_BYTES = 4_000_000
ALL_BYTES = 8_000_000  # sum over the files of one robot
ALL_VALUES = 20_000  # of the files of one robot; a file counts each time that it is used
FILL_TEXT = 8  # characters of a text with `${...}` that count as one value
FILES = 500
INSTANCES = 500  # of parts; each counts the text of its file towards `ALL_BYTES`
INCLUDE_DEPTH = 16
PROFILE_STEPS = 8_000  # steps of missions checked again to try the profiles of a robot
LEAST_STEPS, STEP_BYTES = 160, 250  # what each profile counts at least, and what each step's worth of text counts
STEP_VALUES = 8  # values of all files that take as long as a step
SECRET = 64_000  # bytes of a secret's file
NODES = 40_000  # values per file
URDF_ELEMENTS = 200_000
KEYS = 1_000  # of one map, such as the components of a robot or the states of a machine
DEPTH = 64
ALIAS_NODES = 10_000  # reached through aliases and merge keys
DATA_NODES = 10_000  # of one datum or input of a mission, which is read, checked and copied as a whole
TEXT = 64_000  # characters of one value
KEY = 200
NUMBER = 40
