"""Callbacks: a URL that the server posts to when a render or a batch has ended.

events    what is told: the bodies of callbacks
signing   the secret, and signatures by Standard Webhooks
posting   one attempt: the host's addresses are checked, and connected to as they were checked
queue     all callbacks: which are due, retries, what is counted
"""
