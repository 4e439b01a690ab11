"""Renders asked for over REST.

render      one render: its states, its task with a renderer, and its end
queue       all renders, with bounds on how many wait, run and are kept
slots       which renders run, which wait, and which give way to others
viewer      shows the picture of a render, from its task or from the disk
scene       its scene, as a document while it waits and packed when it begins, and the memory that this takes
documents   what the documents of renders that wait take on the disk, by owner
retention   which ended renders make room, and which stay with the renderer
recorder    writes what becomes of a render to the store
followers   who follows renders, and learns of their changes
listing     lists of renders, a page at a time
status      the states of a render, and its status as callers see it
store       renders on the disk
"""
