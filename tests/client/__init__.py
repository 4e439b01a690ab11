"""The package for programs, beside a real server.

test_tasks     the ten tasks of its README
test_client    what a caller relies on: pixels, errors, uploads, Ctrl-C
test_retries   a server that is full, restarts, or is away
test_local     `sunbox.render`: in this process, without a server
test_documents the types of a document are those of the schema
test_stream    frames, updates, broken connections
test_refused_edits  an edit that is refused, in every order of what a server sends
test_folders   which files a document may name, and what JSON cannot say
"""
