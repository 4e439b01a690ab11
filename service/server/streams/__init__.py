"""Streams: a client edits a scene and watches it converge.

stream        one stream: what its client sends and what it is sent
sessions      streams by session, which outlive a lost connection
protocol      the messages of the stream's WebSocket, as pydantic models
flow_control  how many frames are under way, and when the next one is asked for
edit_session  the documents of a stream as they are edited, and the updates that follow
scene_diff    what two versions of a scene differ in
"""
