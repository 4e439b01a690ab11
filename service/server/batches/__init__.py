"""Batches: one scene whose renders differ along axes.

batch     one batch: its renders, as far as there are any, and how far each of them is
members   makes its renders one after the other: what the axes leave unchanged is validated and packed once
posing    axes that are times of an animation
queue     all batches: each has a few renders in line at a time
"""
