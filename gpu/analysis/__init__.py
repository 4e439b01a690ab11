"""Measurements of a scene and of the device at hand. Public.

kernel_cost    what a scene's own kernel saves beside the one for many scenes
metering       pictures without the noise meter, to measure what it costs
dispatch_times  what dispatches of chosen sizes take
slices         dispatches of another length, to measure which is best
unbounded      a renderer whose paths have no bound on their work
device_limits  what a device's driver says of itself
"""
