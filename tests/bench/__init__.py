"""Benchmarks that developers run, besides those of the product: `python -m tests.bench NAME`.

__main__        the command line
laboratory      `sunbox bench tradeoff | seeds | scale`, which write pages of the source
tradeoff        the price list: the error that each setting costs which saves time
tradeoff_scenes  the scenes of `tradeoff`
tradeoff_report  the price list as a page for people
pareto          from measured curves to prices
seeds           the experiments of the programs that Sunbox grew out of
scale           what several renderers gain
scale_model     a model of a divided render, simulated and in closed form
scale_costs     the costs that the model is fed with
scale_report    tables, a figure, and a section of docs/scaling.md
compare         this checkout beside an earlier revision
compare_run     one side of `compare`
faults          which faults of a list the tests find
fault_list      the list, faults.toml
fault_plugin    what pytest runs for `faults`, and its report
first_frames    `frames`: every slider of every built-in scene, changes of scene, thumbnails
sliders         the sliders of a scene's document
under_hand      `drag`: how wrong the picture is after each step of a drag
hand            from a slider to other pixels, in a real browser
hemisphere      how error falls with samples of the hemisphere, and with time
peers           Sunbox beside Mitsuba 3 and Cycles
peer_scenes     the scenes of `peers`
peer_sunbox     Sunbox's side
peer_mitsuba    Mitsuba's side
peer_cycles     Cycles' side
peer_blender    the scenes for Cycles
device          what is to be learned of a GPU in ten minutes
standin         how work is cut for a stand-in for a GPU, in simulated time
profile         where the time of a path goes on llvmpipe
registers       registers and spills of kernels on an AMD GPU, without one
radv            what compiles them, Mesa's RADV
server          `sunbox serve` in a process of its own
soak            mixed clients for a long time
soak_clients    the clients of `soak`
soak_page       a user of the editor in a browser, for `soak`
soak_restarts   `restarts`: a thousand renders while the server is restarted, its disk fills up and its clock jumps
soak_server     the server under test of `soak` and `restarts`
soak_tally      the results of `soak`, counted
gallery         the README's pictures
verdict         false alarms of comparisons
thumbnails      the editor's pictures of the presets
thumbnail_stages  what a material is shown on, and in which light
thumbnail_shapes  shapes for materials that a ball does not show
"""
