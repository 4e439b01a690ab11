"""Between the network and the routes: connections, keys, bounds, large answers.

guard              who may ask, from which hosts and pages
keys               whose key somebody shows
connections        connections below HTTP
connection_limits  how many connections there are, and how long one may stand still
compression        what everybody may read, in fewer bytes
downloads          large answers, in pieces
request_log        each request under an id, logged and counted
"""
