"""The endpoints: a handler parses, asks, answers. What they share is `service.server.state`.

renders          renders over REST
submission       how a request for a render becomes one that waits, also where it is sent twice
batches          renders that differ along axes
batch_files      the pictures of a batch in one file
callbacks        which ends of renders and batches were told to whom
compare          whether two documents or pictures differ beyond noise
compare_answers  what a comparison takes and answers
events           the progress of renders as server-sent events
waiting          waits that end when the client goes away
stream           the stream's WebSocket
materials        a material turned into another model
export           a scene as another program's file, and what calls share that write one
bsdf             values of a material's BSDF
assets           uploads, and what they are answered
documents        saved scenes and materials
presets          built-in documents
metrics          /metrics, in Prometheus' format
info             what the service is, whether it lives, what its documents look like
answers          what answers look like, for the API's description
json_answers     answers whose JSON is made in a thread
request_fields   what requests for renders and batches share, for the description
editor_files     the files of the page
errors           errors as problem+json
description      openapi.json
examples         documents and answers that the description shows
"""
