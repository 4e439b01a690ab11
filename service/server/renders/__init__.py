"""Renders asked for over REST.

job         one render, as the queue and its callers see it
queue       all renders, with bounds on how many wait, run and are kept
slots       which renders run, which wait, and which give way to others
turns       whose render starts next
recent      what each client had of the slots within the last minute
preemption  which renders give way to one that waits
ordered     what was asked for, where it stands, its scene, and where it is stored
life        the states of a render, and the places where its picture may be
rendering   its task with a renderer: opened, ended, lost, or given up for another render
viewer      shows its picture, from that task or from the disk
scene       its scene: as a document while it waits, packed when it begins
memory      what a render takes in memory
documents   what the documents of renders that wait take on the disk, by owner
retention   which ended renders make room
settled     ended renders of batches, which are rows of the store
resting     ended renders whose pictures stay with the renderer
recorder    writes what becomes of a render to the store
followers   who follows renders, and learns of their changes
listing     lists of renders, a page at a time
reads       requests for a picture that the renderer has not answered yet
status      the status of a render, as callers see it
store       renders on the disk
"""
