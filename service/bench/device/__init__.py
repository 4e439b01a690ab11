"""What a device can do, measured in one run: `sunbox bench gpu`.

run         every part in turn, within the time that was given
report      the figures as they stand in the JSON file
table       the same for people
isolated    a measurement in a process of its own, which may fail alone
stage       scenes, pictures, and the time of a sample or of a call
scenes      paths per second, compile times and memory of the built-in scenes
trees       the orders in which the nodes of a tree may be walked
dispatches  dispatches of several lengths and sizes
readout     resolving, reading back and encoding a picture
blocks      merging a block of samples, and bands that other renderers trace
kernels     one kernel for many scenes beside a scene's own
caustics    traced from the lights, and found by the camera's paths
pair        one and two processes on the device
frames      first frames after changes, at the socket of a real server
"""
