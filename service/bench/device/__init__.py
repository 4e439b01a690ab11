"""Measurements of a device in one run: `sunbox bench gpu`.

run         every part in turn, within the time that was given
report      the figures as they stand in the JSON file
table       the same for people
isolated    a measurement in a process of its own, which may fail alone; two at once
stage       scenes, pictures, and the time of a sample or of a call
scenes      costs of the built-in scenes; one kernel for many, caustics, orders of trees
pictures    reading back and encoding a picture, merging blocks of samples, lengths of dispatches
frames      first frames after changes, at the socket of a real server
"""
