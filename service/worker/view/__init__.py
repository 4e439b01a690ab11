"""The frames and images that a client gets.

frames            frames and images of a task's picture, on demand; tables of the views that tone maps name
first_look        small pictures of a scene whose own kernel is being compiled; those by a process beside
fallback_preview  first looks by the superset kernel of the scene that was edited
first_look_main   that process: `python -m service.worker.view.first_look_main`
denoise_policy    when a picture is denoised, and what of it is shown meanwhile
prior             a guess at the picture after an edit, until it has samples of its own
"""
