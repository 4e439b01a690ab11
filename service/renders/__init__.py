"""Renders asked for over REST.

job         one render: its progress, its image, its end
queue       all renders, with bounds on how many wait, run and are kept
slots       which renders run, which wait, and which give way to others
turns       whose render starts next
preemption  which renders give way to one that waits
ordered     what was asked for, what became of it, and what it needs to begin
resident    what the renderer has of a render
scene       its scene: as a document while it waits, packed when it begins
memory      what a render takes in memory
documents   what the documents of renders that wait take on the disk, by owner
retention   which ended renders make room
recorder    writes what becomes of a render to the store
waiting     waits for events
followers   who follows renders, and learns of their changes
reads       requests for a picture that the renderer has not answered yet
status      the status of a render, as callers see it
store       renders on the disk
"""
