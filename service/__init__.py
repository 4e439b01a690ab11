"""What a scene means: documents, assets, jobs, routes and the command line. No GL call is made here."""
