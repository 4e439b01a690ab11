"""What an operator reads: records, and where they go.

setup       how log records are written, chosen once at the start
formatters  a record as a line or as a JSON object, without secrets
output      where log records go
"""
