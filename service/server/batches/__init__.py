"""Batches: one scene whose renders differ along axes.

batch     one batch: its renders, made one after the other, and how far each of them is
posing    axes that are times of an animation
queue     all batches: each has a few renders in line at a time
"""
