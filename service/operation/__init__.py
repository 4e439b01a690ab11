"""What an operator watches beside the log.

readiness  whether a picture can be rendered now
traffic    requests, counted and timed
"""
