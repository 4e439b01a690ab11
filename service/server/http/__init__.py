"""Between the network and the routes: connections, keys, bounds, large answers.

guard              who may send requests, by which keys, from which hosts and pages
connections        connections below HTTP
connection_limits  bounds on the number of connections, and on how long one may stand still
compression        what everybody may read, in fewer bytes
downloads          large answers, in pieces
request_log        each request under an id, logged, counted and timed
"""
