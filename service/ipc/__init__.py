"""Messages between the server and the renderer's process, and their transport.

messages      the messages in both directions; immutable
task_control  those by which a task stands still, goes on, ends or is saved
leases        those by which a picture is divided among renderers
channel       datagrams with arrays in shared memory beside them
server_end    the server's end of it, on the event loop
heartbeat     a counter in shared memory, by which the server sees that the renderer still works
"""
