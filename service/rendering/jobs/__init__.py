"""Renders asked for over REST.

job        one render: its progress, its image, its end
queue      all renders, with bounds on how many wait, run and are kept
turns      whose render starts next
ordered    what was asked for, and what became of it
memory     what a render takes in memory
retention  which ended renders make room
recorder   writes what becomes of a render to the store
waiting    waits for events
followers  who follows renders, and learns of their changes
reads      requests for a picture that the renderer has not answered yet
status     the status of a render, as callers see it
store      renders on the disk
"""
