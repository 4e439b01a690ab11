"""The experiments of the programs that Sunbox grew out of, repeated: `sunbox bench seeds`.

They were three student projects: a renderer of one sphere with the `disney` model, a path tracer of spheres and boxes
with a bounding volume hierarchy, and a comparison of reflection models.

run         all experiments, one after the other
stage       functions that the experiments share: scenes to pictures, time in interleaved rounds, pictures to sheets
spheres     fields of spheres, with no tree and with trees of several kinds
bounces     boxes and a model of triangles, over the number of bounces
samples     a point light, and a cubemap with 1 to 4 096 samples
blur        a blurred environment against noise
reflection  reflection models beside each other
page        the page for people, as Markdown
report      writes the page, with curves and pictures
"""
