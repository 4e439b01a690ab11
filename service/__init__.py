"""What a scene means: documents, assets, jobs, routes and the command line. No GL call is made outside of `worker`.

app        what is served: the routes and the editor's files
launch     how a server starts
cli        the command line; `commands` has a module for each command
config     every limit, and the SUNBOX_* variables that set it
callback_hosts  where callbacks may be sent
quantities  sizes and times, as its fields have them
containers  whether this process is in one
problems   the errors that callers see, with their HTTP statuses
colorimetry  sRGB and linear Rec.709
views      the names of AOVs and tone maps
displays   the displays and views of OpenColorIO that tone maps may name
quality    quality presets, and settings with every knob resolved
file_formats  the formats that are read and written
state      what the routes share
scene      the document as a person writes it
pack       a document -> the renderer's arrays
assets     meshes and images that scenes refer to
images     pixels -> files
presets    built-in scenes, materials and environments
exports    scenes and materials -> files of other programs
requests   from what a caller wrote to what the renderer takes
renders    renders asked for over REST
batches    renders of one scene that differ along axes
callbacks  URLs that are told of the ends of renders and batches
verdict    whether two pictures differ beyond noise
streams    scenes that are edited while they are watched
renderers  the renderers' processes, kept alive, as one thing that work is sent to
ipc        what the server and the renderer's process say to each other
worker     the renderer's process: the only room here that imports the GL side of `gpu`
routes     the endpoints
http       between the network and the routes
operation  what an operator watches
storage    the data folder
logs       a line or a JSON object for each event
system     Linux: processes, memory, time, threads
commands   the commands
bench      measurements of the product
"""
