"""The service: documents, files, renders, routes and the command line. No GL call is made outside of `worker`.

From the ground up, each knows those above it in this list.

problems   the errors that callers see, with their HTTP statuses
config     every limit, and the SUNBOX_* variables that set it
callback_hosts  where callbacks may be sent
quantities  sizes and times, as its fields have them
containers  whether this process is in one
colorimetry  sRGB and linear Rec.709
views      the names of AOVs and tone maps
displays   the displays and views of OpenColorIO that tone maps may name
system     Linux: processes, memory, time, threads, log records
ipc        what the server and the renderer's process say to each other
document   the scene as a person writes it, quality, built-in scenes, materials and environments
formats    files of other programs -> documents, meshes and images; pictures -> files
pack       a document -> the renderer's arrays
exports    scenes and materials -> files of other programs
worker     the renderer's process: the only room here that imports the GL side of `gpu`
renderers  the renderers' processes, kept alive, as one thing that work is sent to
server     the server's process: requests, renders, streams, storage, routes
bench      measurements of the product
cli        the command line
"""
