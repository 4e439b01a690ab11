"""Measurements of the product that decide something for its user: `sunbox bench`. Those for developers are in
tests/bench.

speed            paths per second, compile times, and the latencies of the editor
timing           the time of a sample of every pixel
growth           the cost of more triangles
latency          start-up and slider moves, at the socket of a real server
scenes           the scenes that are measured
machine          a description of the machine
server           `sunbox serve` in a process of its own
device           what a device can do: `sunbox bench gpu`
tradeoff         the price list: the error that each setting costs which saves time
tradeoff_scenes  the scenes of `tradeoff`
tradeoff_report  the price list as a page for people
pareto           from measured curves to prices
seeds            the experiments of the programs that Sunbox grew out of
scale            what several renderers gain
scale_model      a model of a divided render, simulated and in closed form
scale_costs      the costs that the model is fed with
scale_report     tables, a figure, and a section of docs/scaling.md
"""
