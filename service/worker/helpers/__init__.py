"""Processes beside the renderer, for work that must not hold it up.

process         one such process, started on demand
compile_client  asks for kernels to be compiled, and knows which are and which were used on this machine
compile_lane    the line of one priority, and what becomes of its kernels
kernel_wait     one kernel that a task waits for
compile_main    compiles kernels: `python -m service.worker.helpers.compile_main`
first_look_client  asks for first looks at scenes whose kernels are being compiled
denoise_client  asks for pictures to be denoised
denoise_main    denoises pictures: `python -m service.worker.helpers.denoise_main`
"""
