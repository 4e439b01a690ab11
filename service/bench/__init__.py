"""Measurements of the product that decide something for its user: `sunbox bench`. Those for developers are in
tests/bench.

speed            paths per second, compile times, the latencies of the editor, the cost of triangles
timing           the time of a sample of every pixel
latency          start-up and slider moves, at the socket of a real server
scenes           the scenes that are measured
machine          a description of the machine
device           what a device can do: `sunbox bench gpu`
"""
