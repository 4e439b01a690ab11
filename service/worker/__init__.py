"""The process that owns the GPU: takes the newest messages, traces a slice of the task whose turn it is, publishes.

`python -m service.worker DESCRIPTOR` with one end of `channel.pair()`.

__main__      the process: its options, its device, its end
list_devices  EGL's devices by name, and as a program that prints them
loop          takes the newest messages, chooses whose turn it is, traces a slice, publishes
scheduler     whose turn it is
task          one client's task: whether it wants a turn
task_picture  its picture, from the first update to the end
foreseen      kernels that are compiled before anything needs them, in a renderer or before there is one
bsdf_task     one question about the BSDF of a material, in its turns
updates       the update that waits to be applied, perhaps for its kernel
ending        how a render ends, and how its picture comes to the server
context       what all tasks of a process share
payloads      the payloads of messages by their types in gpu
in_process    a renderer without a process of its own, as the command line uses it
division      one picture on several renderers
device        what a task has on the device
progress      how far a picture is, its noise, how long it will take, and when it is finished
view          what a client is shown
helpers       processes that compile and denoise
"""
