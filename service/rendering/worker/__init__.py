"""The process that owns the GPU: takes the newest messages, traces a slice for whose turn it is, publishes.

`python -m service.rendering.worker DESCRIPTOR` with one end of `link.pair()`.
"""
