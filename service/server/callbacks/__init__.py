"""Callbacks: a URL that the server posts to when a render or a batch has ended.

signing   the secret, and signatures by Standard Webhooks
posting   one attempt: the host's addresses are checked, and connected to as they were checked
queue     all callbacks: what each says, which are due, retries, what is counted
"""
