"""The resources of a task on the device.

residency          a task's GPU resources: loading, evicting idle tasks to make room, offloading, restoring
loaded_scene       a scene on the device with its pictures, and the kernel that an update needs
resolution_ladder  the same picture at several scales, the sharpest that the time allows first
memory             how much of the device's memory tasks may hold together
checkpoints        pictures under way that the server keeps
"""
