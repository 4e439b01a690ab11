"""Renders asked for over REST.

job    one render: its progress, its image, its end
queue  all renders, with bounds on how many wait, run and are kept
"""
