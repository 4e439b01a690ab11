"""Renders on the disk, so that they outlive the server.

record    what is stored of one render, but for its document and its pictures
fitting   JSON as this version's dataclasses, whichever version wrote it
rows      renders, their documents and idempotency keys, in an SQLite file
batch_rows  batches in the same file
pictures  checkpoints and finished pictures: a file each, written whole or not at all
check     whether the stored renders of a data folder are sound
store     all of that for the event loop: whatever touches the disk runs in threads
"""
