"""What an operator watches beside the log.

loading    what an earlier server left is taken up while health is answered
readiness  whether a picture can be rendered now
traffic    requests, counted and timed
"""
