"""From what a caller wrote to what the renderer takes.

request_reader  documents -> packed scenes, with the server's limits and assets
request_parser  bodies -> scenes and settings, checked
bsdf_request    bodies -> a material and directions, checked
conversion_request  bodies -> a material turned into another model
parser_pool     large bodies are parsed in processes of their own, within bounds of memory and time
parser_child    such a process: `python -m service.requests.parser_child`
bodies          JSON bodies, taken in and parsed
"""
