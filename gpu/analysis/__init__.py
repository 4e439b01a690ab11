"""Measurements of a scene and of the device at hand. Public.

kernel_cost    what a scene's own kernel saves beside the one with every feature on
metering       pictures without the noise meter, to measure what it costs
slices         dispatches of another length, to measure which is best
instrumented   a renderer whose kernels also count, at lines of their shaders that are named
unbounded      a renderer whose paths have no bound on their work
load_costs     what loads cost, by kind of memory and by lanes of a vector
device_limits  what a device's driver says of itself
"""
