"""Measurements of the product by the product: `sunbox bench`.

speed              paths per second, compile times, and what a person at the editor waits for
timing             how long a sample of every pixel takes
growth             what triangles cost
latency            start-up and slider moves, at the socket of a real server
hand               from a slider to other pixels, in a real browser
scenes             the scenes that are measured
machine            what was measured on
hemisphere         how error falls with samples of the hemisphere, and with time
compare            this checkout beside an earlier revision
compare_run        one side of `compare`
peers              Sunbox beside Mitsuba 3 and Cycles
peer_scenes        the scenes of `peers`
peer_sunbox        Sunbox's side
peer_mitsuba       Mitsuba's side
peer_cycles        Cycles' side
peer_blender       the scenes for Cycles
tradeoff           the price list: what every knob that buys speed costs in error
tradeoff_scenes    its scenes
tradeoff_report    the same for people
pareto             from measured curves to prices
soak               mixed clients for a long time
soak_clients       what they do
soak_page          a hand on the editor meanwhile
soak_restarts      a thousand renders while the whole server is restarted, its disk fills up and its clock jumps
soak_server        the server that is soaked
soak_tally         what they went through
seeds              the experiments of the programs that Sunbox grew out of
gallery            the README's pictures
thumbnails         the editor's pictures of the material presets
"""
