"""What an operator reads: records, and where they go.

setup   a line or a JSON object for each event
output  where log records go
"""
