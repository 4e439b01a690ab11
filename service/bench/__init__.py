"""Measurements of the product by the product: `sunbox bench`.

speed              paths per second, compile times, and the latencies of the editor
timing             the time of a sample of every pixel
growth             the cost of more triangles
latency            start-up and slider moves, at the socket of a real server
first_frames       every slider of every built-in scene, changes of scene, thumbnails
sliders            the sliders of a scene's document
hand               from a slider to other pixels, in a real browser
scenes             the scenes that are measured
machine            a description of the machine
hemisphere         how error falls with samples of the hemisphere, and with time
compare            this checkout beside an earlier revision
compare_run        one side of `compare`
peers              Sunbox beside Mitsuba 3 and Cycles
peer_scenes        the scenes of `peers`
peer_sunbox        Sunbox's side
peer_mitsuba       Mitsuba's side
peer_cycles        Cycles' side
peer_blender       the scenes for Cycles
tradeoff           the price list: the error that each setting costs which saves time
tradeoff_scenes    the scenes of `tradeoff`
tradeoff_report    the price list as a page for people
pareto             from measured curves to prices
soak               mixed clients for a long time
soak_clients       the clients of `soak`
soak_page          a user of the editor in a browser, for `soak`
soak_restarts      a thousand renders while the whole server is restarted, its disk fills up and its clock jumps
soak_server        the server under test of `soak`
soak_tally         the results of `soak`, counted
device             what a device can do: `sunbox bench gpu`
scale              what several renderers gain
scale_model        a model of a divided render, simulated and in closed form
scale_costs        the costs that the model is fed with
scale_report       tables, a figure, and a section of docs/scaling.md
profile            where the time of a path goes on llvmpipe
seeds              the experiments of the programs that Sunbox grew out of
gallery            the README's pictures
thumbnails         the editor's pictures of the material presets
"""
