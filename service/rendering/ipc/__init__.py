"""What the server and the renderer's process say to each other.

messages   every message, in both directions; immutable
channel    datagrams with arrays in shared memory beside them
heartbeat  a counter in shared memory, by which the server sees that the renderer still works
"""
