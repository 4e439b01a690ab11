"""From what a caller wrote to what the renderer takes.

request_reader  documents -> packed scenes, with the server's limits and assets
request_parser  bodies -> scenes and settings, checked
batch_request   bodies -> a scene and the axes along which it varies, checked
compare_request  bodies -> two documents or pictures that are compared, checked
export_request  bodies that ask for a scene as another program's file
bsdf_request    bodies -> a material and directions, checked
parsers         what bodies are read as, by name; a material turned into another model
parser_pool     large bodies are parsed in processes of their own, within bounds of memory and time
parser_child    such a process: `python -m service.server.requests.parser_child`
bodies          JSON bodies, taken in and parsed
"""
